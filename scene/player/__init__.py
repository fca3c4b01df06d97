"""A player's track, dot, pins, heading keys and labels in the view."""
