"""Fill gaps: by the markers that carry the missing one, or by a smooth curve where there are none and the gap is
short.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ...base.easing import hermite
from ...base.time_series import find_runs
from .carriers import CarriedMarker, choose_carriers, measure_carried_marker
from .cluster_shape import ClusterShape, compute_mean_shape, compute_quantile

# Metres by which a marker deviates from its place among its carriers, from which on they carry it softly: the usual
# deviation, and its 95 % quantile.
_SOFT_SIGMA, _SOFT_QUANTILE = 0.015, 0.03
_EDGE_SECONDS = 0.03  # s over which the slope at a gap's edge is measured
# A curve is used if it deviates by at most so many metres over other stretches of that length; so many are tried.
_MAX_CURVE_ERROR, _TRIAL_COUNT = 0.02, 24


class Gap(NamedTuple):
    """A stretch in which one marker is not visible.

    Attributes:
        marker: index of the marker.
        first: first frame.
        end: the frame after the last.
        how: "cluster" (filled by markers that move with it), "soft" (by markers that it moves against a little),
            "spline" (by a smooth curve), or "" (not filled).
    """

    marker: int
    first: int
    end: int
    how: str

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.end - self.first


class GapLimits(NamedTuple):
    """The longest gap that is filled by each method, in seconds.

    Attributes:
        cluster: by firm carriers.
        soft: by soft carriers.
        spline: by a curve.
    """

    cluster: float = 2.0
    soft: float = 0.25
    spline: float = 0.1


def find_gaps(positions: np.ndarray, markers: Iterable[int]) -> list[Gap]:
    """Find the gaps of markers that are visible at all.

    Args:
        positions: (T, M, 3) metres.
        markers: indices of the markers.
    Returns:
        The gaps, by marker and time.
    """
    seen = np.isfinite(positions[..., 0])
    return [Gap(marker, first, end, "") for marker in markers if seen[:, marker].any()
            for first, end in find_runs(~seen[:, marker])]


def fill_gaps(positions: np.ndarray, softness: np.ndarray, fps: float, limits: GapLimits,
              known: Mapping[int, CarriedMarker],
              check_cancelled: Callable[[], None] = lambda: None) -> tuple[np.ndarray, list[Gap]]:
    """Fill gaps; no visible marker is moved, and no trajectory jumps.

    Every gap is filled from visible markers alone, never from another gap's filling.

    Args:
        positions: (T, M, 3) metres.
        softness: (M, M) metres, how much each pair's distance varies.
        fps: frames per second.
        limits: the longest gaps that are filled.
        known: the markers whose gaps are filled, and how they are usually carried.
        check_cancelled: called for each gap; it may raise.
    Returns:
        The filled positions, and the gaps with the method used.
    """
    out, gaps = positions.copy(), []
    shapes: dict[tuple[int, ...], ClusterShape] = {one.carriers: one.shape for one in known.values() if one.carriers}
    for gap in find_gaps(positions, known):
        check_cancelled()
        one = _find_gap_carriers(positions, gap, softness, known[gap.marker], shapes)
        filling = _fill_by_carriers(one, gap, limits.cluster * fps) or _fill_by_curve(positions, one, gap, fps, limits)
        method, path = filling or ("", None)
        if method:
            out[gap.first : gap.end, gap.marker] = path
        gaps.append(gap._replace(how=method))
    return out, gaps


def _find_gap_carriers(positions, gap, softness, one, shapes):
    """Measure how the gap's marker is carried by markers visible throughout the gap and at its edges; None if it is
    not.
    """
    low, high = max(gap.first - 1, 0), min(gap.end + 1, len(positions))
    visible = np.isfinite(positions[low:high, :, 0]).all(axis=0)
    visible[gap.marker] = False
    if not (one.carriers and visible[list(one.carriers)].all() and one.is_trusted[gap.first : gap.end].all()):
        one = _carry_by_others(positions, gap, softness, visible, shapes)
    return one if one.carriers and one.is_trusted[gap.first : gap.end].all() else None


def _fill_by_carriers(one, gap, longest):
    """Fill by firm carriers: ("cluster", path (n, 3)), or None."""
    if one is None or gap.frames > longest or one.sigma > _SOFT_SIGMA or compute_quantile(one.deviation,
            0.95) > _SOFT_QUANTILE:
        return None
    has_before, has_after = gap.first > 0, gap.end < len(one.local)
    before = one.local[gap.first - 1] if has_before else one.local[gap.end]
    after = one.local[gap.end] if has_after else before
    if np.isnan(before[0]) or np.isnan(after[0]):
        return None
    share = np.arange(1, gap.frames + 1)[:, None] / (gap.frames + 1)
    return "cluster", _to_world(one, gap, before + share * (after - before))


def _fill_by_curve(positions, one, gap, fps, limits):
    """Fill a short gap by a curve: ("soft", path) or ("spline", path), or None.

    Of the carriers' frame and the world, the one is used in which the curve deviates less elsewhere in the trial; None
    where both deviate too much.
    """
    trajectories = []
    if one is not None and gap.frames <= limits.soft * fps:
        trajectories.append(("soft", one.local))
    if gap.frames <= limits.spline * fps:
        trajectories.append(("spline", positions[:, gap.marker]))
    rated = [(_estimate_curve_error(trajectory, gap.frames, fps), method, trajectory) for method,
             trajectory in trajectories]
    for expected, method, trajectory in sorted(rated, key=lambda row: row[0]):
        path = bridge_gap(trajectory, gap.first, gap.end, fps)
        if path is not None and expected < _MAX_CURVE_ERROR:
            return method, _to_world(one, gap, path) if method == "soft" else path
    return None


def _estimate_curve_error(trajectory, frames, fps):
    """Estimate the error in metres of a curve over `frames`: the 90 % quantile over some visible stretches."""
    seen = np.concatenate([[0], np.cumsum(np.isfinite(trajectory[:, 0]))])
    edge = max(4, int(round(_EDGE_SECONDS * fps)) + 1)
    starts = np.arange(edge, len(trajectory) - frames - edge)
    # stretches of which all frames and both edges are visible, by differences of the cumulative count
    starts = starts[seen[starts + frames + edge] - seen[starts - edge] == frames + 2 * edge] if len(starts) else starts
    if len(starts) < 3:
        return np.inf
    off = []
    for first in starts[np.unique(np.linspace(0, len(starts) - 1, _TRIAL_COUNT).astype(int))]:
        curve = bridge_gap(trajectory, int(first), int(first) + frames, fps)
        off.append(np.linalg.norm(curve - trajectory[first : first + frames], axis=-1).max())
    return float(np.quantile(off, 0.9))


def _to_world(one, gap, local):
    """Convert places (n, 3) metres in the carriers' frame to the world, over the frames of a gap."""
    turn, shift = one.fit.rotation[gap.first : gap.end], one.fit.shift[gap.first : gap.end]
    return np.einsum("tij,tj->ti", turn, local) + shift


def _carry_by_others(positions, gap, softness, visible, shapes):
    """Measure how the marker of a gap is carried by markers that are visible (M,) throughout."""
    reachable = np.where(visible[None, :] & visible[:, None], softness, np.inf)
    reachable[gap.marker] = np.where(visible, softness[gap.marker], np.inf)
    helpers = choose_carriers(gap.marker, reachable, positions)
    if helpers and helpers not in shapes:
        shapes[helpers] = compute_mean_shape(positions[:, list(helpers)])
    return measure_carried_marker(positions, gap.marker, helpers, shapes.get(helpers))


def bridge_gap(trajectory: np.ndarray, first: int, end: int, fps: float) -> np.ndarray | None:
    """Build a cubic curve across frames, with the slopes of the trajectory on either side.

    Args:
        trajectory: (T, 3) metres.
        first: first frame of the gap.
        end: the frame after the gap.
        fps: frames per second.
    Returns:
        (end - first, 3) metres; None where the trajectory is not visible on both sides.
    """
    if first == 0 or end == len(trajectory):
        return None
    before, after = _measure_edge_slope(trajectory[:first][::-1], fps), _measure_edge_slope(trajectory[end:], fps)
    if before is None or after is None:
        return None
    span = end - first + 1
    share = (np.arange(1, span) / span)[:, None]
    return hermite(share, trajectory[first - 1], -before * span, trajectory[end], after * span)


def _measure_edge_slope(trajectory, fps):
    """Measure the slope (3,) metres per frame at the first frame of a trajectory, by a parabola; None where it is
    too short.
    """
    count = min(len(trajectory), max(4, int(round(_EDGE_SECONDS * fps)) + 1))
    there = np.flatnonzero(np.isnan(trajectory[:count, 0]))
    count = int(there[0]) if len(there) else count
    if count < 2:
        return None
    t = np.arange(count, dtype=float)
    return np.polynomial.polynomial.polyfit(t, trajectory[:count], min(2, count - 1))[1]
