"""Matches in the scene: players in kits, pitch, ball and cameras."""

REGISTERED = ("settings",)
