"""How natural motions look to people: a study with raters (Faustino §5.1).

- `order`      clips under neutral names, and in which order each rater sees them
- `study_file` the same as study.json, and the table of clips that it is made from
- `questions`  the scale and the questions about the rater, after Faustino App. C
- `form`       what a rater fills in: a page that works without a network
- `answers`    what came back
- `analysis`   one-sided t-tests and effect sizes; `bars` the pictures, `page` all of it for a browser
"""
