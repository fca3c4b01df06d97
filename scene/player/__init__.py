"""A player's track, dot, pins and labels in the view."""
