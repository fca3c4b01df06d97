"""Operators of the library: its folder, its clips, and their labels."""
