"""Pitch, ball, character mesh and cameras."""
