"""Time and quality on real recordings: `python -m benchmarks`, or `make bench`. Needs ../shared/data; says so where it is missing."""
