"""A player's track, dot, pins, heading keys and labels in the view."""

REGISTERED = ("contact_edits", "dots", "drawn_track", "heading_keys", "pins")
