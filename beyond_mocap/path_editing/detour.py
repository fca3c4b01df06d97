"""Small detours of a path: it leaves its way sideways, goes along beside it, and comes back.

A detour is (arc, width, offset) in metres: where its middle is along the path as it was, how much of the path it takes,
and how far to the left (right: negative) the path goes at its middle. It rises and falls by the quintic step
6 q^5 - 15 q^4 + 10 q^3, whose slope and bend vanish at both ends, so that the path stays C2. Detours add up.
"""

from __future__ import annotations

import numpy as np

from ..base.errors import InputError
from ..base.vectors import arctan2
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path, SplinePath

RISE = 0.4
"""Share of a detour's width in which it leaves the way, and in which it comes back."""
_STEP = 0.1  # metres between the places at which a path is taken
_STEADY = 0.3  # metres over which the way to the side is smoothed: an offset of a corner has no loop


def offsets(arc: np.ndarray, detours) -> np.ndarray:
    """Metres (..., N) to the left at these arc lengths (..., N); the numbers of a detour may be arrays (..., 1)."""
    total = 0.0 * arc
    for middle, width, offset in detours:
        rest = np.minimum(np.maximum((0.5 * width - np.abs(arc - middle)) / (RISE * width), 0.0), 1.0)
        total = total + offset * rest**3 * (10.0 + rest * (6.0 * rest - 15.0))
    return total


def round_offsets(arc: np.ndarray, detours, length: float) -> np.ndarray:
    """`offsets` on a closed path of this length: a detour goes on across the place where the path closes."""
    return sum((offsets(arc + shift * length, detours) for shift in (-1.0, 0.0, 1.0)), np.zeros(()))


def gentle_width(offset, speed: float):
    """Metres of path that a detour by `offset` needs for someone at `speed` m/s.

    Its bends are no tighter than a radius of 4 m, and push sideways by no more than 1.5 m/s^2.
    """
    bend = min(0.25, 1.5 / max(speed, 0.1) ** 2)
    most = 10.0 / np.sqrt(3.0)  # the quintic step's largest bend
    return np.maximum(1.5, np.sqrt(most * np.abs(offset) / bend) / RISE)


def headings(places: np.ndarray, spacing: float, closed: bool = False) -> np.ndarray:
    """Unwrapped yaw (N,) of a line (N, 3) of places `spacing` metres apart, smoothed over a step.

    Where the line goes straight up or down it is that of the way before and behind it.
    """
    along = np.gradient(places, axis=0)
    if closed:
        along[0] = along[-1] = 0.5 * (places[1] - places[-2])
    return _steady(_heading(along, spacing), _STEADY / spacing, closed)


def left_of(heading: np.ndarray) -> np.ndarray:
    """Unit vectors (N, 3), level, to the left of yaw angles (N,)."""
    return np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=-1)


def _heading(along, spacing):
    """Unwrapped yaw (N,) of tangents (N, 3), carried across where they have no level part."""
    level = np.hypot(along[:, 0], along[:, 1]) > 1e-3 * spacing
    if not level.any():
        return np.zeros(len(along))
    yaw = np.unwrap(arctan2(along[level, 1], along[level, 0]))
    return np.interp(np.arange(len(along)), np.flatnonzero(level), yaw)


def _steady(heading, sigma, closed):
    """Yaw (N,) smoothed by a Gaussian of `sigma` places; closed: the last place is the first one again."""
    reach = int(np.ceil(3.0 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    count = len(heading)
    if closed and count > reach + 1:
        turn = 2.0 * np.pi * np.round((heading[-1] - heading[0]) / (2.0 * np.pi))
        padded = np.concatenate([heading[-1 - reach : -1] - turn, heading, heading[1 : reach + 1] + turn])
    else:  # straight on at the ends: point reflection keeps the heading there
        far = np.minimum(np.arange(1, reach + 1), count - 1)
        before, after = 2 * heading[0] - heading[far[::-1]], 2 * heading[-1] - heading[count - 1 - far]
        padded = np.concatenate([before, heading, after])
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def with_detours(path: Path, detours) -> Path:
    """The path with these detours [(arc, width, offset)], C2 as before, under the same parameters; see above.

    Its ends move where a detour takes them in. Without detours it is `path` itself. InputError where a detour is not
    three finite numbers, the second positive.
    """
    for detour in detours:
        if len(detour) != 3 or not np.isfinite(detour).all() or detour[1] <= 0.0:
            raise InputError("detour", str(tuple(detour)), "arc, width and offset in metres, the width above 0")
    detours = [detour for detour in detours if detour[2] != 0.0]
    length = ArcLength(path)
    if not detours or not length.length:
        return path
    grid = np.linspace(0.0, length.length, max(int(np.ceil(length.length / _STEP)), 8) + 1)
    heading = headings(path.at(length.parameter(grid)), grid[1], path.closed)
    parameters = _parameters(path, length)
    arc = length.at(parameters)
    aside = round_offsets(arc, detours, length.length) if path.closed else offsets(arc, detours)
    left = left_of(_smooth(grid, heading, arc))
    return _through(parameters, path.at(parameters) + aside[:, None] * left, path.closed)


def _parameters(path, length):
    """Parameters, the path's breaks among them, that are nowhere more than a step apart on the ground."""
    breaks = np.asarray(path.breaks, dtype=float)
    counts = np.maximum(np.ceil(np.diff(length.at(breaks)) / _STEP).astype(int), 1)
    first, share = np.repeat(np.arange(len(counts)), counts), np.concatenate([np.arange(n) / n for n in counts])
    return np.append(breaks[first] + share * np.diff(breaks)[first], breaks[-1])


def _smooth(grid, values, at):
    """Values (N,) on a grid, between its places by a cubic spline: kinks of the heading would be kinks of the path."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(grid, values)(at)


def _through(parameters, places, closed):
    """The cubic spline through these places (N, 3); its parameter is theirs."""
    from scipy.interpolate import make_interp_spline

    if closed:
        places[-1] = places[0]
    spline = make_interp_spline(parameters, places, k=3, bc_type="periodic" if closed else None)
    return SplinePath(spline.t, spline.c, 3, closed)
