"""At which speeds a target can be reached, and by which launches: the flatter of both arcs of every speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.time_series import interpolate
from . import batch
from .aim import CLOSE, aim
from .physics import Ball, length

_TIMES = 28  # flight times tried, evenly spaced in their logarithm
_ELEVATIONS = np.radians(np.arange(0.0, 76.0, 5.0))  # above the line to the target
_SLACK = 1.03  # on a speed, for what lies between elevations
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
        return interpolate(speed, self.speeds, self.velocities)


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


def out_of_reach(
    start: np.ndarray, target: np.ndarray, ball: Ball, speed: float, spin: np.ndarray | None = None
) -> bool:
    """Whether no launch from `start` (3,) m of at most `speed` m/s comes as far as `target` (3,) m: a fan of flights,
    far quicker than looking for the launch, and never wrong about a target that can be reached."""
    way = np.asarray(target, float) - start
    level = float(np.hypot(way[0], way[1]))
    rise = np.minimum(np.arctan2(way[2], level) + _ELEVATIONS, np.radians(89.0))
    ahead = np.array([way[0], way[1], 0.0]) / max(level, 1e-9)
    velocity = _SLACK * speed * (np.cos(rise)[:, None] * ahead + np.sin(rise)[:, None] * [0.0, 0.0, 1.0])
    count = np.zeros(len(rise), int)
    spin = np.zeros(3) if spin is None else np.asarray(spin, float)
    balls = batch.Balls(
        np.tile(np.asarray(start, float), (len(rise), 1)), velocity, np.tile(spin, (len(rise), 1)), count, count
    )
    longest = 2.0 * speed / ball.gravity + 1.0
    for _ in range(int(np.ceil(longest / batch.STEP))):
        before = balls.position
        balls = batch.after(balls, ball, batch.STEP, most_bounces=0)
        here, there = (np.array([(place - start) @ ahead, place[:, 2]]) for place in (before, balls.position))
        passes = (here[0] < level) & (there[0] >= level)
        share = (level - here[0]) / np.maximum(there[0] - here[0], 1e-9)
        if np.any(passes & (here[1] + share * (there[1] - here[1]) >= target[2] - CLOSE)):
            return False
        if not np.any((there[0] < level) & (there[1] > min(target[2], start[2]) - 5.0)):
            break
    return True
