"""Time and quality on real recordings: `python -m benchmarks`, or `make bench`. Needs ../shared/data.

- `places`    the recordings, the scenarios, and the libraries built from them
- `effort`    seconds, memory and rows of tables
- `scenarios`, `match`, `path_editing`, `throws`  synthesis and edits; players of a match; other paths; thrown balls
- `ball_touches`, `ball_contact`  the tracked ball; passing scenes and solved touches
- `markers_planted`, `markers_real`  optical markers
"""
