"""Places that say "the ball is not seen": below the ground, far outside, or parked at the origin."""

from __future__ import annotations

import numpy as np

from ...base.time_series import runs

_PITCH = 200.0  # metres from the centre beyond which no ball is


def at_sentinel(ball: np.ndarray) -> np.ndarray:
    """(N,) bool: the samples of ball (N, 3) m that are known and no place of a ball: z below the ground, far outside,
    or parked at the origin."""
    seen = np.isfinite(ball[:, :2]).all(axis=1)
    with np.errstate(invalid="ignore"):
        return seen & ((np.abs(ball) > _PITCH).any(axis=1) | (ball[:, 2] < -1.0) | _parked_at_origin(ball))


def _parked_at_origin(ball: np.ndarray) -> np.ndarray:
    """(N,) bool: in a run of three or more samples exactly at (0, 0) that the ball did not roll into or out of."""
    zero = (ball[:, :2] == 0.0).all(axis=1)
    out = np.zeros(len(ball), dtype=bool)
    for start, stop in runs(zero):
        beside = [i for i in (start - 1, stop) if 0 <= i < len(ball) and np.isfinite(ball[i, :2]).all()]
        out[start:stop] = stop - start >= 3 and all(np.linalg.norm(ball[i, :2]) > 1.5 for i in beside)
    return out
