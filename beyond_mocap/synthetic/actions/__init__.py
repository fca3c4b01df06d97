"""Synthetic actions that stand in for labels that no recording carries."""
