"""Operators that deliver what was made, as pictures."""
