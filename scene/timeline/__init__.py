"""Labels as NLA strips and key moments as markers; the reference video."""

REGISTERED = ("label_checks", "label_tracks", "proposals", "strip_events", "strip_lines", "strip_overlay", "video")
