"""Jumps: samples, single ones or whole stretches, that lie where the marker cannot have been (ghosts, reflections)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .carriers import Carried
from .gaps import bridge
from .pieces import leaps, pieces
from .robust import quantile

# the longest burst that is taken out as a jump, s
_BURST = 0.08
# and how far off its way it lies at least, m, and as a part of what the marker moves meanwhile
_LEAST_BURST, _LEAST_SHARE = 0.015, 0.3
# a longer stretch is a ghost if it lies at least this far from where its helpers say, m
_GHOST = 0.06
# a single sample is off if it leaves the way by this much, m (as its helpers see it; in the world), by more than limbs
# can do in a frame, m/s^2, and by this many times what nine tenths of the samples around it do
_OFF_LOCAL, _OFF_WORLD, _TIMES = 0.006, 0.015, 3.0
_SWING_LOCAL, _SWING_WORLD = 100.0, 300.0
_AROUND = 12
# a marker that only seems to jump because one of its helpers does stays on its own way in the world
_ITS_OWN = 0.5


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
