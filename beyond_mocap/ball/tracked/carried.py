"""Find where a feed has the ball at a player's own place: such a ball was not measured, only who has it.

Feeds such as Last-Row, and others in between, give the ball the position of the player who has it. It then has no steps
of its own, while a dribbled ball runs ahead and is caught up with at every touch.
"""

from __future__ import annotations

import numpy as np

from ...base.time_series import find_runs

_NEAR = 0.3  # m from the player
_STEP_SECONDS, _STEP_SPEED = 0.2, 0.5  # s over which, and m/s with which a measured ball moves against the player
_PAUSE, _SHORTEST = 0.2, 0.4  # s, the longest pause within a stretch; the shortest stretch
_WAY, _SAME_PLACE = 1.0, 0.05  # m that the player moves at least, or median m up to which both are at one place:
# a ball that lies before a waiting player is measured


def find_carried_stretches(times: np.ndarray, ball: np.ndarray, positions: np.ndarray) -> list[tuple[float, float]]:
    """Find the stretches in which a feed has the ball at a player's place.

    Args:
        times: (N,) s, ascending.
        ball: (N, 2 or 3) m, NaN where it is unknown.
        positions: (N, 2) m of the player, NaN where unknown.
    Returns:
        First and last second of each stretch.
    """
    offset = ball[:, :2] - positions
    near = np.linalg.norm(offset, axis=1) < _NEAR
    rests = near.copy()
    for seconds in (-_STEP_SECONDS, _STEP_SECONDS):
        rests &= _measure_speeds(times, offset, seconds) < _STEP_SPEED
    for first, end in find_runs(~rests):
        if first and end < len(times) and times[end] - times[first - 1] <= _PAUSE:
            rests[first:end] = True
    spans = [_widen(times, near, first, end) for first, end in find_runs(rests)]
    return [(float(times[first]), float(times[end - 1])) for first, end in spans
            if _is_carried(times[first:end], offset[first:end], positions[first:end])]


def _widen(times: np.ndarray, near: np.ndarray, first: int, end: int) -> tuple[int, int]:
    """Widen a run by the frames at either end whose step leads out of it, while the ball is near."""
    low, high = times[first] - _STEP_SECONDS, times[end - 1] + _STEP_SECONDS
    while first and near[first - 1] and times[first - 1] >= low:
        first -= 1
    while end < len(times) and near[end] and times[end] <= high:
        end += 1
    return first, end


def _measure_speeds(times: np.ndarray, offset: np.ndarray, seconds: float) -> np.ndarray:
    """Measure the speeds (N,) m/s of the ball against the player over the time before or after each frame."""
    other = np.clip(np.searchsorted(times, times + seconds - 1e-6), 0, len(times) - 1)
    moved = np.linalg.norm(offset - offset[other], axis=1)
    return np.where(other == np.arange(len(times)), 0.0, moved / np.maximum(np.abs(times - times[other]), 1e-9))


def _is_carried(times: np.ndarray, offset: np.ndarray, positions: np.ndarray) -> bool:
    """Return whether a stretch is long enough, and moves, or has ball and player at one place."""
    apart = np.linalg.norm(offset, axis=1)
    far = np.nanmax(np.linalg.norm(positions - positions[0], axis=1)) >= _WAY
    return bool(times[-1] - times[0] >= _SHORTEST and (far or np.nanmedian(apart) < _SAME_PLACE))
