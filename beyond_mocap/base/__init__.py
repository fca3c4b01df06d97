"""Errors, small numerical functions and the settings table, shared by every feature."""
