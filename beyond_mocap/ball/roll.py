"""Simulate a ball that rolls from one foot to the next: it slows all the time and rests where it has time left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.track import BALL_RADIUS

ROLLING = 1.0
"""m/s^2: deceleration of a football on turf (FIFA's test of pitches: 4 to 8 m of roll from a 1 m ramp)."""
_GRAVITY, _BOUNCE = 9.81, 0.55
_ON_GROUND = 0.03  # m above its radius up to which a ball counts as rolling
_LEAST_HOP = 0.02  # m; a lower hop counts as rolling


@dataclass(frozen=True, eq=False)
class Speeds:
    """Velocities of rolling balls on the ground.

    Attributes:
        start_velocity: (..., 2) m/s at the start.
        end_velocity: (..., 2) m/s at the end.
        rolling_seconds: (...,) s before the ball rests.
    """

    leaves: np.ndarray
    arrives: np.ndarray
    rolling: np.ndarray


@dataclass(frozen=True, eq=False)
class Rolls:
    """P rolling balls.

    Attributes:
        balls: (P, D, 3) m, the ball's centre at frames 1 .. D after its start.
        height_error: (P,) m by which it is too high or too low at the end, or higher in between than at both ends.
    """

    balls: np.ndarray
    missed: np.ndarray


def speeds_of(starts: np.ndarray, ends: np.ndarray, seconds: np.ndarray) -> Speeds:
    """Compute the speeds of a ball that rolls from `starts` to `ends` in a given time.

    It decelerates by ROLLING all the time, or comes to rest early if it has time.

    Args:
        starts: (..., 2 or 3) m.
        ends: (..., 2 or 3) m.
        seconds: (...,) s.
    Returns:
        The speeds.
    """
    way = ends[..., :2] - starts[..., :2]
    length = np.hypot(way[..., 0], way[..., 1])
    rests = length < 0.5 * ROLLING * seconds**2
    fast = np.where(rests, np.sqrt(2.0 * ROLLING * length), length / seconds + 0.5 * ROLLING * seconds)
    rolling = np.where(rests, fast / ROLLING, seconds)
    along = way / np.maximum(length, 1e-9)[..., None]
    return Speeds(along * fast[..., None], along * (fast - ROLLING * rolling)[..., None], rolling)


def rolls(starts: np.ndarray, ends: np.ndarray, frames: np.ndarray, fps: float) -> Rolls:
    """Simulate balls that roll from `starts` to `ends`.

    A ball that starts high falls and hops; a ball that ends high is sent upward to arrive there.

    Args:
        starts: (P, 3) m.
        ends: (P, 3) m.
        frames: (P,) whole frames from start to end.
        fps: frames per second.
    Returns:
        The balls' positions and height errors.
    """
    speeds = speeds_of(starts, ends, frames / fps)
    at = np.arange(1, int(frames.max()) + 1) / fps
    gone = np.minimum(at, speeds.rolling[:, None])
    fast = np.hypot(speeds.leaves[:, 0], speeds.leaves[:, 1])
    along = speeds.leaves / np.maximum(fast, 1e-9)[:, None]
    done = fast[:, None] * gone - 0.5 * ROLLING * gone**2
    height, missed = _heights(starts[:, 2], ends[:, 2], frames / fps, at)
    level = starts[:, None, :2] + done[..., None] * along[:, None]
    return Rolls(np.concatenate([level, height[..., None]], axis=-1), missed)


def _heights(starts: np.ndarray, ends: np.ndarray, seconds, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute heights (P, D) m at times `at` (D,) s, and their error (P,) m against `ends` (P,) m."""
    out, missed = np.full((len(ends), len(at)), BALL_RADIUS), np.zeros(len(ends))
    for pair in np.flatnonzero(np.maximum(starts, ends) > BALL_RADIUS + _ON_GROUND):
        start, end, until = starts[pair], ends[pair], seconds[pair]
        if end > BALL_RADIUS + _ON_GROUND:
            upward = (end - start) / until + 0.5 * _GRAVITY * until
            out[pair] = np.maximum(start + upward * at - 0.5 * _GRAVITY * at**2, BALL_RADIUS)
            missed[pair] = max(out[pair, at < until].max(initial=0.0) - max(start, end), 0.0)
        else:
            out[pair] = _falling(start, at)
            missed[pair] = abs(np.interp(until, at, out[pair]) - end)
    return out, missed


def _falling(start: float, at: np.ndarray) -> np.ndarray:
    """Simulate a ball dropped at `start` m that hops until it rolls; (D,) m at times `at` (D,) s."""
    above = max(start - BALL_RADIUS, 0.0)
    if above < _LEAST_HOP:
        return np.full(len(at), BALL_RADIUS)
    out = above - 0.5 * _GRAVITY * at**2
    lands, up = np.sqrt(2.0 * above / _GRAVITY), np.sqrt(2.0 * above * _GRAVITY) * _BOUNCE
    while up**2 / (2.0 * _GRAVITY) > _LEAST_HOP:
        since = at - lands
        out = np.where(since > 0.0, up * since - 0.5 * _GRAVITY * since**2, out)
        lands, up = lands + 2.0 * up / _GRAVITY, up * _BOUNCE
    return BALL_RADIUS + np.where(at < lands, np.maximum(out, 0.0), 0.0)
