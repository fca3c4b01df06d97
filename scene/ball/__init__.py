"""A ball aimed at a target: struck by a body, it flies, bounces or rolls there, and follows while the target is
dragged.

- `settings`   properties per ball
- `shots`      the settings as a shot of the core; the trajectory as the ball's keys and as a curve
- `live`       detects changes of target, settings or body, and updates the ball
- `handover`   lets Blender's rigid bodies move the ball from a frame on, and reverts that
"""

REGISTERED = ("live", "settings")
