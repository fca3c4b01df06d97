"""Operators of the timeline: its editor, the labels of players, and annotating with keys."""
