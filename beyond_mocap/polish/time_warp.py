"""Playing a stretch so that it travels what it should, when it should (Faustino §3.3.2)."""

from __future__ import annotations

import numpy as np

STEEPNESS = 4.59512


def catch_up(error: float, frames: int, window: int) -> np.ndarray:
    """(frames,) metres of `error` regained by each frame of a locomotion stretch, spread over its first `window` frames
    by the logistic of eq. 27, 28.

    Eq. 27 runs from 1 % to 99 % of the error; it is stretched here to run from 0 to all of it, so that the next section
    does not inherit a rest.
    """
    window = max(1, min(window, frames))
    at = np.minimum(np.arange(frames), window)
    logistic = 1.0 / (1.0 + np.exp(-STEEPNESS / (window / 2.0) * (at - window / 2.0)))
    low = 1.0 / (1.0 + np.exp(STEEPNESS))
    return error * (logistic - low) / (1.0 - 2.0 * low)


def warp(source: np.ndarray, target: np.ndarray, idle: float = 1e-3) -> np.ndarray:
    """Fractional source frames (F,) to show so that each output frame has travelled its share of the way.

    source: (M,) metres travelled at each source frame, target: (F,) at each output frame, both from 0 and not
    decreasing. Both are taken as shares of their totals, so that the whole stretch is played. `idle` metres are added
    per frame on both sides: where nobody moves, time itself passes.
    """
    m, f = len(source), len(target)
    if m < 2 or f < 2:
        return np.zeros(f)
    own = np.maximum.accumulate(source - source[0]) + idle * np.arange(m)
    asked = np.maximum.accumulate(target - target[0]) + idle * np.arange(f) * ((m - 1) / (f - 1))
    share = asked * (own[-1] / asked[-1])
    return np.interp(share, own, np.arange(m))
