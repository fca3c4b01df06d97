"""Errors, small numerics and the table of settings, for every room."""
