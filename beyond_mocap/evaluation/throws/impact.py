"""Where the ball of a generated throw lands, against where it was to land (Fredriksson §4.5, §8.2).

A hand that lets go at a fractional frame gives the ball the place and velocity of a cubic through the four places
that the held ball has at the frames around it.
"""

from __future__ import annotations

import numpy as np

from ...ball.batch import after, launched
from ...ball.physics import BASEBALL, Ball
from ...motion import quaternion

WALL = 4.0
"""m from the thrower to the target, a square of 3 m (Fredriksson §8.2)."""
_STEP = 0.004  # s: between them a ball falls less than 0.02 mm off the chord
_LONGEST = 8.0  # s


def held_ball(places: np.ndarray, turns: np.ndarray, grip: np.ndarray) -> np.ndarray:
    """Places (T, 3) m of a ball in a hand joint at `places` (T, 3) turned by quaternions (T, 4); grip (3,) m in the
    joint's own axes."""
    return np.asarray(places, float) + quaternion.rotate(np.asarray(turns, float), np.asarray(grip, float))


def let_go(ball: np.ndarray, release: float, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Place (3,) m and velocity (3,) m/s at the fractional frame `release` of a ball held at `ball` (T, 3), T >= 4."""
    first = int(np.clip(np.floor(release) - 1, 0, len(ball) - 4))
    ways = np.vander(np.arange(4.0), increasing=True)
    powers = np.linalg.solve(ways, np.asarray(ball, float)[first : first + 4])  # (4, 3), of frames since `first`
    since = float(release) - first
    place = since ** np.arange(4) @ powers
    rate = np.array([0.0, 1.0, 2.0 * since, 3.0 * since**2]) @ powers
    return place, rate * fps


def impact(place: np.ndarray, velocity: np.ndarray, target: np.ndarray, ball: Ball = BASEBALL) -> np.ndarray:
    """Where balls first cross the vertical plane through the target square to the level line from their launch to it,
    or meet the ground before that: (B, 3) m. place, velocity, target: (B, 3). NaN where neither happens in 8 s."""
    place, velocity, target = (np.atleast_2d(np.asarray(value, float)) for value in (place, velocity, target))
    way = (target - place) * [1.0, 1.0, 0.0]
    far = np.linalg.norm(way, axis=-1)
    way = way / np.maximum(far, 1e-9)[:, None]
    balls = launched(place, velocity, None, ball)
    out = np.full(balls.position.shape, np.nan)
    flying = np.ones(len(out), bool)
    for _ in range(int(_LONGEST / _STEP)):
        before = balls.position.copy()
        balls = after(balls, ball, _STEP, most_bounces=0)
        short = [np.stack([far - np.sum((at - place) * way, axis=-1), at[:, 2] - ball.radius]) for at in
                 (before, balls.position)]  # (2, B) m: to the plane, to the ground
        meets = (short[1] < 0.0) & flying
        share = np.where(meets, short[0] / np.maximum(short[0] - short[1], 1e-12), 1.0).min(axis=0)
        ends = meets.any(axis=0)
        out[ends] = (before + np.clip(share, 0.0, 1.0)[:, None] * (balls.position - before))[ends]
        flying &= ~ends
        if not flying.any():
            break
    return out
