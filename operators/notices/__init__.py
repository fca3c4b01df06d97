"""Operators of notices about what failed."""
