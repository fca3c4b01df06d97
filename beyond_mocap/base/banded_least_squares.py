"""Weighted least squares over curves with short-range terms, solved as one banded linear system."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# Order of a finite difference -> its coefficients.
_DIFFERENCES = {1: (-1.0, 1.0), 2: (1.0, -2.0, 1.0), 3: (-1.0, 3.0, -3.0, 1.0)}
_DENSE = 20  # elements that are summed as fast as one entry is sorted


class BandedLeastSquares:
    """A sum of squares over curves of many frames: add terms, then solve for the minimum.

    Terms are added to the matrix in the order of the calls and of their coefficients, which fixes the last bits.
    Curve u at frame t is the unknown t * unknowns + u.

    Args:
        count: frames.
        unknowns: number of curves that are solved together.
        reach: frames between the first and the last frame of one squared term.
        columns: number of curves that share one matrix and differ only in their goals; `unknowns` is then 1.
    Attributes:
        count: frames.
        unknowns: number of curves that are solved together.
        reach: frames between the first and the last frame of one squared term.
        band: (unknowns (reach + 1), count unknowns), the lower diagonals of the matrix.
        right: (count unknowns,) or (count, columns), the right-hand side.
    """

    def __init__(self, count: int, unknowns: int = 1, reach: int = 3, columns: int | None = None):
        self.count, self.unknowns, self.reach = count, unknowns, reach
        self.band = np.zeros((unknowns * (reach + 1), count * unknowns))
        self.right = np.zeros(count * unknowns if columns is None else (count, columns))

    def add_terms(self, terms: Mapping[int, np.ndarray | float], weight: np.ndarray, goal: np.ndarray
                  | None = None) -> None:
        """Add sum_t weight_t (sum_i c_it x[i + unknowns t] - goal_t)^2.

        Args:
            terms: unknown i at the first frame -> its coefficients c, (R,) or one number.
            weight: (R,), weight of the squares at frames 0 to R - 1.
            goal: (R,), in the unknowns' unit; None for 0.
        """
        rows = {i: slice(i, i + self.unknowns * len(weight), self.unknowns) for i in terms}
        # Normal equations: A^T W A goes to the band, A^T W goal to the right-hand side.
        for i, a in terms.items():
            if goal is not None:
                self.right[rows[i]] += weight * a * goal
            for j, b in terms.items():
                # Row i - j of the band is the (i - j)-th diagonal below the main one; the matrix is symmetric.
                if i >= j:
                    self.band[i - j, rows[j]] += weight * a * b

    def add_difference(self, order: int, weight: np.ndarray | float, curve: int = 0) -> None:
        """Add the weighted squares of a curve's frame-to-frame differences.

        Adds nothing where the curve is too short for a difference of this order.

        Args:
            order: order of the difference, 1 to 3.
            weight: (count - order,) or one number.
            curve: index of the curve among the unknowns.
        """
        terms = {curve + self.unknowns * i: c for i, c in enumerate(_DIFFERENCES[order])}
        if self.count > order:
            self.add_terms(terms, np.broadcast_to(weight, self.count - order))

    def add_smoothness(self, weight: np.ndarray, curve: int = 0) -> None:
        """Add the squares of a curve's third differences, each with the mean weight of its four frames.

        Args:
            weight: (count,).
            curve: index of the curve among the unknowns.
        """
        if self.count > 3:
            self.add_difference(3, np.convolve(weight, np.full(4, 0.25), "valid"), curve)

    def add_value(self, weight: np.ndarray | float, curve: int = 0, goal: np.ndarray | None = None) -> None:
        """Add weight (x - goal)^2 of a curve's values.

        Args:
            weight: (count,) or one number.
            curve: index of the curve among the unknowns.
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
            goal: (R,) or one number, or (R, columns) where there are columns, in the unknowns' unit; (R,) is the goal
                of every column.
        """
        values = np.broadcast_to(values, index.shape)
        weighted_values = weight[:, None] * values
        size = len(self.right)
        columns = self.right.reshape(size, -1)
        goals = goal if np.ndim(goal) == 2 else np.reshape(goal, (-1, 1))
        for column, sums in zip(np.broadcast_to(goals, (len(index), columns.shape[1])).T, columns.T):
            sums += np.bincount(index.ravel(), (weighted_values * column[:, None]).ravel(), size)
        for a in range(index.shape[1]):
            # Keep the pairs on or below the diagonal. Diagonal d and column c of the band are element d * size + c of
            # the flat band. One bincount sums repeated entries.
            lower = index[:, a, None] >= index
            entries = ((index[:, a, None] - index) * size + index)[lower]
            found, number = _find_entries(entries)
            self.band.reshape(-1)[found] += np.bincount(number, (weighted_values[:, a, None] * values)[lower])

    def copy(self) -> BandedLeastSquares:
        """Copy the sum, so that other squares can be added to the copy.

        Returns:
            An independent sum with the same terms.
        """
        other = BandedLeastSquares(self.count, self.unknowns, self.reach)
        other.band[:], other.right = self.band, self.right.copy()
        return other

    def solve(self) -> np.ndarray:
        """Solve for the curves that minimize the sum.

        Returns:
            (count, unknowns), or (count, columns).
        """
        from scipy.linalg import solveh_banded

        return solveh_banded(self.band, self.right, lower=True).reshape(self.count, -1)


def _find_entries(entries: np.ndarray) -> tuple[np.ndarray | slice, np.ndarray]:
    """Find which entries occur, and the number of each among them; all up to the last one where they are many."""
    end = int(entries.max(initial=-1)) + 1
    return (slice(end), entries) if end <= _DENSE * len(entries) else np.unique(entries, return_inverse=True)
