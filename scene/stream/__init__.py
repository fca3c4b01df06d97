"""Motion that arrives over this machine's own network: the body that shows it, and what is done with its hits.

- `settings`  where to listen, what to look for, and what is told of it
- `receiver`  the one listener of the session
- `streamed`  the armature that does what the user does
- `play`      a passing scene that answers the user's strikes
- `follow`    keeps them up to date while Blender has a window
"""
