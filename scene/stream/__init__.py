"""Motion that arrives over this machine's own network: the body that shows it, and what is done with its hits.

- `settings`  where to listen, what to look for, and what is told of it
- `receiver`  the one listener of the session
- `streamed`  the armature that does what the user does
- `follow`    keeps both up to date while Blender has a window
"""
