"""Motion that arrives over this machine's own network: the body that shows it, and what is done with its hits.

- `settings`  where to listen, what to look for, and what is told of it
- `follow`    the one listener of the session, and the armature that does what the user does, kept up to date
- `play`      a passing scene that answers the user's strikes
"""
