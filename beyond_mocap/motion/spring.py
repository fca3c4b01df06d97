"""A critically damped spring of third order: an offset from its goal decays smoothly from any state.

Offsets are vectors (rotation vectors, metres). All three poles lie at -rate, so that nothing overshoots from rest and
the acceleration is continuous wherever the goal changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Offset:
    """An offset from the goal.

    Attributes:
        place: (..., K) offset.
        speed: (..., K) its rate of change per second.
        acceleration: (..., K) per second squared.
    """

    place: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray

    def evaluate_decay(self, seconds: np.ndarray, rate: float) -> "Offset":
        """Evaluate the decaying offset over time.

        Args:
            seconds: (T,) times from now.
            rate: per second; after 6 / rate about 6 % are left.
        Returns:
            The offset with arrays (T, ..., K).
        """
        t = np.asarray(seconds, dtype=float).reshape(-1, *[1] * np.ndim(self.place))
        a = self.place
        b = self.speed + rate * a
        c = 0.5 * (self.acceleration + 2.0 * rate * self.speed + rate**2 * a)
        remaining = np.exp(-rate * t)
        value, slope, bend = a + b * t + c * t**2, b + 2.0 * c * t, 2.0 * c
        return Offset(remaining * value, remaining * (slope - rate * value),
                      remaining * (bend - 2.0 * rate * slope + rate**2 * value))
