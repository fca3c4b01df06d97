"""How natural motions look to people: a study with raters (Faustino §5.1).

- `order`     clips under neutral names, in which order each rater sees them, and study.json
- `form`      what a rater is asked and fills in: a page that works without a network
- `answers`   what came back
- `analysis`  one-sided t-tests and effect sizes; `page` all of it with pictures for a browser
"""
