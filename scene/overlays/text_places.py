"""Places for texts in the 3D view, so that none lies over another."""

from __future__ import annotations

Box = tuple[float, float, float, float]
"""Left, bottom, right, top in pixels."""

MOST_STEPS = 8  # rows that a text may be moved up to be free of others


def find_free_box(box: Box, taken: list[Box], gap: float) -> Box | None:
    """Find the lowest place for a text at or above its own.

    Args:
        box: where it would stand.
        taken: what other texts cover.
        gap: pixels between two of them.
    Returns:
        The place; None where some rows up nothing is free.
    """
    left, bottom, right, top = box
    step = top - bottom + gap
    for number in range(MOST_STEPS):
        moved = (left, bottom + number * step, right, top + number * step)
        if not any(_overlaps(moved, other) for other in taken):
            return moved
    return None


def _overlaps(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
