"""Paths: curves with a parameter, their length, and the line that a body follows."""
