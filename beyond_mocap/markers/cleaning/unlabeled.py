"""Unlabeled markers: given the label of a marker that is missing where they are, if its cluster says it lies there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..model.marker_set import UNLABELED
from .carriers import Carried
from .pieces import Piece, leaps, pieces

# a piece this short tells nothing, s
_SHORTEST = 0.02
# how near a piece must begin to where the label was last seen, and end to where it is seen again, if no cluster tells,
# m; and how long before or after that may be, s
_JOINS, _WITHIN = 0.02, 0.05
# where label and unlabeled are both seen they must agree to this, m
_AGREES = 0.01


class Assigned(NamedTuple):
    """An unlabeled marker took a label for frames `first` up to, not with, `end`; `off` m from where it should be."""

    unlabeled: int
    label: int
    first: int
    end: int
    off: float


def unlabeled(labels: Sequence[str], known: Sequence[str] = ()) -> list[int]:
    """Which of the labels are none (`*7`, `U12`, ...); those in `known` are labels whatever they look like."""
    return [index for index, label in enumerate(labels) if label not in known and UNLABELED.match(label)]


def assign(
    positions: np.ndarray, carried: Mapping[int, Carried], nameless: Sequence[int], fps: float
) -> tuple[np.ndarray, list[Assigned]]:
    """(positions (T, M, 3) m, what was assigned): pieces of the `nameless` markers moved to the labels they belong to.

    The best fitting first; a label takes at most one at a time, and a piece gives each of its frames once.
    """
    out, found = positions.copy(), []
    alone = np.ascontiguousarray(positions[:, list(nameless)])
    offered = [
        Piece(nameless[piece.marker], piece.first, piece.end)
        for piece in pieces(alone, leaps(alone, {}, fps)) if piece.end - piece.first >= max(2, _SHORTEST * fps)
    ]
    lacking = [marker for marker in carried if marker not in nameless and np.isnan(positions[:, marker, 0]).any()]
    asked = (_offer(positions, carried, piece, marker, fps) for piece in offered for marker in lacking)
    offers = [offer for offer in asked if offer]
    for offer in sorted(offers):
        _, piece, marker, off = offer
        way = out[piece.first : piece.end, piece.marker]
        free = np.isfinite(way[:, 0]) & np.isnan(out[piece.first : piece.end, marker, 0])
        if not free.any():
            continue
        frames = np.flatnonzero(free) + piece.first
        out[frames, marker] = out[frames, piece.marker]
        out[frames, piece.marker] = np.nan
        found.append(Assigned(piece.marker, marker, int(frames[0]), int(frames[-1]) + 1, off))
    return out, sorted(found, key=lambda one: one.first)


def _offer(positions, carried, piece, marker, fps):
    """(rank, piece, marker, how far off) of a piece that may be this marker, or None."""
    stretch = slice(piece.first, piece.end)
    way = positions[stretch, piece.marker]
    missing = np.isnan(positions[stretch, marker, 0])
    if not missing.any() or _disagree(way, positions[stretch, marker]):
        return None
    one = carried[marker]
    joins = _joins(positions, piece, marker, fps)
    if one.helpers:
        off = np.linalg.norm(one.brought(_over(positions, piece))[stretch] - one.place, axis=-1)[missing]
        told = off[np.isfinite(off)]
        if len(told) >= max(2, 0.3 * missing.sum()):
            median, worst = float(np.median(told)), float(np.percentile(told, 95.0))
            fits = median < one.tolerance and worst < 2.0 * one.tolerance
            # a soft cluster alone is no proof: there the ways must join as well
            sure = one.tolerance < 0.06 or joins is not None
            return (median / one.tolerance, piece, marker, median) if fits and sure else None
    return (2.0 + joins, piece, marker, joins) if joins is not None else None


def _over(positions, piece):
    """The nameless marker's way over all frames, NaN outside the piece: (T, 3) m."""
    way = np.full((len(positions), 3), np.nan)
    way[piece.first : piece.end] = positions[piece.first : piece.end, piece.marker]
    return way


def _disagree(way, labelled):
    """Whether label and nameless are both seen, in places apart."""
    apart = np.linalg.norm(way - labelled, axis=-1)
    return bool((apart > _AGREES).any())


def _joins(positions, piece, marker, fps):
    """How far the piece is from the label's way where they should meet, m: the worse of the ends there are, or None."""
    seen = np.isfinite(positions[:, marker, 0])
    before, after = np.flatnonzero(seen[: piece.first]), np.flatnonzero(seen[piece.end :]) + piece.end
    within, way = max(1, int(_WITHIN * fps)), positions[:, piece.marker]
    misses = []
    if len(before) and piece.first - before[-1] <= within and piece.end - piece.first > 1:
        steps = piece.first - before[-1]
        back = way[piece.first] - steps * (way[piece.first + 1] - way[piece.first])
        misses.append(float(np.linalg.norm(back - positions[before[-1], marker])))
    if len(after) and after[0] - (piece.end - 1) <= within and piece.end - piece.first > 1:
        steps = after[0] - (piece.end - 1)
        on = way[piece.end - 1] + steps * (way[piece.end - 1] - way[piece.end - 2])
        misses.append(float(np.linalg.norm(on - positions[after[0], marker])))
    return max(misses) if misses and max(misses) < _JOINS else None
