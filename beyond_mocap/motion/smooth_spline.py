"""Smoothing splines: cubic B-splines near many values that pay for every bend (penalized least squares).

Eilers and Marx 1996 with the exact integral of a derivative as the price (O'Sullivan 1986); one banded system, or a
cyclic one for closed curves.
"""

from __future__ import annotations

import numpy as np

DEGREE = 3


def smoothing_spline(
    values: np.ndarray, at: np.ndarray, pieces: int, stiff: float, order: int = 2, weights: np.ndarray | None = None,
    closed: bool = False, ends_met: bool = False, domain: tuple[float, float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Knots (P + 4,) and coefficients (P, K) of the cubic spline that minimizes the mean over the values of
    w |x - v|^2 plus stiff^(2 order) times the mean over the domain of |the derivative of that order|^2.

    values: (N, K). at: (N,) parameters, rising. pieces: how many of even width. stiff: in the parameter's unit; waves
    shorter than some six times it are taken out. weights: (N,), else 1. closed: the end joins the beginning (`domain`
    then is one round). ends_met: the first and last value are kept exactly. domain: the first and last parameter, else of
    `at`.
    """
    from scipy.interpolate import BSpline

    low, high = domain or (float(at[0]), float(at[-1]))
    knots = _knots(low, high, pieces, closed)
    values = np.asarray(values, dtype=float)
    origin = values.mean(axis=0)  # what is far from the origin loses no digits
    design = BSpline.design_matrix(at, knots, DEGREE)
    price = _price(knots, order, stiff ** (2 * order) / (high - low))
    weighted = design.multiply((np.ones(len(at)) if weights is None else weights)[:, None] / len(at)).tocsr()
    normal, right = weighted.T @ design + price, weighted.T @ (values - origin)
    ends = (values[[0, -1]] - origin) if ends_met else None
    solved = _cyclic(normal, right) if closed else _open(normal, right, ends)
    return knots, solved + origin


def _knots(low: float, high: float, pieces: int, closed: bool) -> np.ndarray:
    inner = np.linspace(low, high, pieces + 1)
    if not closed:
        return np.concatenate([[low] * DEGREE, inner, [high] * DEGREE])
    step = (high - low) / pieces * np.arange(1, DEGREE + 1)
    return np.concatenate([low - step[::-1], inner, high + step])


def _price(knots: np.ndarray, order: int, factor: float):
    """factor times the integral of the products of the B-splines' derivatives of this order, 2 or 3: sparse (P, P)."""
    from scipy.sparse import diags

    count = len(knots) - DEGREE - 1
    change = None
    for level in range(order):
        degree, size = DEGREE - level, count - level
        span = knots[level + 1 + degree : level + degree + size] - knots[level + 1 : level + size]
        rate = degree / np.where(span > 0.0, span, np.inf)
        step = diags([-rate, rate], [0, 1], shape=(size - 1, size))
        change = step if change is None else step @ change
    wide = np.diff(knots[DEGREE : len(knots) - DEGREE])
    if order == DEGREE:
        gram = diags([wide], [0])
    else:  # hat functions on the breaks
        gram = diags([wide / 6, (np.append(wide, 0) + np.append(0, wide)) / 3, wide / 6], [-1, 0, 1])
    return factor * (change.T @ gram @ change)


def _open(normal, right: np.ndarray, ends: np.ndarray | None) -> np.ndarray:
    """Coefficients (P, K) of a curve with two ends, which are `ends` (2, K) where given."""
    from scipy.linalg import solveh_banded

    band = np.zeros((DEGREE + 1, len(right)))
    for below in range(DEGREE + 1):
        band[below, : len(right) - below] = normal.diagonal(-below)
    if ends is None:
        return solveh_banded(band, right, lower=True)
    for below in range(1, DEGREE + 1):  # what the known coefficients do to their neighbours
        right[below] -= band[below, 0] * ends[0]
        right[-1 - below] -= band[below, len(right) - 1 - below] * ends[1]
    return np.concatenate([ends[:1], solveh_banded(band[:, 1:-1], right[1:-1], lower=True), ends[1:]])


def _cyclic(normal, right: np.ndarray) -> np.ndarray:
    """Coefficients (P, K) of a closed curve; the last of them repeat the first."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import splu

    count = len(right)
    own = np.arange(count) % (count - DEGREE)
    fold = csr_matrix((np.ones(count), (np.arange(count), own)), shape=(count, count - DEGREE))
    return splu((fold.T @ normal @ fold).tocsc()).solve(fold.T @ right)[own]
