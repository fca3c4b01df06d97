"""A ball aimed at a target: struck by a body, it flies, bounces or rolls there, and follows while the target is
dragged.

- `settings`   what the panel shows, per ball
- `shots`      the settings as a shot of the core, its way as the ball's keys and as a curve
- `live`       sees that target, settings or body have changed, and has the ball aimed again
- `handover`   Blender's rigid bodies take the ball over on a frame, and give it back
"""
