"""Easing: curves from 0 to 1 with level ends, and the cubic between two slopes."""

from __future__ import annotations

import numpy as np


def smoothstep(x: np.ndarray, start: float = 0.0, end: float = 1.0) -> np.ndarray:
    """0 up to `start`, 1 from `end` on, a cubic with level ends between.

    Args:
        x: (...), in the unit of `start` and `end`.
        start, end: where it begins to rise and where it is up; `end` may be below `start`.
    Returns:
        (...), 0 to 1.
    """
    x = np.clip((x - start) / (end - start), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def quintic_step(x: float | np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, a quintic between whose slope and bend vanish at both ends.

    Args:
        x: (...).
    Returns:
        (...), 0 to 1; the values at x and 1 - x add up to 1.
    Source: Perlin 2002, "Improving noise".
    """
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 + x * (6.0 * x - 15.0))


def quintic_step_by_powers(x: np.ndarray) -> np.ndarray:
    """`quintic_step` summed by powers: equal but for the last bit, which takes made before must keep.

    Args:
        x: (...).
    Returns:
        (...), 0 to 1.
    """
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def hermite(share: np.ndarray, start, start_slope, end, end_slope) -> np.ndarray:
    """Hermite's cubic from one value and slope to another.

    Args:
        share: (...), 0 to 1, how far it is from start to end.
        start, end: (...), the values there.
        start_slope, end_slope: (...), the slopes there, per unit of `share`.
    Returns:
        (...), in the unit of the values.
    """
    s2, s3 = share**2, share**3
    return (
        (2 * s3 - 3 * s2 + 1) * start + (s3 - 2 * s2 + share) * start_slope
        + (3 * s2 - 2 * s3) * end + (s3 - s2) * end_slope
    )  # fmt: skip
State = tuple
"""A second, a place (2,) m and a velocity (2,) m/s."""


def quintic_between(times: np.ndarray, before: State, after: State) -> np.ndarray:
    """(N, 2) m: the quintic from one state to the other without acceleration at either end."""
    (start, place, leaves), (end, goal, comes) = before, after
    length = max(end - start, 1e-9)
    x = ((np.asarray(times) - start) / length)[:, None]
    h = goal - place
    a, b = length * leaves, length * comes
    third, fourth, fifth = 10 * h - 6 * a - 4 * b, -15 * h + 8 * a + 7 * b, 6 * h - 3 * a - 3 * b
    return place + a * x + third * x**3 + fourth * x**4 + fifth * x**5
