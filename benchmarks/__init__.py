"""Time and quality on real recordings: `python -m benchmarks`, or `make bench`; without ../shared/data it says so.

- `places`    the recordings, the scenarios, and the libraries that are made of them
- `effort`    seconds and memory
- `paper`     Faustino's printed tables and ours below them
- `misses`    which targets are missed, where in the takes, and what lies behind it
- `path_editing`  recordings on other paths (`path_shapes`); `path_cycles` on longer and shorter ones;
  `path_experiments` makes the pictures of docs/ (`path_plots`)
- `compare`   two ways of one thing, measured once
"""
