"""A classifier that learns acts from a few annotated clips and proposes labels for others.

- `signals`      a recording independent of its body, and the features of one moment
- `examples`     annotated clips as training examples
- `kernel`       similarity of a window to an act, and its confidence combined with the rules
- `details`      the labels beside an act: side, height, surface
- `classifier`   all learned acts, and their file; `train` learns them

    known = train_classifier(read_examples("library"))
    for one in propose_labels(motion, gaits, known):   # of `library.proposals`
        print(one.annotation, one.confidence, one.why)
"""
