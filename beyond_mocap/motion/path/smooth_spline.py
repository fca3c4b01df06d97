"""Smoothing splines, and the path that a body's root follows over the ground, without the sway of its steps: root
motion.

They are cubic B-splines near many values with a penalty on every bend: penalized least squares (Eilers and Marx 1996),
with the exact integral of a squared derivative as penalty (O'Sullivan 1986). On every piece of the curve, value and
penalty are squares of sums over the same four coefficients, so that all of it is one list of rows of four numbers, and
one banded system. A body's path is the curve of least acceleration that stays near the pelvis (Kimodo's smoothed root:
6 cm); the heading is smoothed alike. A straight path is the line from where it starts to where it ends.
"""

from __future__ import annotations

import numpy as np

DEGREE = 3
_WIDTH = DEGREE + 1
_PIECES_PER_STIFFNESS = 4  # pieces within a length of `stiff`
_ROUNDS = 8
_PULL_RANGE = 0.5  # share of `stiff` over which a value pulls its neighbours along
_STIFFEST = 10.0
"""Domains: from there on a spline has no roughness, and what is stiffer loses the fit in rounding (0.5 m at 50)."""
_FREE_SHARE = 0.7  # share of the slack beyond which values pull more
SLACK = 0.06
"""Metres that the path may be off the pelvis."""

TURN_SLACK = np.radians(25.0)
SWAY_SECONDS = 0.4
"""Movement slower than about six times this belongs to the path, faster movement is sway."""


def fit_smoothing_spline(
    values: np.ndarray, at: np.ndarray, pieces: int, stiff: float, order: int = 2, weights: np.ndarray | None = None,
    closed: bool = False, keep_ends: bool = False, domain: tuple[float, float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Fit a cubic smoothing spline.

    It minimizes the mean over the values of w |x - v|^2 plus stiff^(2 order) times the mean over the domain of |the
    derivative of that order|^2.

    Args:
        values: (N, K).
        at: (N,) parameters, rising.
        pieces: number of pieces of even width.
        stiff: in the parameter's unit; waves shorter than some six times it are removed.
        order: 2 or 3.
        weights: (N,), else 1.
        closed: the end joins the start (`domain` is then one round, `pieces` at least 8).
        keep_ends: keep the first and last value exactly.
        domain: first and last parameter, else of `at`.
    Returns:
        Knots (P + 4,) and coefficients (P, K).
    Source: Eilers and Marx 1996; O'Sullivan 1986.
    """
    from scipy.linalg import solveh_banded

    low, high = domain or (float(at[0]), float(at[-1]))
    knots = _build_knots(low, high, pieces, closed)
    values = np.asarray(values, dtype=float)
    origin = values.mean(axis=0)  # keeps precision far from the origin
    basis, left = _evaluate_basis(at, knots)
    stiff = min(stiff, _STIFFEST * (high - low))
    weights = np.full(len(at), 1.0 / len(at)) if weights is None else weights / len(at)
    roughness, roughness_weights = _build_roughness(knots, order, stiff ** (2 * order) / (high - low))
    count = pieces if closed else pieces + DEGREE
    begins = np.concatenate([left, np.tile(np.arange(pieces), len(roughness) // pieces)])
    band = _build_band_matrix(np.concatenate([basis, roughness]), begins, np.concatenate([weights, roughness_weights]),
                              count)
    right = _build_right_side(basis, left, weights, values - origin, count)
    if closed:
        solved = _solve_cyclic(band, right)[np.arange(pieces + DEGREE) % count]
    else:
        solved = _solve_pinned(band, right, values[[0, -1]] - origin) if keep_ends else solveh_banded(band, right,
                lower=True)
    return knots, solved + origin


def fit_spline_within(
    values: np.ndarray, at: np.ndarray, pieces: int, stiff: float, slack: float
) -> tuple[np.ndarray, np.ndarray]:
    """Fit the `fit_smoothing_spline` of least acceleration that is nowhere much farther than `slack` from the values.

    Where it is farther, the values around it get more weight, round by round: elsewhere it stays as smooth as possible.

    Args:
        values: (N, K).
        at: (N,) parameters, rising.
        pieces: number to begin with; where weights do not help they are halved, down to one from value to value.
        stiff: as for `fit_smoothing_spline`.
        slack: allowed distance, in the unit of the values.
    Returns:
        Knots (P + 4,) and coefficients (P, K).
    """
    from scipy.interpolate import BSpline
    from scipy.ndimage import maximum_filter1d, uniform_filter1d

    weights, around = np.ones(len(at)), int(_PULL_RANGE * stiff * (len(at) - 1) / (at[-1] - at[0])) + 1
    for round_ in range(_ROUNDS):
        if round_ >= _ROUNDS // 2:
            pieces = max(min(2 * pieces, len(at) - 1), pieces)
        knots, coefficients = fit_smoothing_spline(values, at, pieces, stiff, weights=weights)
        distance = np.linalg.norm(BSpline(knots, coefficients, DEGREE)(at) - values, axis=1)
        if distance.max(initial=0.0) <= slack:
            break
        pull = 2.0 * np.log(np.maximum(distance / (_FREE_SHARE * slack), 1.0))
        pull = uniform_filter1d(maximum_filter1d(pull, around, mode="nearest"), around, mode="nearest")
        weights = weights * np.exp(pull)
    return knots, coefficients


def count_spline_pieces(length: float, stiff: float) -> int:
    """Count the pieces that a spline of this length needs so that finer ones would change nothing."""
    return max(int(np.ceil(_PIECES_PER_STIFFNESS * length / stiff)), 4)


def compute_root_path(places: np.ndarray, facing: np.ndarray, fps: float, kind: str = "smooth"):
    """Compute the root's path over the ground and its heading.

    Args:
        places: (T, 2) metres, the pelvis on the ground.
        facing: (T,) radians, unwrapped.
        fps: frames per second.
        kind: "smooth" or "straight".
    Returns:
        The path (T, 2) in metres and its heading (T,) in radians.
    """
    line = _smooth_within(places, fps, SLACK)
    if kind == "smooth":
        return line, _smooth_within(facing[:, None], fps, TURN_SLACK)[:, 0]
    along = places[-1] - places[0]
    length = np.linalg.norm(along)
    turn = np.full(len(places), np.mean(facing))
    if length < 0.3:  # the body stays where it is
        return np.repeat(places.mean(axis=0)[None], len(places), axis=0), turn
    along = along / length
    return places[0] + ((line - places[0]) @ along)[:, None] * along, turn


def _smooth_within(values: np.ndarray, fps: float, slack: float) -> np.ndarray:
    """Smooth values (T, K) by a curve that is nowhere much farther than `slack` from them: (T, K)."""
    from scipy.interpolate import BSpline

    if len(values) < 2:
        return values.copy()
    times = np.arange(len(values)) / fps
    return BSpline(*fit_spline_within(values, times, count_spline_pieces(times[-1], SWAY_SECONDS), SWAY_SECONDS, slack),
                   DEGREE)(times)


def _build_knots(low: float, high: float, pieces: int, closed: bool) -> np.ndarray:
    """Build the knots: repeated at the ends of an open curve, continued evenly beyond those of a closed one."""
    inner = np.linspace(low, high, pieces + 1)
    if not closed:
        return np.concatenate([[low] * DEGREE, inner, [high] * DEGREE])
    step = (high - low) / pieces * np.arange(1, DEGREE + 1)
    return np.concatenate([low - step[::-1], inner, high + step])


def _evaluate_basis(at: np.ndarray, knots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate the four B-splines (N, 4) that are not zero at parameters (N,), and the first of them (N,): Cox and de
    Boor.
    """
    inner = knots[DEGREE : len(knots) - DEGREE]
    pieces = len(inner) - 1
    left = np.clip(((at - inner[0]) * (pieces / (inner[-1] - inner[0]))).astype(int), 0, pieces - 1)
    basis = np.ones((1, len(at)))
    for degree in range(1, DEGREE + 1):
        more = np.zeros((degree + 1, len(at)))
        # each B-spline of one degree less adds to the one that starts with it and to the one that starts a knot earlier
        for own in range(degree):
            end, begin = knots[left + DEGREE + 1 + own], knots[left + DEGREE + 1 + own - degree]
            share = basis[own] / (end - begin)
            more[own] += (end - at) * share
            more[own + 1] = (at - begin) * share
        basis = more
    return basis.T, left


def _build_roughness(knots: np.ndarray, order: int, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Build rows (M, 4) over each piece's coefficients and weights (M,) of the penalty.

    Their weighted squares add up to factor times the integral of the squared derivative. The third derivative is
    constant on a piece; the second runs evenly from a to b: the integral of its square is
    h ((a + b) / 2)^2 + h (b - a)^2 / 12.
    """
    piece = np.arange(len(knots) - 2 * DEGREE - 1)[:, None]
    rows = np.broadcast_to(np.eye(_WIDTH), (len(piece), _WIDTH, _WIDTH))
    for level in range(order):
        own = piece + np.arange(DEGREE - level)
        span = knots[own + _WIDTH] - knots[own + level + 1]
        rows = (rows[:, 1:] - rows[:, :-1]) * ((DEGREE - level) / span)[..., None]
    wide = factor * (knots[piece[:, 0] + _WIDTH] - knots[piece[:, 0] + DEGREE])
    if order == DEGREE:
        return rows[:, 0], wide
    middle, change = 0.5 * (rows[:, 0] + rows[:, 1]), rows[:, 1] - rows[:, 0]
    return np.concatenate([middle, change]), np.concatenate([wide, wide / 12])


def _build_band_matrix(rows: np.ndarray, left: np.ndarray, weights: np.ndarray, count: int) -> np.ndarray:
    """Build the sum of w r r' as a band (4, count): [d, a] is the entry of coefficients a and a + d, cyclic."""
    band = np.zeros((_WIDTH, count))
    for i in range(_WIDTH):
        weighted, own = weights * rows[:, i], (left + i) % count
        for j in range(i, _WIDTH):
            band[j - i] += np.bincount(own, weighted * rows[:, j], minlength=count)
    return band


def _build_right_side(rows: np.ndarray, left: np.ndarray, weights: np.ndarray, values: np.ndarray,
                      count: int) -> np.ndarray:
    """Build the sum of w r v: (count, K)."""
    out = np.zeros((count, values.shape[1]))
    for i in range(_WIDTH):
        own, weighted = (left + i) % count, weights * rows[:, i]
        for column in range(values.shape[1]):
            out[:, column] += np.bincount(own, weighted * values[:, column], minlength=count)
    return out


def _solve_pinned(band: np.ndarray, right: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Solve the coefficients (P, K) of which the first and the last are `ends` (2, K)."""
    from scipy.linalg import solveh_banded

    last = len(right) - 1
    for below in range(1, _WIDTH):  # move the known coefficients' terms to the right side
        right[below] -= band[below, 0] * ends[0]
        right[last - below] -= band[below, last - below] * ends[1]
    return np.concatenate([ends[:1], solveh_banded(band[:, 1:-1], right[1:-1], lower=True), ends[1:]])


def _solve_cyclic(band: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve the coefficients (P, K) of a closed curve: the last three are solved after all others (Schur complement).
    """
    from scipy.linalg import solveh_banded

    count = len(right)
    inner = count - DEGREE
    beside, corner = np.zeros((inner, DEGREE)), np.zeros((DEGREE, DEGREE))
    for below in range(_WIDTH):
        for own in range(inner - DEGREE, count):
            # entries that couple the inner coefficients with the last three go to `beside`, those among the three to
            # `corner`
            low, high = sorted((own, (own + below) % count))
            if low < inner <= high:
                beside[low, high - inner] = band[below, own]
            elif low >= inner:
                corner[low - inner, high - inner] = corner[high - inner, low - inner] = band[below, own]
    solved = solveh_banded(band[:, :inner], np.concatenate([right[:inner], beside], axis=1), lower=True)
    alone, moved = solved[:, : right.shape[1]], solved[:, right.shape[1] :]
    last = np.linalg.solve(corner - beside.T @ moved, right[inner:] - beside.T @ alone)
    return np.concatenate([alone - moved @ last, last])
