"""Rating studies of how natural motions look (Faustino §5.1).

- `order`     clips under neutral names, each rater's order, and study.json
- `form`      the questions and the page that a rater fills in, which needs no network
- `answers`   reads the raters' answers
- `analysis`  one-sided t-tests and effect sizes; `page` presents them with plots for a browser
"""
