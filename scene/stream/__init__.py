"""Motion that arrives over this machine's own network: the character that shows it, and the use of its hits.

- `settings`: where to listen, what to detect, and the status for the panel
- `follow`: the one listener of the session, and the armature that follows the user
- `play`: a passing scene that answers the user's strikes
"""

REGISTERED = ("follow", "play", "settings")
