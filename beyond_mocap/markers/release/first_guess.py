"""A first guess of when a ball leaves the hand: it gets further from it, or the hand is at its fastest."""

from __future__ import annotations

import numpy as np

from ...base.time_series import runs

GROWS = 1.1
"""The ball has left once its marker is that much further from the hand than while held (Fredriksson §6.2)."""
_BEFORE = (0.30, 0.05)  # s before the hand is fastest: the ball is held there
_STAYS = 3  # frames for which it is further away


def speeds(places: np.ndarray, fps: float) -> np.ndarray:
    """(T,) m/s of a point (T, 3) m, by differences over two frames."""
    if len(places) < 2:
        return np.zeros(len(places))
    return np.linalg.norm(np.gradient(places, 1.0 / fps, axis=0), axis=-1)


def fastest(places: np.ndarray, fps: float) -> int:
    """The frame in which a point (T, 3) m is fastest, single outliers left aside."""
    from scipy.signal import medfilt

    return int(np.argmax(medfilt(speeds(places, fps), 5)))


def by_distance(hand: np.ndarray, marker: np.ndarray, fps: float) -> int | None:
    """The frame from which on the ball's marker (T, 3) m is 10 % further from the hand (T, 3) m than while held.

    None where it never is, or is not seen often enough to tell.
    """
    away = np.linalg.norm(marker - hand, axis=-1)
    seen = np.flatnonzero(np.isfinite(away))
    if len(seen) < 2 * _STAYS:
        return None
    peak = fastest(hand, fps)
    first, last = (max(peak - int(round(seconds * fps)), 0) for seconds in _BEFORE)
    held = away[first : max(last, first + 1)]
    held = held[np.isfinite(held)]
    if not len(held):  # hidden by the fingers: as near as it ever comes
        held = np.sort(away[seen])[: max(len(seen) // 20, 3)]
    further = away[seen] > GROWS * np.median(held)
    left = [a for a, b in runs(further) if b - a >= _STAYS and seen[a] >= first]
    return int(seen[left[0]]) if left else None
