"""Motion that arrives over this machine's own network: the characters that show it, and the use of its hits.

- `settings`: where each stream is received, what is detected, and the status for the panel
- `follow`: the streams that are received in this session
- `streamed_body`: the armature that follows a user
- `play`: a passing scene that answers the users' strikes, `new_rally`: its start, `watchers`: players without a
  part, `rally_keys`: the keys, `rally_clock`: when a strike was, `rally_status`: the panel's lines, `shown_strike`:
  without a stream
"""

REGISTERED = ("follow", "play", "settings")
