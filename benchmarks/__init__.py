"""Time and quality: `python -m benchmarks`, or `make bench`.

Most sections need the recordings of `places.DATA`; those in `__main__.WITHOUT_DATA` measure on the shipped sample too.

- `places`    the recordings, the scenarios, and the libraries built from them
- `effort`    seconds, memory and rows of tables
- `methods`, `label_weight`  the methods of synthesis side by side, and the weight of labels that two of them have
- `scenarios`, `against_recordings`  synthesis and edits; whether classifiers tell takes from recordings
- `match`, `playback`, `scale`  players of a match; a match's frame in Blender; large libraries and long tracks
- `path_editing`, `path_experiments`  recordings on other paths; the experiments of the thesis on path editing
- `ball_touches`, `ball_contact`  the tracked ball; passing scenes and solved touches
- `live`      answers to streamed strikes
- `throws`, `pitching`  thrown and kicked balls; how the body throws
- `markers_planted`, `markers_real`, `release_margins`  optical markers; how often margins of releases hold
- `joint_gaps`, `joint_feet`  bodies from joints: gaps, and feet of which only the ankle is seen

`notes.md` has what was observed by hand; `__main__` appends it to `results.md`.
"""
