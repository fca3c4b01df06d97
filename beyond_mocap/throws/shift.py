"""The smallest smooth shift of a path that gives it another place and another velocity at one instant.

Of all shifts s(t) that are nothing outside a window, the one with the least integral of |s|^2 + SOFT^4 |s''|^2: it
swings in and out of itself within some hundredths of a second and has no corner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SOFT = 0.05
"""s: how long a shift takes; shorter ones are smaller and more sudden."""


@dataclass(frozen=True, eq=False)
class Shifts:
    """All smallest shifts about one instant. frames: (N,) int that may be moved. rows: (N, 2): shift of each frame for
    a place 1 m away, and for a velocity 1 m/s more. cost: (2, 2) m^2 for places (m) and velocities (m/s), per axis."""

    frames: np.ndarray
    rows: np.ndarray
    cost: np.ndarray

    def of(self, place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """(N, 3) m: the shifts for another place (3,) m and another velocity (3,) m/s."""
        return self.rows @ np.stack([place, velocity])


def shifts_about(at: float, first: int, last: int, fps: float) -> Shifts:
    """The shifts about the fractional frame `at`, which are nothing before frame `first` and after frame `last`."""
    from scipy.interpolate import CubicSpline

    frames = np.arange(first, last + 1)
    count = len(frames)
    second = np.diff(np.eye(count + 4), 2, axis=0)[:, 2:-2] * fps**2
    usual = 2.0 * np.sqrt(2.0) * SOFT * fps  # so that a place alone costs its square
    energy = (np.eye(count) + SOFT**4 * second.T @ second) / usual
    padded = np.arange(first - 2, last + 3)
    spline = CubicSpline(padded, np.eye(len(padded)))
    tells = np.stack([spline(at), fps * spline(at, 1)])[:, 2:-2]
    spread = np.linalg.solve(energy, tells.T)
    cost = np.linalg.inv(tells @ spread)
    return Shifts(frames, spread @ cost, cost)
