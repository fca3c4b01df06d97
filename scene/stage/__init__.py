"""Pitch, ball, body, cameras."""
