"""Pitch, ball, character mesh and cameras."""

REGISTERED = ("settings",)
