"""Time and quality on real recordings: `python -m benchmarks`, or `make bench`; without ../shared/data it says so.

- `places`    the recordings, the scenarios, and the libraries that are made of them
- `effort`    seconds and memory; `markdown` tables as text
- `scenarios` the five scenarios: figures beside their targets, and `edit_time`
- `match_speed`, `match_crowd`  what a player of a match costs; everybody together
- `path_editing`  recordings on other paths (`path_shapes`)
- `ball_touches` (`touch_score`), `ball_contact`  the tracked ball; passing scenes and solved touches
- `markers_planted`, `markers_real`, `markers_release`  optical markers
- `throws`    thrown and kicked balls by the shipped weights
"""
