"""Fill gaps: by the markers that carry the missing one, or by a smooth curve where there are none and the gap is
short.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ...base.easing import hermite
from ...base.time_series import runs
from .carriers import Carried, carried, helpers_of
from .cluster_shape import Shape, mean_shape, quantile

# Metres by which a marker deviates from its place among its carriers, from which on they carry it softly: the usual
# deviation, and its 95 % quantile.
_SOFT, _SOFT_AT_TIMES = 0.015, 0.03
_EDGE = 0.03  # s over which the slope at a gap's edge is measured
# A curve is used if it deviates by at most so many metres over other stretches of that length; so many are tried.
_NEAR, _TRIES = 0.02, 24


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


class Longest(NamedTuple):
    """The longest gap that is filled by each method, in seconds.

    Attributes:
        cluster: by firm carriers.
        soft: by soft carriers.
        spline: by a curve.
    """

    cluster: float = 2.0
    soft: float = 0.25
    spline: float = 0.1


def gaps_of(positions: np.ndarray, markers: Iterable[int]) -> list[Gap]:
    """Find the gaps of markers that are visible at all.

    Args:
        positions: (T, M, 3) metres.
        markers: indices of the markers.
    Returns:
        The gaps, by marker and time.
    """
    seen = np.isfinite(positions[..., 0])
    return [Gap(marker, first, end, "") for marker in markers if seen[:, marker].any()
            for first, end in runs(~seen[:, marker])]


def fill(positions: np.ndarray, soft: np.ndarray, fps: float, longest: Longest, known: Mapping[int, Carried],
         ask: Callable[[], None] = lambda: None) -> tuple[np.ndarray, list[Gap]]:
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
    out, told = positions.copy(), []
    shapes: dict[tuple[int, ...], Shape] = {one.helpers: one.shape for one in known.values() if one.helpers}
    for gap in gaps_of(positions, known):
        ask()
        one = _carried_over(positions, gap, soft, known[gap.marker], shapes)
        found = _firmly(one, gap, longest.cluster * fps) or _by_a_curve(positions, one, gap, fps, longest)
        how, path = found or ("", None)
        if how:
            out[gap.first : gap.end, gap.marker] = path
        told.append(gap._replace(how=how))
    return out, told


def _carried_over(positions, gap, soft, one, shapes):
    """Measure how the gap's marker is carried by markers visible throughout the gap and at its edges; None if it is
    not.
    """
    low, high = max(gap.first - 1, 0), min(gap.end + 1, len(positions))
    there = np.isfinite(positions[low:high, :, 0]).all(axis=0)
    there[gap.marker] = False
    if not (one.helpers and there[list(one.helpers)].all() and one.trusted[gap.first : gap.end].all()):
        one = _others(positions, gap, soft, there, shapes)
    return one if one.helpers and one.trusted[gap.first : gap.end].all() else None


def _firmly(one, gap, longest):
    """Fill by firm carriers: ("cluster", path (n, 3)), or None."""
    if one is None or gap.frames > longest or one.sigma > _SOFT or quantile(one.away, 0.95) > _SOFT_AT_TIMES:
        return None
    begins, ends = gap.first > 0, gap.end < len(one.local)
    before = one.local[gap.first - 1] if begins else one.local[gap.end]
    after = one.local[gap.end] if ends else before
    if np.isnan(before[0]) or np.isnan(after[0]):
        return None
    share = np.arange(1, gap.frames + 1)[:, None] / (gap.frames + 1)
    return "cluster", _in_the_world(one, gap, before + share * (after - before))


def _by_a_curve(positions, one, gap, fps, longest):
    """Fill a short gap by a curve: ("soft", path) or ("spline", path), or None.

    Of the carriers' frame and the world, the one is used in which the curve deviates less elsewhere in the trial; None
    where both deviate too much.
    """
    ways = []
    if one is not None and gap.frames <= longest.soft * fps:
        ways.append(("soft", one.local))
    if gap.frames <= longest.spline * fps:
        ways.append(("spline", positions[:, gap.marker]))
    tried = [(_expected(way, gap.frames, fps), how, way) for how, way in ways]
    for expected, how, way in sorted(tried, key=lambda row: row[0]):
        path = bridge(way, gap.first, gap.end, fps)
        if path is not None and expected < _NEAR:
            return how, _in_the_world(one, gap, path) if how == "soft" else path
    return None


def _expected(way, frames, fps):
    """Estimate the error in metres of a curve over `frames`: the 90 % quantile over some visible stretches."""
    seen = np.concatenate([[0], np.cumsum(np.isfinite(way[:, 0]))])
    edge = max(4, int(round(_EDGE * fps)) + 1)
    starts = np.arange(edge, len(way) - frames - edge)
    # stretches of which all frames and both edges are visible, by differences of the cumulative count
    starts = starts[seen[starts + frames + edge] - seen[starts - edge] == frames + 2 * edge] if len(starts) else starts
    if len(starts) < 3:
        return np.inf
    off = []
    for first in starts[np.unique(np.linspace(0, len(starts) - 1, _TRIES).astype(int))]:
        curve = bridge(way, int(first), int(first) + frames, fps)
        off.append(np.linalg.norm(curve - way[first : first + frames], axis=-1).max())
    return float(np.quantile(off, 0.9))


def _in_the_world(one, gap, local):
    """Convert places (n, 3) metres in the carriers' frame to the world, over the frames of a gap."""
    turn, shift = one.fit.rotation[gap.first : gap.end], one.fit.shift[gap.first : gap.end]
    return np.einsum("tij,tj->ti", turn, local) + shift


def _others(positions, gap, soft, there, shapes):
    """Measure how the marker of a gap is carried by markers that are visible (M,) throughout."""
    reachable = np.where(there[None, :] & there[:, None], soft, np.inf)
    reachable[gap.marker] = np.where(there, soft[gap.marker], np.inf)
    helpers = helpers_of(gap.marker, reachable, positions)
    if helpers and helpers not in shapes:
        shapes[helpers] = mean_shape(positions[:, list(helpers)])
    return carried(positions, gap.marker, helpers, shapes.get(helpers))


def bridge(way: np.ndarray, first: int, end: int, fps: float) -> np.ndarray | None:
    """Build a cubic curve across frames, with the slopes of the trajectory on either side.

    Args:
        trajectory: (T, 3) metres.
        first: first frame of the gap.
        end: the frame after the gap.
        fps: frames per second.
    Returns:
        (end - first, 3) metres; None where the trajectory is not visible on both sides.
    """
    if first == 0 or end == len(way):
        return None
    before, after = _edge(way[:first][::-1], fps), _edge(way[end:], fps)
    if before is None or after is None:
        return None
    span = end - first + 1
    share = (np.arange(1, span) / span)[:, None]
    return hermite(share, way[first - 1], -before * span, way[end], after * span)


def _edge(way, fps):
    """Measure the slope (3,) metres per frame at the first frame of a trajectory, by a parabola; None where it is
    too short.
    """
    count = min(len(way), max(4, int(round(_EDGE * fps)) + 1))
    there = np.flatnonzero(np.isnan(way[:count, 0]))
    count = int(there[0]) if len(there) else count
    if count < 2:
        return None
    t = np.arange(count, dtype=float)
    return np.polynomial.polynomial.polyfit(t, way[:count], min(2, count - 1))[1]
