"""Smooth noisy joints over time, and fill short gaps.

A penalized least squares fit (Whittaker 1923; Eilers 2003, "A perfect smoother") with the third difference as the
penalty: it is a jerk, so a limb that swings evenly is left as it is. How strong it is follows from the noise itself, by
generalized cross validation (Craven and Wahba 1979) for each pair of left and right points. Points are smoothed
relative to the middle of the trunk, which is smoothed first. Where a point is not seen, the person's other points tell
where it was, by ridge regression over all frames that show it: an arm that swings goes on swinging against the legs.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from ..base.time_series import find_runs
from ..base.vectors import arctan2
from ..motion import quaternion

LONGEST_GAP = 1.0
"""Seconds; longer, and a person counts as away."""
_ORDER = 3
_STRENGTHS = 10.0 ** np.arange(-1.0, 6.5, 0.5)
_DIFFERENCE = (1.0, -3.0, 3.0, -1.0)
"""Coefficients of the third difference."""
_SHORTEST = 8  # frames of a stretch that can be smoothed
_MIN_OTHERS, _MIN_ROWS = 4, 40  # points and frames from which one that is not seen is predicted
_NOISE = 0.03  # metres of noise that the regression expects in each coordinate
_REST_FRAMES = 5  # on each side of a gap, from which what the regression lacks is measured
_TRUNK = ("pelvis", "left_hip", "right_hip", "left_shoulder", "right_shoulder", "neck")


def smooth_joints(landmarks: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
    """Smooth the joints of a stretch of frames at an even rate.

    Args:
        landmarks: L names.
        positions: (T, L, 3) metres, NaN where not seen.
    Returns:
        (T, L, 3) metres; NaN only for points that are never seen.
    """
    trunk = [number for number, name in enumerate(landmarks) if name in _TRUNK] or list(range(len(landmarks)))
    middle = _smooth_values(_measure_middle(positions[:, trunk])[:, None], ("middle",))
    return middle + _smooth_values(fill_gaps(landmarks, positions - middle), landmarks)


def fill_gaps(landmarks: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
    """Fill the gaps of points by what the person's other points tell.

    Args:
        landmarks: L names.
        positions: (T, L, 3) metres relative to the trunk, NaN where not seen.
    Returns:
        (T, L, 3); NaN where too little is seen to tell.
    """
    seen = np.isfinite(positions).all(axis=2)
    if seen.all():
        return positions
    heading = _measure_heading(landmarks, positions)[:, None]
    turned = quaternion.rotate_about_up(positions, -heading)
    filled = turned.copy()
    for line in np.flatnonzero(~seen.all(axis=0)):
        known, gap = seen[:, line], ~seen[:, line]
        others = np.flatnonzero(seen[gap].all(axis=0))
        rows = known & seen[:, others].all(axis=1)
        if len(others) >= _MIN_OTHERS and rows.sum() >= _MIN_ROWS:
            predicted = _predict(turned[:, others].reshape(len(turned), -1), turned[:, line], rows)
            filled[gap, line] = (predicted + _interpolate_rest(turned[:, line] - predicted, rows))[gap]
    return quaternion.rotate_about_up(filled, heading)


def _measure_heading(landmarks: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
    """Measure the angle (T,) about Z by which hips, or else shoulders, are turned from lying along Y."""
    across = np.zeros((len(positions), 2))
    for part in ("shoulder", "hip"):
        if f"left_{part}" in landmarks and f"right_{part}" in landmarks:
            left, right = (positions[:, landmarks.index(f"{side}_{part}"), :2] for side in ("left", "right"))
            across = np.where(np.isfinite(left - right).all(axis=1)[:, None], left - right, across)
    return arctan2(-across[:, 0], across[:, 1])


def _predict(others: np.ndarray, own: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Predict a point (T, 3) from others (T, K), by ridge regression over the frames `rows`."""
    inputs = np.where(np.isfinite(others), others, np.nanmean(others[rows], axis=0))
    mean, centre = inputs[rows].mean(axis=0), own[rows].mean(axis=0)
    x, y = inputs[rows] - mean, own[rows] - centre
    ridge = _NOISE**2 * len(x) * np.eye(x.shape[1])
    return (inputs - mean) @ np.linalg.solve(x.T @ x + ridge, x.T @ y) + centre


def _interpolate_rest(rest: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Interpolate what a prediction lacks (T, 3) between the frames `rows`, from the mean of some on each side."""
    frames, known = np.arange(len(rest)), np.flatnonzero(rows)
    smooth = np.stack([np.convolve(np.pad(column, _REST_FRAMES // 2, mode="edge"), np.ones(_REST_FRAMES) / _REST_FRAMES,
                                   mode="valid") for column in rest[known].T], axis=1)
    return np.stack([np.interp(frames, known, column) for column in smooth.T], axis=1)


def _measure_middle(positions: np.ndarray) -> np.ndarray:
    """Measure the middle (T, 3) of points (T, L, 3); one that is not seen counts as in its mean place among them."""
    seen = np.isfinite(positions).all(axis=2)
    shown = positions[seen.any(axis=1)]
    usual = np.nanmedian(shown - np.nanmean(shown, axis=1, keepdims=True), axis=0)
    total = np.where(seen[..., None], positions - usual, 0.0).sum(axis=1)
    count = seen.sum(axis=1)[:, None]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _smooth_values(values: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Smooth values (T, L, 3) with gaps, those of a left and a right point alike; one without any value stays NaN."""
    seen, out = np.isfinite(values).all(axis=2), np.full(values.shape, np.nan)
    parts = [name.removeprefix("left_").removeprefix("right_") for name in names]
    for part in dict.fromkeys(parts):
        lines = [line for line, other in enumerate(parts) if other == part and seen[:, line].any()]
        strength = _find_strength([values[seen[:, line], line] for line in lines])
        for line in lines:
            own = np.where(seen[:, line, None], values[:, line], 0.0)
            out[:, line] = _solve(own, seen[:, line].astype(float), strength)
    return out


def _find_strength(values: list[np.ndarray]) -> float:
    """Find the strength with the least generalized cross validation T RSS / (T - trace)^2 of values, each (T, 3); they
    are joined over their gaps, which are few.
    """
    values = [one for one in values if len(one) >= _SHORTEST]
    if not values:
        return 1.0
    scores = np.zeros(len(_STRENGTHS))
    for one in values:
        count = len(one)
        penalties = (2.0 - 2.0 * np.cos(np.arange(count) * np.pi / count)) ** _ORDER  # eigenvalues of D'D, about
        for number, strength in enumerate(_STRENGTHS):
            trace = float((1.0 / (1.0 + strength * penalties)).sum())
            left = one - _solve(one, np.ones(count), strength)
            scores[number] += count * np.sum(left**2) / (count - trace) ** 2
    return float(_STRENGTHS[int(np.argmin(scores))])


def _solve(values: np.ndarray, weight: np.ndarray, strength: float) -> np.ndarray:
    """Solve (W + strength D'D) x = W values for values (T, K) and weights (T,)."""
    count = len(values)
    bands = np.zeros((_ORDER + 1, count))
    for first in range(_ORDER + 1):  # D'D by its diagonals: sums of products of the difference's coefficients
        for other in range(first, _ORDER + 1):
            product = _DIFFERENCE[first] * _DIFFERENCE[other]
            gap = other - first
            bands[_ORDER - gap, other : count - _ORDER + other] += strength * product
    bands[_ORDER] += weight
    bands[_ORDER] += 1e-9  # where the ends are not seen
    return solveh_banded(bands, weight[:, None] * values, check_finite=False)


def find_stretches(times: np.ndarray, fps: float) -> list[tuple[int, int]]:
    """Find the stretches without a gap over LONGEST_GAP s: the first sample of each, and the one after its last."""
    near = np.diff(times) <= LONGEST_GAP + 0.5 / fps
    return [(first, last + 1) for first, last in find_runs(near)]
