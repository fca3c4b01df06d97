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
class Rolls:
    """Rolls from one place to K others. balls (K, D, 3) m: the ball's centre at frames 1 .. D after it set out; leaves,
    arrives (K, 2) m/s on the ground; missed (K,) m by which it is too high or too low in the
    end, or higher on its way than at both."""

    balls: np.ndarray
    leaves: np.ndarray
    arrives: np.ndarray
    missed: np.ndarray


def rolls(start: np.ndarray, ends: np.ndarray, frames: np.ndarray, fps: float) -> Rolls:
    """From `start` (3,) m to each of `ends` (K, 3) m in `frames` (K,) whole frames.

    On the ground it loses ROLLING all the way, or comes to rest early where it has time. What starts high falls and hops;
    what ends high is sent up so as to be there.
    """
    seconds = frames / fps
    way = ends[:, :2] - start[:2]
    length = np.linalg.norm(way, axis=1)
    along = way / np.maximum(length, 1e-9)[:, None]
    rests = length < 0.5 * ROLLING * seconds**2
    fast = np.where(rests, np.sqrt(2.0 * ROLLING * length), length / seconds + 0.5 * ROLLING * seconds)
    rolling = np.where(rests, fast / ROLLING, seconds)
    at = np.arange(1, int(frames.max()) + 1) / fps
    gone = np.minimum(at[None], rolling[:, None])
    done = fast[:, None] * gone - 0.5 * ROLLING * gone**2
    level = start[:2] + done[..., None] * along[:, None]
    height, missed = _heights(start[2], ends[:, 2], seconds, at)
    leaves, arrives = along * fast[:, None], along * (fast - ROLLING * rolling)[:, None]
    return Rolls(np.concatenate([level, height[..., None]], axis=-1), leaves, arrives, missed)


def _heights(start: float, ends: np.ndarray, seconds: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights (K, D) m at times `at` (D,) s, and how far (K,) m they are from `ends` (K,) m in the end."""
    fall, high = _falling(start, at), ends > BALL_RADIUS + _ON_GROUND
    out = np.broadcast_to(fall, (len(ends), len(at))).copy()
    for number in np.flatnonzero(high):
        upward = (ends[number] - start) / seconds[number] + 0.5 * _GRAVITY * seconds[number]
        out[number] = np.maximum(start + upward * at - 0.5 * _GRAVITY * at**2, BALL_RADIUS)
    top = np.max(np.where(at < seconds[:, None], out, 0.0), axis=1) - np.maximum(ends, start)
    return out, np.where(high, np.maximum(top, 0.0), np.abs(np.interp(seconds, at, fall) - ends))


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
