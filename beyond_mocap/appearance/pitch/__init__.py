"""Pitches of sports: their sizes, lines, goals and balls as data, and the geometry of their lines."""
