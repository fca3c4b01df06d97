"""Pieces of a marker's way: cut where it is not seen, and where it leaps as no body does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .carriers import Carried
from .robust import quantile

# a step that bends the way by more than this is a leap, m, if it is also more than what a limb can do in a frame, m/s^2
# (as its helpers see it, and in the world), and this many times what the marker does in all but a twentieth of the
# frames
_LEAP_LOCAL, _LEAP_WORLD, _TIMES_ITS_OWN = 0.02, 0.04, 6.0
_SWING_LOCAL, _SWING_WORLD = 200.0, 500.0


class Piece(NamedTuple):
    """An unbroken stretch of one marker: frames from `first` up to, not with, `end`."""

    marker: int
    first: int
    end: int


def leaps(positions: np.ndarray, carried: Mapping[int, Carried], fps: float) -> np.ndarray:
    """(T, M) bool: between which frames markers (T, M, 3) m leap; True at the frame after.

    By how the way in the world bends, and how it does as the marker's helpers see it.
    """
    out = _leaping(positions, max(_LEAP_WORLD, _SWING_WORLD / fps**2))
    local = max(_LEAP_LOCAL, _SWING_LOCAL / fps**2)
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
    where there is nothing to compare with.
    """
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
