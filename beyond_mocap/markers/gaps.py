"""Gaps filled: by the markers that carry the missing one, and by a smooth curve where none do and the gap is short."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ..motion.runs import runs
from .carriers import Carried, carried, helpers_of
from .cluster_shape import Shape, mean_shape

# a marker that strays this far from its place among its helpers rides on them softly, m
_SOFT = 0.015
# over how much time the slope at a gap's edge is read, s
_EDGE = 0.03


class Gap(NamedTuple):
    """A stretch of one marker without sight: frames from `first` up to, not with, `end`; `how` it was filled.

    how: "cluster" (it rides on markers that move with it), "soft" (on markers that it moves against a little), "spline"
    (a smooth curve), or "" (not filled).
    """

    marker: int
    first: int
    end: int
    how: str

    @property
    def frames(self) -> int:
        """How many."""
        return self.end - self.first


class Longest(NamedTuple):
    """The longest gap that is filled in each way, seconds."""

    cluster: float = 2.0
    soft: float = 0.25
    spline: float = 0.1


def gaps_of(positions: np.ndarray, markers: Iterable[int]) -> list[Gap]:
    """The gaps of these markers of positions (T, M, 3) m, of those that are seen at all; by marker and time."""
    seen = np.isfinite(positions[..., 0])
    return [Gap(marker, first, end, "") for marker in markers if seen[:, marker].any()
            for first, end in runs(~seen[:, marker])]


def fill(
    positions: np.ndarray,
    soft: np.ndarray,
    fps: float,
    longest: Longest,
    known: Mapping[int, Carried],
    ask: Callable[[], None] = lambda: None,
) -> tuple[np.ndarray, list[Gap]]:
    """(positions (T, M, 3) m with gaps filled, the gaps and how): nothing that was seen is moved, and nothing jumps.

    soft: (M, M) m, how much each pair's distance varies. known: the markers whose gaps are filled, and what carries them
    as a rule. ask: called for each gap; it may raise. Every gap is filled from what was seen alone, never from
    another gap's filling.
    """
    out, told = positions.copy(), []
    shapes: dict[tuple[int, ...], Shape] = {one.helpers: one.shape for one in known.values() if one.helpers}
    for gap in gaps_of(positions, known):
        ask()
        how, path = _by_helpers(positions, gap, soft, fps, longest, known[gap.marker], shapes) or ("spline", None)
        if path is None and gap.frames <= longest.spline * fps:
            path = bridge(positions[:, gap.marker], gap.first, gap.end, fps)
        if path is None:
            told.append(gap)
            continue
        out[gap.first : gap.end, gap.marker] = path
        told.append(gap._replace(how=how))
    return out, told


def _by_helpers(positions, gap, soft, fps, longest, one, shapes):
    """(how, path (n, 3)) of a gap ridden over on the markers seen all through it, or None."""
    low, high = max(gap.first - 1, 0), min(gap.end + 1, len(positions))
    there = np.isfinite(positions[low:high, :, 0]).all(axis=0)
    there[gap.marker] = False
    if there.sum() < 3 or gap.frames > max(longest.cluster, longest.soft) * fps:
        return None
    if not (one.helpers and there[list(one.helpers)].all() and one.trusted[gap.first : gap.end].all()):
        one = _others(positions, gap, soft, there, shapes)
    if not one.helpers or not one.trusted[gap.first : gap.end].all():
        return None
    how = "cluster" if one.sigma <= _SOFT else "soft"
    local = _between(one.local, gap, fps, how == "soft")
    if local is None or gap.frames > getattr(longest, how) * fps:
        return None
    turn, shift = one.fit.rotation[gap.first : gap.end], one.fit.shift[gap.first : gap.end]
    return how, np.einsum("tij,tj->ti", turn, local) + shift


def _others(positions, gap, soft, there, shapes):
    """How the marker of a gap is carried by markers that are `there` (M,) all through it."""
    reachable = np.where(there[None, :] & there[:, None], soft, np.inf)
    reachable[gap.marker] = np.where(there, soft[gap.marker], np.inf)
    helpers = helpers_of(gap.marker, reachable, positions)
    if helpers and helpers not in shapes:
        shapes[helpers] = mean_shape(positions[:, list(helpers)])
    return carried(positions, gap.marker, helpers, shapes.get(helpers))


def _between(local, gap, fps, curved):
    """The marker's way (n, 3) in its helpers' frame: from where it went to where it comes back, held at an open end."""
    begins, ends = gap.first > 0, gap.end < len(local)
    before = local[gap.first - 1] if begins else np.full(3, np.nan)
    after = local[gap.end] if ends else np.full(3, np.nan)
    if (begins and np.isnan(before[0])) or (ends and np.isnan(after[0])):
        return None
    if not (begins and ends):
        # an open end of a soft marker would be a guess
        return None if curved else np.repeat((before if begins else after)[None], gap.frames, axis=0)
    if curved and (path := bridge(local, gap.first, gap.end, fps)) is not None:
        return path
    share = np.arange(1, gap.frames + 1)[:, None] / (gap.frames + 1)
    return before + share * (after - before)


def bridge(way: np.ndarray, first: int, end: int, fps: float) -> np.ndarray | None:
    """The cubic curve (end - first, 3) m over the frames `first` to `end` of a way (T, 3) m, with the slopes that the
    way has on either side; None where it is not seen there."""
    if first == 0 or end == len(way):
        return None
    before, after = _edge(way[:first][::-1], fps), _edge(way[end:], fps)
    if before is None or after is None:
        return None
    span = end - first + 1
    s = (np.arange(1, span) / span)[:, None]
    p, q, u, v = way[first - 1], way[end], -before * span, after * span
    return (2 * s**3 - 3 * s**2 + 1) * p + (s**3 - 2 * s**2 + s) * u + (3 * s**2 - 2 * s**3) * q + (s**3 - s**2) * v


def _edge(way, fps):
    """The slope (3,) per frame with which a way sets out from its first frame, by a parabola; None where it is short."""
    count = min(len(way), max(4, int(round(_EDGE * fps)) + 1))
    there = np.flatnonzero(np.isnan(way[:count, 0]))
    count = int(there[0]) if len(there) else count
    if count < 2:
        return None
    t = np.arange(count, dtype=float)
    return np.polynomial.polynomial.polyfit(t, way[:count], min(2, count - 1))[1]
