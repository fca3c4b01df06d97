"""Paths: curves with a parameter, their length, and the path that a body's root follows."""
