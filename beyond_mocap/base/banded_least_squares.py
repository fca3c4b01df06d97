"""Sums of squares over curves, each square about a few neighbouring frames: the least is one banded system away."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_DIFFERENCES = {1: (-1.0, 1.0), 2: (1.0, -2.0, 1.0), 3: (-1.0, 3.0, -3.0, 1.0)}


class BandedLeastSquares:
    """A sum of squares over curves of many frames, to which terms are added and which is then solved.

    Terms are added to the matrix in the order of the calls and of their coefficients, which fixes the last bits.
    Curve u at frame t is the unknown t * unknowns + u.

    Args:
        count: frames.
        unknowns: curves that are solved together.
        reach: frames between the first and the last that one square is about.
        columns: how many curves have the same matrix and only different goals; then `unknowns` is 1.
    Attributes:
        band: (unknowns (reach + 1), count unknowns), the lower diagonals of the matrix.
        right: (count unknowns,) or (count, columns), the right-hand side.
    """

    def __init__(self, count: int, unknowns: int = 1, reach: int = 3, columns: int | None = None):
        self.count, self.unknowns, self.reach = count, unknowns, reach
        self.band = np.zeros((unknowns * (reach + 1), count * unknowns))
        self.right = np.zeros(count * unknowns if columns is None else (count, columns))

    def add(self, terms: Mapping[int, np.ndarray | float], weight: np.ndarray, goal: np.ndarray | None = None) -> None:
        """Add sum_t weight_t (sum_i c_it x[i + unknowns t] - goal_t)^2.

        Args:
            terms: the coefficients c (R,) or one number, by their unknown i at the first frame.
            weight: (R,), of the squares at frames 0 to R - 1.
            goal: (R,), in the unknowns' unit; None for 0.
        """
        rows = {i: slice(i, i + self.unknowns * len(weight), self.unknowns) for i in terms}
        for i, a in terms.items():
            if goal is not None:
                self.right[rows[i]] += weight * a * goal
            for j, b in terms.items():
                if i >= j:
                    self.band[i - j, rows[j]] += weight * a * b

    def add_difference(self, order: int, weight: np.ndarray | float, curve: int = 0) -> None:
        """Add the weighted squares of a curve's differences from frame to frame; none where it is too short for them.

        Args:
            order: of the difference, 1 to 3.
            weight: (count - order,) or one number.
            curve: which of the unknowns.
        """
        terms = {curve + self.unknowns * i: c for i, c in enumerate(_DIFFERENCES[order])}
        if self.count > order:
            self.add(terms, np.broadcast_to(weight, self.count - order))

    def add_smoothness(self, weight: np.ndarray, curve: int = 0) -> None:
        """Add the squares of a curve's third differences, each with the mean weight of its four frames.

        Args:
            weight: (count,).
            curve: which of the unknowns.
        """
        if self.count > 3:
            self.add_difference(3, np.convolve(weight, np.full(4, 0.25), "valid"), curve)

    def add_value(self, weight: np.ndarray | float, curve: int = 0, goal: np.ndarray | None = None) -> None:
        """Add weight (x - goal)^2 of a curve's values.

        Args:
            weight: (count,) or one number.
            curve: which of the unknowns.
            goal: (count,), or (count, columns) where there are columns; None for 0.
        """
        self.band[0, curve :: self.unknowns] += weight
        if goal is not None:
            self.right[curve :: self.unknowns] += (weight * goal.T).T

    def add_rows(
        self, index: np.ndarray, values: np.ndarray, weight: np.ndarray, goal: np.ndarray | float = 0.0
    ) -> None:
        """Add sum_r weight_r (sum_m values_rm x[index_rm] - goal_r)^2.

        Args:
            index: (R, M) int, the unknowns of each row, within `reach` frames of each other.
            values: (R, M) or (M,), the coefficients.
            weight: (R,).
            goal: (R,) or one number, in the unknowns' unit.
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

    def copy(self) -> BandedLeastSquares:
        """The same sum, to add other squares to."""
        other = BandedLeastSquares(self.count, self.unknowns, self.reach)
        other.band[:], other.right = self.band, self.right.copy()
        return other

    def solve(self) -> np.ndarray:
        """The curves for which the sum is least: (count, unknowns), or (count, columns)."""
        from scipy.linalg import solveh_banded

        return solveh_banded(self.band, self.right, lower=True).reshape(self.count, -1)
