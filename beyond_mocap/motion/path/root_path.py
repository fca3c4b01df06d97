"""The line that a body follows over the ground, without the sway of its steps: what game engines call root motion.

Smooth is the curve of least acceleration that stays within a hand's breadth of the pelvis (Kimodo's smoothed root:
6 cm); the facing is smoothed alike. Straight is the line from where it begins to where it ends.
"""

from __future__ import annotations

import numpy as np

from .smooth_spline import DEGREE, spline_pieces, spline_within

SLACK = 0.06
"""Metres that the line may be off the pelvis."""

TURN_SLACK = np.radians(25.0)
SECONDS = 0.4
"""Sway slower than about six times this is a way taken, faster is sway."""

WAYS = ("smooth", "straight")


def ground_path(places: np.ndarray, facing: np.ndarray, fps: float, way: str = "smooth"):
    """The line (T, 2) metres and its facing (T,) radians, from the pelvis's places (T, 2) and facing (T,), unwrapped.

    way: one of WAYS.
    """
    line = _within(places, fps, SLACK)
    if way == "smooth":
        return line, _within(facing[:, None], fps, TURN_SLACK)[:, 0]
    along = places[-1] - places[0]
    length = np.linalg.norm(along)
    turn = np.full(len(places), np.mean(facing))
    if length < 0.3:  # it stays where it is
        return np.repeat(places.mean(axis=0)[None], len(places), axis=0), turn
    along = along / length
    return places[0] + ((line - places[0]) @ along)[:, None] * along, turn


def _within(values: np.ndarray, fps: float, slack: float) -> np.ndarray:
    """The smooth curve (T, K) that is nowhere much farther than `slack` from `values` (T, K)."""
    from scipy.interpolate import BSpline

    if len(values) < 2:
        return values.copy()
    times = np.arange(len(values)) / fps
    return BSpline(*spline_within(values, times, spline_pieces(times[-1], SECONDS), SECONDS, slack), DEGREE)(times)
