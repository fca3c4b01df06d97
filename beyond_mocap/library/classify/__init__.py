"""Label ten, get the rest: a classifier that learns acts from a few annotated clips and proposes them for others.

- `signals`      a recording without whose body it is, and what one moment of it looks like
- `examples`     what people have said about a few clips
- `kernel`       how much a window looks like an act, and how sure that makes, beside what the rules say
- `details`      the words beside an act: side, height, surface
- `classifier`   what is known of each act, and of all, and its file; `train` learns it

    known = trained(examples_of("library"))
    for one in propose(motion, gaits, known):          # of `library.proposals`
        print(one.annotation, one.confidence, one.why)
"""
