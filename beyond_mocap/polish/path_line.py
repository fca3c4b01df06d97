"""Drawn lines as paths: polylines, dense or of a few corners, rounded to curves that a body can go along.
"""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..motion.path import SplinePath
from ..motion.smooth_spline import smoothing_spline

ROUNDING = 0.15
"""Metres over which corners are rounded, some."""

SHORTEST = 0.2
"""Metres that a line has at least."""

_SAMPLE = 1 / 6  # of the rounding, between samples of the line
_PIECE = 1 / 3  # of the rounding, a piece of the spline
_MOST_PIECES = 4000
_ORDER = 3  # the change of the bend is what costs, so that a bend that stays is kept to the line's very ends


def through(line: np.ndarray, name: str, rounding: float = ROUNDING, closed: bool = False) -> SplinePath:
    """The path along a polyline (N, 3) in metres, its parameter about metres along it.

    name: for messages. Points that repeat each other are dropped; corners are rounded over some `rounding` metres; smooth
    lines of radius 1 m or more are kept within a millimetre, and an open line's ends exactly. closed: the last point is
    joined to the first. InputError for fewer than two different points, values that are not finite, lines shorter than
    SHORTEST.
    """
    line = _checked(line, name, closed)
    length = _along(line)[-1]
    rounding = min(rounding, length / 12)
    sampled, along = _resampled(_thinned(line, rounding * _SAMPLE), rounding * _SAMPLE)
    pieces = int(np.clip(np.ceil(along[-1] / (rounding * _PIECE)), 8, _MOST_PIECES))
    if closed:
        spline = smoothing_spline(
            sampled[:-1], along[:-1], pieces, rounding, _ORDER, closed=True, domain=(0.0, along[-1])
        )
    else:
        weights = np.ones(len(along))
        spline = smoothing_spline(sampled, along, pieces, rounding, _ORDER, weights, ends_met=True)
    return SplinePath(*spline, closed=closed)


def _checked(line: np.ndarray, name: str, closed: bool) -> np.ndarray:
    """The line without points that repeat the one before, closed where asked; or InputError."""
    line = np.asarray(line, dtype=float)
    if line.ndim != 2 or line.shape[1] != 3:
        raise InputError(name, f"an array of shape {line.shape}", "points of three coordinates")
    if not np.isfinite(line).all():
        where = np.flatnonzero(~np.isfinite(line).all(axis=1))[0]
        raise InputError(name, f"point {where + 1} is not finite", "metres")
    if closed and len(line):
        line = np.concatenate([line, line[:1]])
    if len(line):
        line = line[np.append(True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-9)]
    if len(line) < 2:
        raise InputError(name, "all its points are one", "two different points at least", "draw it longer")
    if (length := _along(line)[-1]) < SHORTEST:
        raise InputError(name, f"it is {length:.3g} m long", f"{SHORTEST} m at least", "draw it longer")
    return line


def _along(line: np.ndarray) -> np.ndarray:
    """Metres (N,) along a polyline (N, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def _thinned(line: np.ndarray, step: float) -> np.ndarray:
    """Points denser than `step` metres averaged over it, so that their noise does not make the line longer."""
    along = _along(line)
    cell = np.floor(along / step).astype(int)
    first = np.flatnonzero(np.diff(cell, prepend=-1))
    count = np.diff(np.append(first, len(line)))
    if count.max() == 1:
        return line
    means = np.add.reduceat(line, first, axis=0) / count[:, None]
    means[0], means[-1] = line[0], line[-1]
    return means


def _resampled(line: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Even samples (M, 3) of a polyline about `step` metres apart, and metres (M,) along it."""
    along = _along(line)
    count = min(int(np.ceil(along[-1] / step)) + 1, 3 * _MOST_PIECES)
    even = np.linspace(0.0, along[-1], max(count, 16))
    return np.stack([np.interp(even, along, column) for column in line.T], axis=1), even
