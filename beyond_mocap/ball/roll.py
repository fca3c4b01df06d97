"""Simulate a ball that rolls from one foot to the next: it slows all the time and rests where it has time left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.supports import GRAVITY
from ..motion.track import BALL_RADIUS
from .physics import FOOTBALL, compute_deceleration

_BOUNCE = 0.55
_ON_GROUND = 0.03  # m above its radius up to which a ball counts as rolling
_MIN_HOP_HEIGHT = 0.02  # m; a lower hop counts as rolling
# m above the ground up to which the ground alone lifts a rolling ball to a foot: half its size; feeds' heights of
# rolling balls are off by as much
_BOBBLE = 0.1


@dataclass(frozen=True, eq=False)
class RollSpeeds:
    """Velocities of rolling balls on the ground.

    Attributes:
        start_velocity: (..., 2) m/s at the start.
        end_velocity: (..., 2) m/s at the end.
        rolling_seconds: (...,) s before the ball rests.
        deceleration: (...,) m/s^2 while it rolls.
    """

    start_velocity: np.ndarray
    end_velocity: np.ndarray
    rolling_seconds: np.ndarray
    deceleration: np.ndarray


@dataclass(frozen=True, eq=False)
class RollResult:
    """P rolling balls.

    Attributes:
        balls: (P, D, 3) m, the ball's centre at frames 1 .. D after its start.
        height_error: (P,) m by which it is too high or too low at the end, or higher in between than at both ends.
    """

    balls: np.ndarray
    height_error: np.ndarray


def compute_roll_speeds(starts: np.ndarray, ends: np.ndarray, seconds: np.ndarray) -> RollSpeeds:
    """Compute the speeds of a ball that rolls from `starts` to `ends` in a given time.

    It decelerates evenly, by what ground and air take at its mean speed, or comes to rest early if it has time.

    Args:
        starts: (..., 2 or 3) m.
        ends: (..., 2 or 3) m.
        seconds: (...,) s.
    Returns:
        The speeds.
    """
    offset = ends[..., :2] - starts[..., :2]
    length = np.hypot(offset[..., 0], offset[..., 1])
    slows = compute_deceleration(length / seconds, FOOTBALL)
    rests = length < 0.5 * slows * seconds**2
    fast = np.where(rests, np.sqrt(2.0 * slows * length), length / seconds + 0.5 * slows * seconds)
    rolling = np.where(rests, fast / slows, seconds)
    along = offset / np.maximum(length, 1e-9)[..., None]
    return RollSpeeds(along * fast[..., None], along * (fast - slows * rolling)[..., None], rolling, slows)


def simulate_rolls(starts: np.ndarray, ends: np.ndarray, frames: np.ndarray, fps: float) -> RollResult:
    """Simulate balls that roll from `starts` to `ends`.

    A ball that starts high falls and hops; a ball that ends high is sent upward to arrive there. One that rolls, and
    ends just above the ground, bobbles up there at the end.

    Args:
        starts: (P, 3) m.
        ends: (P, 3) m.
        frames: (P,) whole frames from start to end.
        fps: frames per second.
    Returns:
        The balls' positions and height errors.
    """
    speeds = compute_roll_speeds(starts, ends, frames / fps)
    at = np.arange(1, int(frames.max()) + 1) / fps
    rolling_times = np.minimum(at, speeds.rolling_seconds[:, None])
    fast = np.hypot(speeds.start_velocity[:, 0], speeds.start_velocity[:, 1])
    along = speeds.start_velocity / np.maximum(fast, 1e-9)[:, None]
    distances = fast[:, None] * rolling_times - 0.5 * speeds.deceleration[:, None] * rolling_times**2
    height, height_error = _compute_heights(starts[:, 2], ends[:, 2], frames / fps, at)
    level = starts[:, None, :2] + distances[..., None] * along[:, None]
    return RollResult(np.concatenate([level, height[..., None]], axis=-1), height_error)


def _compute_heights(starts: np.ndarray, ends: np.ndarray, seconds, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute heights (P, D) m at times `at` (D,) s, and their error (P,) m against `ends` (P,) m."""
    out, height_error = np.full((len(ends), len(at)), BALL_RADIUS), np.zeros(len(ends))
    for pair in np.flatnonzero(np.maximum(starts, ends) > BALL_RADIUS + _ON_GROUND):
        start, end, until = starts[pair], ends[pair], seconds[pair]
        if max(start - _ON_GROUND, end - _BOBBLE) <= BALL_RADIUS:
            out[pair] = _simulate_bobble(end, until, at)
        elif end > BALL_RADIUS + _ON_GROUND:
            upward = (end - start) / until + 0.5 * GRAVITY * until
            out[pair] = np.maximum(start + upward * at - 0.5 * GRAVITY * at**2, BALL_RADIUS)
            height_error[pair] = max(out[pair, at < until].max(initial=0.0) - max(start, end), 0.0)
        else:
            out[pair] = _simulate_hops(start, at)
            height_error[pair] = abs(np.interp(until, at, out[pair]) - end)
    return out, height_error


def _simulate_bobble(end: float, until: float, at: np.ndarray) -> np.ndarray:
    """Simulate a rolling ball that rises last, with its top `end` m at `until` s; (D,) m at times `at` (D,) s."""
    return np.maximum(end - 0.5 * GRAVITY * (until - at) ** 2, BALL_RADIUS)


def _simulate_hops(start: float, at: np.ndarray) -> np.ndarray:
    """Simulate a ball dropped at `start` m that hops until it rolls; (D,) m at times `at` (D,) s."""
    above = max(start - BALL_RADIUS, 0.0)
    if above < _MIN_HOP_HEIGHT:
        return np.full(len(at), BALL_RADIUS)
    out = above - 0.5 * GRAVITY * at**2
    lands, up = np.sqrt(2.0 * above / GRAVITY), np.sqrt(2.0 * above * GRAVITY) * _BOUNCE
    while up**2 / (2.0 * GRAVITY) > _MIN_HOP_HEIGHT:
        since = at - lands
        out = np.where(since > 0.0, up * since - 0.5 * GRAVITY * since**2, out)
        lands, up = lands + 2.0 * up / GRAVITY, up * _BOUNCE
    return BALL_RADIUS + np.where(at < lands, np.maximum(out, 0.0), 0.0)
