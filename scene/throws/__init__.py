"""Throws and kicks at a target: networks generate the motion, the armature plays it, and the ball flies.

- `settings`     properties in the panel, and the throw that an armature stores
- `throw_task`   the settings as plain values; motion of target and ball
- `generation`   generate the requested throw, in any thread
- `preview`      show the throw on the armature, apply or revert it; update it when target or settings change
- `rig_throw`    the same on the controls of a rig
- `ball_motion`  the ball: held or at rest, then its flight and its trajectory
"""

REGISTERED = ("preview", "settings")
