"""A ball that rolls from one foot to the next: fast at first, slower and slower, at rest where it need not hurry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.track import BALL_RADIUS

ROLLING = 1.0
"""m/s^2 by which a football slows on turf (FIFA's test of pitches: 4 to 8 m from a ramp 1 m high)."""
_GRAVITY, _BOUNCE = 9.81, 0.55
_ON_GROUND = 0.03  # metres above its radius at which a ball still counts as rolling
_LEAST_HOP = 0.02  # metres; a lower hop is a roll


@dataclass(frozen=True, eq=False)
class Speeds:
    """leaves, arrives (..., 2) m/s on the ground; rolling (...,) s for which the ball rolls before it rests."""

    leaves: np.ndarray
    arrives: np.ndarray
    rolling: np.ndarray


@dataclass(frozen=True, eq=False)
class Rolls:
    """P rolls. balls (P, D, 3) m: the ball's centre at frames 1 .. D after it set out; missed (P,) m by which it is too
    high or too low in the end, or higher on its way than at both ends."""

    balls: np.ndarray
    missed: np.ndarray


def speeds_of(starts: np.ndarray, ends: np.ndarray, seconds: np.ndarray) -> Speeds:
    """Of a ball that rolls from `starts` to `ends` (..., 3) m within `seconds` (...,): it loses ROLLING all the way, or
    comes to rest early where it has time."""
    way = ends[..., :2] - starts[..., :2]
    length = np.hypot(way[..., 0], way[..., 1])
    rests = length < 0.5 * ROLLING * seconds**2
    fast = np.where(rests, np.sqrt(2.0 * ROLLING * length), length / seconds + 0.5 * ROLLING * seconds)
    rolling = np.where(rests, fast / ROLLING, seconds)
    along = way / np.maximum(length, 1e-9)[..., None]
    return Speeds(along * fast[..., None], along * (fast - ROLLING * rolling)[..., None], rolling)


def rolls(starts: np.ndarray, ends: np.ndarray, frames: np.ndarray, fps: float) -> Rolls:
    """From `starts` to `ends` (P, 3) m in `frames` (P,) whole frames, on the ground; what starts high falls and hops,
    what ends high is sent up so as to be there."""
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
    """Heights (P, D) m at times `at` (D,) s, and how far (P,) m they are from `ends` (P,) m in the end."""
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
    """(D,) m: a ball let go at `start` m, falling and hopping until it rolls."""
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
