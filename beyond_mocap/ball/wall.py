"""Where a ball that flies freely meets an upright wall, or the ground before it (Fredriksson §8.2's impact points)."""

from __future__ import annotations

import numpy as np

from .flight import LEAST_HOP, Launch, fly
from .physics import Ball

_LONGEST = 6.0  # s that a flight is followed
_STEP = 0.004  # s between the places that are looked at


def meets_wall(
    position: np.ndarray, velocity: np.ndarray, ball: Ball, foot: np.ndarray, ahead: np.ndarray,
    spin: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[np.ndarray, float]:
    """Place (3,) m of the ball's centre at the wall and seconds after its launch; at its first touch of the ground
    where that comes first, and where it is after 6 s or four times what it would take without air where neither does.

    position (3,) m, velocity (3,) m/s, spin (3,) rad/s: the launch. foot (2,) m: a point of the wall on the ground,
    ahead (2,): from where it is thrown towards it, the wall's normal.
    """
    unhindered = np.hypot(*(foot - position[:2])) / max(np.hypot(*velocity[:2]), 1e-9)
    free = position[2] > ball.radius or velocity[2] > LEAST_HOP  # else it bounces as it is launched
    flight = fly(Launch(0.0, position, velocity, spin), ball, min(_LONGEST, 0.5 + 4.0 * unhindered), landing=free)
    touches = [time for time in (*flight.bounces[:1], flight.rolls_from) if time is not None and time > _STEP]
    last = min(touches, default=flight.end)
    times = np.append(np.arange(0.0, last, _STEP), last)
    places = flight.at(times)
    beyond = (places[:, :2] - foot) @ (np.asarray(ahead, float) / np.hypot(*ahead))
    through = np.flatnonzero((beyond[:-1] < 0.0) & (beyond[1:] >= 0.0))
    if not len(through):
        return places[-1], float(last)
    i = int(through[0])
    share = -beyond[i] / (beyond[i + 1] - beyond[i])
    seconds = times[i] + share * (times[i + 1] - times[i])
    return flight.at(np.array([seconds]))[0], float(seconds)
