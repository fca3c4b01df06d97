"""Easing curves from 0 to 1 with zero slope at both ends, and polynomials between given end conditions."""

from __future__ import annotations

import numpy as np


def smoothstep(x: np.ndarray, start: float | np.ndarray = 0.0, end: float | np.ndarray = 1.0) -> np.ndarray:
    """Ease from 0 at `start` to 1 at `end` with a cubic whose slope is zero at both ends.

    Args:
        x: (...), in the unit of `start` and `end`.
        start, end: where the curve leaves 0 and where it reaches 1; `end` may be below `start`.
    Returns:
        (...), 0 to 1.
    """
    x = np.clip((x - start) / (end - start), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def quintic_step(x: float | np.ndarray) -> np.ndarray:
    """Ease from 0 at 0 to 1 at 1 with a quintic whose first and second derivatives vanish at both ends.

    Args:
        x: (...).
    Returns:
        (...), 0 to 1; the values at x and 1 - x add up to 1.
    Source: Perlin 2002, "Improving noise".
    """
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 + x * (6.0 * x - 15.0))


def quintic_step_by_powers(x: np.ndarray) -> np.ndarray:
    """Compute `quintic_step` as a sum of powers: equal except for the last bit.

    Takes that were saved with this form depend on that bit.

    Args:
        x: (...).
    Returns:
        (...), 0 to 1.
    """
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def hermite(share: np.ndarray, start, start_slope, end, end_slope) -> np.ndarray:
    """Interpolate with Hermite's cubic from one value and slope to another.

    Args:
        share: (...), 0 to 1, position between start and end.
        start, end: (...), the values at both ends.
        start_slope, end_slope: (...), the slopes at both ends, per unit of `share`.
    Returns:
        (...), in the unit of the values.
    """
    s2, s3 = share**2, share**3
    return (
        (2 * s3 - 3 * s2 + 1) * start + (s3 - 2 * s2 + share) * start_slope
        + (3 * s2 - 2 * s3) * end + (s3 - s2) * end_slope
    )  # fmt: skip
State = tuple
"""Time in seconds, position (2,) m and velocity (2,) m/s."""


def interpolate_quintic(times: np.ndarray, before: State, after: State) -> np.ndarray:
    """Interpolate with the quintic between two states, with zero acceleration at both ends.

    Args:
        times: (N,) seconds.
        before, after: the states (time, position, velocity) at both ends.
    Returns:
        (N, 2) m.
    """
    (start, start_position, start_velocity), (end, end_position, end_velocity) = before, after
    length = max(end - start, 1e-9)
    x = ((np.asarray(times) - start) / length)[:, None]
    h = end_position - start_position
    a, b = length * start_velocity, length * end_velocity
    # x runs from 0 to 1; slopes are per unit of x. The coefficients follow from position, slope and zero curvature at x
    # = 1 (those at x = 0 fix the lower three powers).
    third, fourth, fifth = 10 * h - 6 * a - 4 * b, -15 * h + 8 * a + 7 * b, 6 * h - 3 * a - 3 * b
    return start_position + a * x + third * x**3 + fourth * x**4 + fifth * x**5
