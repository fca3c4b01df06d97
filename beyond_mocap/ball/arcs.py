"""At which speeds a target can be reached, and by which launches: the flatter of both arcs of every speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .aim import CLOSE, aim
from .physics import Ball, length

_TIMES = 28
_LONGEST = 2.0  # times the flight of the slowest launch where there is no air: sqrt(2 far / gravity)


@dataclass(frozen=True, eq=False)
class Arcs:
    """Launches that reach one target, from the slowest to ever faster ones: speeds (N,) m/s, rising; velocities (N, 3)
    m/s; seconds (N,) of flight."""

    speeds: np.ndarray
    velocities: np.ndarray
    seconds: np.ndarray

    @property
    def slowest(self) -> float:
        """m/s below which the target cannot be reached."""
        return float(self.speeds[0])

    def at(self, speed: float) -> np.ndarray:
        """(3,) m/s: the launch of that speed, as far as there is one."""
        return np.array([np.interp(speed, self.speeds, column) for column in self.velocities.T])


def arcs(start: np.ndarray, target: np.ndarray, ball: Ball, spin: np.ndarray | None = None) -> Arcs:
    """The launches from `start` (3,) m that lead straight to `target` (3,) m, without a bounce; spin (3,) rad/s."""
    far = float(np.linalg.norm(np.asarray(target, float) - start))
    least = far / 60.0
    longest = max(_LONGEST * np.sqrt(2.0 * far / ball.gravity), 2.0 * least)
    seconds = np.geomspace(least, longest, _TIMES)
    found = aim(start, target, ball, seconds, spin=spin)
    good = np.flatnonzero(found.miss <= CLOSE)
    speeds = length(found.velocity[good])
    flat = good[: int(np.argmin(speeds)) + 1][::-1]
    return Arcs(length(found.velocity[flat]), found.velocity[flat], seconds[flat])
