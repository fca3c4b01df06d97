"""Sums of squares over curves, each square about a few frames at most: what is least is one banded system away."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

THIRD = (-1.0, 3.0, -3.0, 1.0)


class BandedSquares:
    """A sum of squares over `unknowns` curves of `count` frames; curve u at frame t has the index t * unknowns + u."""

    def __init__(self, count: int, unknowns: int):
        self.count, self.unknowns = count, unknowns
        self.width = min(3, max(count - 1, 0)) * unknowns + unknowns
        self.band = np.zeros((self.width, count * unknowns))
        self.right = np.zeros(count * unknowns)

    def add(self, index: np.ndarray, values: np.ndarray, weight: np.ndarray, goal: np.ndarray | float = 0.0) -> None:
        """Adds sum_r weight_r (sum_m values_rm x[index_rm] - goal_r)^2.

        index (R, M) int, all of a row within three frames of each other; values (R, M) or (M,); weight (R,).
        """
        values = np.broadcast_to(values, index.shape)
        carried = weight[:, None] * values
        size = len(self.right)
        self.right += np.bincount(index.ravel(), (carried * np.reshape(goal, (-1, 1))).ravel(), size)
        for a in range(index.shape[1]):
            lower = index[:, a, None] >= index
            rows = (index[:, a, None] - index) * size + index
            products = (carried[:, a, None] * values)[lower]
            self.band += np.bincount(rows[lower], products, self.band.size).reshape(self.band.shape)

    def copy(self) -> BandedSquares:
        """The same sum, to add other squares to."""
        other = BandedSquares(self.count, self.unknowns)
        other.band[:], other.right[:] = self.band, self.right
        return other

    def smooth(self, curve: int, weight: np.ndarray) -> None:
        """Adds weight (T,) times the square of a curve's third difference, the weight of a difference being the mean of
        its frames'."""
        if self.count > 3:
            index = (np.arange(self.count - 3)[:, None] + np.arange(4)) * self.unknowns + curve
            self.add(index, np.array(THIRD), np.convolve(weight, np.full(4, 0.25), "valid"))

    def stay(self, curve: int, weight: np.ndarray) -> None:
        """Adds weight (T,) times the square of a curve."""
        self.band[0, curve :: self.unknowns] += weight

    def least(self) -> np.ndarray:
        """(T, unknowns): the curves with which the sum is least."""
        return solveh_banded(self.band, self.right, lower=True).reshape(self.count, self.unknowns)
