"""The line that a body follows over the ground, without the sway of its steps: what game engines call root motion.

Smooth is the curve of least acceleration that stays within a hand's breadth of the pelvis (Kimodo's smoothed root:
6 cm); the facing is smoothed alike. Straight is the line from where it begins to where it ends.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

SLACK = 0.06
"""Metres that the line may be off the pelvis."""

TURN_SLACK = np.radians(25.0)
_SECONDS = 0.4  # sway slower than about six times this is a way taken, faster is sway
_ROUNDS = 8
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
    """The smooth curve (T, K) that is nowhere farther than about `slack` from `values` (T, K)."""
    weight = np.ones(len(values))
    smooth = _smooth(values, weight, fps)
    for _ in range(_ROUNDS):
        off = np.linalg.norm(smooth - values, axis=1)
        if off.max(initial=0.0) <= slack:
            break
        weight = weight * np.maximum(1.0, off / (0.7 * slack)) ** 2
        smooth = _smooth(values, weight, fps)
    return smooth


def _smooth(values: np.ndarray, weight: np.ndarray, fps: float) -> np.ndarray:
    """Minimizes sum w |x - v|^2 + (seconds * fps)^4 |x''|^2 over curves x (T, K): one banded system."""
    count, stencil = len(values), (1.0, -2.0, 1.0)
    band, stiff = np.zeros((3, count)), (_SECONDS * fps) ** 4
    for i, a in enumerate(stencil):
        for j, b in enumerate(stencil[: i + 1]):
            band[i - j, j : j + max(count - 2, 0)] += stiff * a * b
    band[0] += weight
    return solveh_banded(band, weight[:, None] * values, lower=True)
