"""How near the striking part comes to the ball: passing scenes, and takes at solved touches."""

from __future__ import annotations


def section() -> list[str]:
    """Lines for results.md."""
    return []
