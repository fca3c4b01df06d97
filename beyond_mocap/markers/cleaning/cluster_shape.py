"""The shape of a cluster of markers over a whole trial, its deformation, and the variation of distances between
markers.

Also medians and quantiles that ignore NaN, for many markers at once: numpy's own (`nanmedian`, `nanpercentile`) go
through Python for each column and are a hundred times as slow on trials.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..rigid_fit import fit_rigid, place_points, to_model_frame

_ITERATIONS = 3  # iterations of shape and weights
_MAX_FRAMES = 100  # frames of a trial that are used


class ClusterShape(NamedTuple):
    """The shape of a cluster without its movement.

    Attributes:
        places: (N, 3) metres in the cluster's own frame (about its middle, rotated as in the frame it started from),
            NaN for a marker that is never visible together with the others.
        sigma: (N,) metres by which each marker usually deviates from its place (robust root mean square).
        usual_deformation: metres, the median over frames of the fit's rms.
    """

    places: np.ndarray
    sigma: np.ndarray
    usual_deformation: float


def compute_mean_shape(positions: np.ndarray) -> ClusterShape:
    """Compute the robust mean shape of one cluster: generalized Procrustes analysis.

    Every frame is fitted to the shape by a rigid motion, and the shape becomes the mean of the fitted frames. Frames
    and samples far off (swaps, ghosts) get ever less weight (Geman-McClure weights at three times the usual distance).

    Args:
        positions: (T, N, 3) metres, NaN where not visible.
    Returns:
        The shape.
    """
    positions = np.asarray(positions, dtype=float)
    chosen = positions[_select_frames(np.isfinite(positions[..., 0]).sum(axis=1))]
    places = chosen[_find_typical_frame(chosen)]
    seen = np.isfinite(places).all(axis=-1)
    places = places - (places[seen].mean(axis=0) if seen.any() else 0.0)
    weights = np.ones(chosen.shape[:2])
    for _ in range(_ITERATIONS):
        fit = fit_rigid(places, chosen, weights)
        back = to_model_frame(fit, chosen)
        away = np.linalg.norm(back - places, axis=-1)
        # Geman-McClure weights; a marker without a place in the shape yet gets a tiny one, to enter it
        scale = 3.0 * max(compute_median(away), 1e-4)
        weights = np.where(np.isfinite(away), 1.0 / (1.0 + (away / scale) ** 2) ** 2, np.isfinite(back[..., 0]) * 1e-3)
        weights = np.where(fit.is_determined[:, None], weights, 0.0)
        total = weights.sum(axis=0)[:, None]
        summed = np.einsum("tn,tnc->nc", weights, np.where(weights[..., None] > 0.0, back, 0.0))
        places = np.where(total > 0.0, summed / np.maximum(total, 1e-12), places)
    fit = fit_rigid(places, chosen, weights)
    away = np.linalg.norm(place_points(fit, places) - chosen, axis=-1)
    return ClusterShape(places, 1.4826 * compute_medians(away), compute_median(fit.rms[fit.is_determined]))


def measure_distance_spread(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure the median distance of each pair of markers, and how much it varies.

    The spread is computed from the range that contains nine tenths of the frames, so that short swaps and ghosts have
    no effect.

    Args:
        positions: (T, M, 3) metres.
    Returns:
        Median distances (M, M) metres, and spreads (M, M) metres as standard deviations: inf for pairs that are hardly
        ever visible together, 0 on the diagonal.
    """
    seen = np.isfinite(positions[..., 0])
    chosen = positions[_select_frames(seen.sum(axis=1))]
    count = chosen.shape[1]
    spread, middle = np.full((count, count), np.inf), np.zeros((count, count))
    for marker in range(count):
        distance = np.linalg.norm(chosen - chosen[:, marker : marker + 1], axis=-1)
        together = np.isfinite(distance).sum(axis=0) >= min(10, len(chosen))
        low, half, high = (compute_quantile(distance[:, together], share) for share in (0.05, 0.5, 0.95))
        # 90 % of a normal distribution lie within 3.29 standard deviations
        spread[marker, together] = (high - low) / 3.29
        middle[marker, together] = half
    spread = np.fmin(spread, spread.T)
    np.fill_diagonal(spread, 0.0)
    return middle, spread


def _select_frames(seen_count):
    """Select at most a hundred frames evenly over the trial, of those that show the most markers."""
    full = np.flatnonzero(seen_count >= max(3, 0.8 * seen_count.max(initial=0)))
    if not len(full):
        full = np.arange(len(seen_count))
    return full[np.unique(np.linspace(0, len(full) - 1, min(len(full), _MAX_FRAMES)).astype(int))]


def _find_typical_frame(positions):
    """Find the frame whose distances between markers lie nearest to their medians over the trial."""
    distance = np.linalg.norm(positions[:, :, None] - positions[:, None], axis=-1)
    away = np.abs(distance - compute_medians(distance))
    missing = np.isnan(away).sum(axis=(1, 2))
    return int(np.argmin(np.nansum(away, axis=(1, 2)) + 10.0 * missing))


def compute_quantile(values: np.ndarray, share: float, axis: int = 0) -> np.ndarray:
    """Compute quantiles that ignore NaN, with linear interpolation.

    Args:
        values: the values.
        share: 0 to 1.
        axis: along which the quantile is taken.
    Returns:
        The quantiles; NaN where all values are NaN.
    """
    ordered = np.moveaxis(np.sort(values, axis=axis), axis, 0)  # NaN comes last
    if not len(ordered):
        return np.full(ordered.shape[1:], np.nan)
    at = np.maximum(np.isfinite(ordered).sum(axis=0) - 1, 0) * share
    low = np.floor(at).astype(int)
    high = np.ceil(at).astype(int)
    below, above = (np.take_along_axis(ordered, index[None], axis=0)[0] for index in (low, high))
    return below + (at - low) * (above - below)


def compute_medians(values: np.ndarray, axis: int = 0) -> np.ndarray:
    """Compute the median along `axis`, ignoring NaN; 0 where all values are NaN."""
    return np.nan_to_num(compute_quantile(values, 0.5, axis))


def compute_median(values: np.ndarray) -> float:
    """Compute the median of all values, ignoring NaN; 0 where all are NaN."""
    return float(compute_medians(np.ravel(values)))
