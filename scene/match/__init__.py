"""Matches in the scene: everybody in kit, pitch, ball and cameras."""
