"""Sees that a passing scene has been edited, and has it solved again."""

from __future__ import annotations

from time import perf_counter

_seen = {"dirty": False, "changed": 0.0}


def mark() -> None:
    """Something has changed that may matter."""
    _seen["dirty"], _seen["changed"] = True, perf_counter()
