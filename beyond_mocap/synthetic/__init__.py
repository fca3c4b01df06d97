"""Synthetic motion: parametric gaits, kicks, throws and other moves; recordings with ground truth.

- `gait`, `footsteps`, `steps`  locomotion; `gestures` touches on the way, `volleys` out of a stand, `moves`, `lying`
- `kicks`          a kick of three steps from published kinematics, `kick_styles` its variations
- `running_kicks`  a swing laid onto a run; `recorded_kicks` those of a library's own best kicker
- `actions`        whatever a label asks for: `actions.table` has a row for each
- `ground_truth`   recordings with known answers
"""
