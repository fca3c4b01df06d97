"""Pieces of a marker's trajectory, cut where it is not seen and where it leaps as no body does: those that jump
(ghosts, reflections) are taken out, and those of unlabeled markers get the label that is missing where they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..model.marker_set import UNLABELED
from .carriers import Carried
from .cluster_shape import quantile
from .gaps import bridge

# a step that bends the way by more than this is a leap, m, if it is also more than what a limb can do in a frame, m/s^2
# (as its helpers see it, and in the world), and this many times what the marker does in all but a twentieth of the
# frames
_LEAP_LOCAL, _LEAP_WORLD, _TIMES_ITS_OWN = 0.02, 0.04, 6.0
_LEAP_SWING_LOCAL, _LEAP_SWING_WORLD = 200.0, 500.0

_BURST = 0.08  # the longest burst that is taken out as a jump, s
# how far off its way a burst lies at least, m, and as a part of what the marker moves meanwhile
_LEAST_BURST, _LEAST_SHARE = 0.015, 0.3
_GHOST = 0.06  # a longer stretch is a ghost if it lies at least this far from where its helpers say, m
# a single sample is off if it leaves the way by this much, m (as its helpers see it; in the world), by more than limbs
# can do in a frame, m/s^2, and by this many times what nine tenths of the samples around it do
_OFF_LOCAL, _OFF_WORLD, _TIMES = 0.006, 0.015, 3.0
_SWING_LOCAL, _SWING_WORLD = 100.0, 300.0
_AROUND = 12
_ITS_OWN = 0.5  # a marker that only seems to jump because one of its helpers does stays on its own way in the world

_SHORTEST = 0.02  # a piece this short tells nothing, s
# how near a piece must begin to where the label was last seen, and end to where it is seen again, if no cluster tells,
# m; and how long before or after that may be, s
_JOINS, _WITHIN = 0.02, 0.05
_AGREES = 0.01  # where label and unlabeled are both seen they must agree to this, m


class Piece(NamedTuple):
    """An unbroken stretch of one marker: frames from `first` up to, not with, `end`."""

    marker: int
    first: int
    end: int


def leaps(positions: np.ndarray, carried: Mapping[int, Carried], fps: float) -> np.ndarray:
    """(T, M) bool: between which frames markers (T, M, 3) m leap; True at the frame after.

    By how the way in the world bends, and how it does as the marker's helpers see it."""
    out = _leaping(positions, max(_LEAP_WORLD, _LEAP_SWING_WORLD / fps**2))
    local = max(_LEAP_LOCAL, _LEAP_SWING_LOCAL / fps**2)
    for marker, one in carried.items():
        if not one.helpers:
            continue
        known = np.isfinite(one.local[:, 0])
        both = np.concatenate([[False], known[1:] & known[:-1]])
        out[:, marker] |= both & _leaping(one.local[:, None], local)[:, 0]
    return out


def pieces(positions: np.ndarray, leaping: np.ndarray) -> list[Piece]:
    """All pieces of markers (T, M, 3) m, cut where they leap (T, M); by marker, then by time."""
    seen = np.isfinite(positions[..., 0])
    found = []
    for marker in range(positions.shape[1]):
        there = np.concatenate([[False], seen[:, marker], [False]])
        begins = there[1:-1] & (~there[:-2] | leaping[:, marker])
        firsts = np.flatnonzero(begins)
        ends = np.flatnonzero(there[1:-1] & (~there[2:] | np.append(leaping[1:, marker], False))) + 1
        found += [Piece(marker, int(first), int(end)) for first, end in zip(firsts, ends)]
    return found


def bend(places: np.ndarray) -> np.ndarray:
    """(T, ...) m: how much the step into each frame differs from the two before and the two after, the least of them.

    A leap differs from them all; what comes after a leap, or lies between two, does not. places: (T, ..., 3) m; NaN
    where there is nothing to compare with."""
    steps = np.diff(places, axis=0)
    least = np.full(places.shape[:-1], np.inf)
    for apart in (1, 2):
        off = np.linalg.norm(steps[apart:] - steps[:-apart], axis=-1)
        off = np.where(np.isnan(off), np.inf, off)
        if len(off):
            least[1 + apart :] = np.minimum(least[1 + apart :], off)
            least[1:-apart] = np.minimum(least[1:-apart], off)
    return np.where(np.isfinite(least), least, np.nan)


def _leaping(places, least):
    """(T, N) bool for places (T, N, 3) m."""
    bent = bend(places)
    own = np.nan_to_num(quantile(bent, 0.95))
    return np.nan_to_num(bent) > np.maximum(least, _TIMES_ITS_OWN * own)


class Jump(NamedTuple):
    """Samples of one marker that were taken out: frames from `first` up to, not with, `end`; `off` m from its way."""

    marker: int
    first: int
    end: int
    off: float


def take_out(positions: np.ndarray, carried: Mapping[int, Carried], fps: float) -> tuple[np.ndarray, list[Jump]]:
    """(positions (T, M, 3) m without the samples that jump, which become NaN, the jumps)."""
    out, found = positions.copy(), []
    for jump in [*_bursts(positions, carried, fps), *_ghosts(positions, carried, fps)]:
        out[jump.first : jump.end, jump.marker] = np.nan
        found.append(jump)
    for jump in _spikes(out, carried, fps):
        out[jump.first, jump.marker] = np.nan
        found.append(jump)
    return out, sorted(found, key=lambda jump: (jump.first, jump.marker))


def _bursts(positions, carried, fps):
    """Short pieces between leaps (or a leap and a gap) that lie off the way before and after them."""
    leaping = leaps(positions, carried, fps)
    most = max(3, int(round(_BURST * fps)))
    seen = np.isfinite(positions[..., 0])
    # the shortest first, so that what lies between two jumps is not held to be one
    for piece in sorted(pieces(positions, leaping), key=lambda piece: piece.end - piece.first):
        marker, first, end = piece
        leapt = leaping[first, marker] or (end < len(positions) and leaping[end, marker])
        if end - first > most or not leapt:
            continue
        one = carried.get(marker)
        off, allowed = _off(positions[:, marker], seen[:, marker], piece, most, fps)
        if one is not None and one.helpers:
            near, near_allowed = _off(one.local, seen[:, marker] & np.isfinite(one.local[:, 0]), piece, most, fps)
            if np.isfinite(near_allowed):
                # what only seems to jump because a helper does stays on its own way in the world
                off, allowed = (near, near_allowed) if off > _ITS_OWN * near else (0.0, near_allowed)
        if off > allowed:
            seen[first:end, marker] = False
            yield Jump(marker, first, end, off)


def _ghosts(positions, carried, fps):
    """Longer pieces that begin or end in a leap and lie all along far from where the markers around them say."""
    leaping = leaps(positions, carried, fps)
    most = max(3, int(round(_BURST * fps)))
    seen = np.isfinite(positions[..., 0])
    for marker, first, end in pieces(positions, leaping):
        one = carried.get(marker)
        leapt = leaping[first, marker] or (end < len(positions) and leaping[end, marker])
        if one is None or not one.helpers or not leapt or end - first <= most:
            continue
        away = one.away[first:end]
        near = float(np.nan_to_num(quantile(away, 0.05)))
        told = np.isfinite(away).mean() > 0.5 and 2 * (end - first) < seen[:, marker].sum()
        if told and near > max(_GHOST, 2.0 * one.tolerance):
            yield Jump(marker, first, end, near)


def _off(way, seen, piece, most, fps):
    """(how far a piece lies off the smooth way across it, what is allowed), m, of a marker's way (T, 3)."""
    _, first, end = piece
    before, after = np.flatnonzero(seen[:first]), np.flatnonzero(seen[end:]) + end
    if not (len(before) and len(after)) or after[0] - before[-1] > 2 * most or not seen[first:end].all():
        return 0.0, np.inf
    low, high = int(before[-1]), int(after[0])
    across = bridge(np.where(seen[:, None], way, np.nan), low + 1, high, fps)
    if across is None:
        return 0.0, np.inf
    off = np.linalg.norm(way[first:end] - across[first - low - 1 : end - low - 1], axis=-1)
    return float(off.min()), max(_LEAST_BURST, _LEAST_SHARE * float(np.linalg.norm(way[high] - way[low])))


def _spikes(positions, carried, fps):
    """Single samples off the way through their neighbours."""
    world = _spiking(positions)
    usual = _around(world)
    local_least, world_least = max(_OFF_LOCAL, _SWING_LOCAL / fps**2), max(_OFF_WORLD, _SWING_WORLD / fps**2)
    for marker in range(positions.shape[1]):
        one = carried.get(marker)
        off, around, least = world[:, marker], usual[:, marker], np.full(len(positions), world_least)
        if one is not None and one.helpers:
            local = _spiking(np.where(np.isfinite(positions[:, marker]), one.local, np.nan)[:, None])[:, 0]
            known = np.isfinite(local)
            around = np.where(known, _around(local[:, None])[:, 0], around)
            least = np.where(known, local_least, least)
            off = np.where(known, np.where(off > _ITS_OWN * local, local, 0.0), off)
        with np.errstate(invalid="ignore"):
            spike = off > np.maximum(least, _TIMES * around)  # NaN is none
        for frame in np.flatnonzero(spike):
            # of neighbours the one farthest off is the spike; the others only feel it
            if off[frame] >= np.nanmax(off[max(frame - 2, 0) : frame + 3]):
                yield Jump(marker, int(frame), int(frame) + 1, float(off[frame]))


def _spiking(places):
    """(T, N) m: how far each sample is off the curve through two before and two after it; NaN where one is missing."""
    out = np.full(places.shape[:2], np.nan)
    if len(places) > 4:
        through = (4.0 * (places[1:-3] + places[3:-1]) - places[:-4] - places[4:]) / 6.0
        out[2:-2] = np.linalg.norm(places[2:-2] - through, axis=-1)
    return out


def _around(off):
    """(T, N) m: what nine tenths of the frames around each stay below, without itself and its next neighbours."""
    frames = len(off)
    steps = [step for step in range(-_AROUND, _AROUND + 1) if abs(step) > 2]
    index = np.clip(np.arange(frames)[:, None] + steps, 0, max(frames - 1, 0))
    return np.nan_to_num(quantile(off[index], 0.9, axis=1)) if frames else off


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


def assign(positions: np.ndarray, carried: Mapping[int, Carried], nameless: Sequence[int],
           fps: float) -> tuple[np.ndarray, list[Assigned]]:
    """(positions (T, M, 3) m, what was assigned): pieces of the `nameless` markers moved to the labels they belong to.

    The best fitting first; a label takes at most one at a time, and a piece gives each of its frames once."""
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
