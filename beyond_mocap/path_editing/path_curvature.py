"""Where a path bends more tightly, or climbs more steeply, than feet can follow: nobody is planted there, and it is
told."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import minimum_filter1d

from ..base.errors import TimedLine
from ..base.time_series import hann_smooth, runs
from ..base.vectors import arctan2, cross_level
from ..motion.path.path import Path

TIGHT = 0.3
"""Metres of radius, about a foot's length, below which a bend is too tight to walk on."""

STEEP = 60.0
"""Degrees from which on a path is no ground."""

LASTING = 0.5
"""Metres of path, within a metre, that have to be so: a single corner is only a corner."""

_JOINED = 0.5  # seconds between two such stretches that are one
_FADE = 0.12  # seconds, twice of which go by from feet that are planted to feet that are not
_AS_OWN = 1.5  # times the own path's curvature up to which a bend is the motion's own


def tight(path: Path, at: np.ndarray, arc: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray:
    """(T,) bool: frames within a tight stretch. at (T,): the path's parameters, arc (T,) m passed until then, own (T,)
    1/m: how much the motion's own path bends there: what it could do it still can."""
    bend = curvature(path, at)
    return _lasting((bend > 1.0 / TIGHT) & (bend > _AS_OWN * own), arc, fps)


def steep(tangent: np.ndarray, arc: np.ndarray, own: np.ndarray, fps: float) -> np.ndarray:
    """(T,) bool: frames within a steep stretch; tangent (T, 3) of any length, own (T,) radians the slope of the
    motion's own path."""
    slope = arctan2(np.abs(tangent[:, 2]), np.linalg.norm(tangent[:, :2], axis=1))
    return _lasting((slope > np.radians(STEEP)) & (slope > _AS_OWN * np.abs(own)), arc, fps)


def curvature(path: Path, at: np.ndarray) -> np.ndarray:
    """(T,) 1/m: how much a path bends over the ground at parameters `at` (T,)."""
    first, second = path.at(at, 1)[:, :2], path.at(at, 2)[:, :2]
    return np.abs(cross_level(first, second)) / np.maximum(np.linalg.norm(first, axis=1), 1e-6) ** 3


def share(free: np.ndarray, fps: float) -> np.ndarray:
    """(T,) from 0 to 1: how far within the stretches `free` (T,) bool a frame is, smoothly from their borders on."""
    wide = int(round(_FADE * fps))
    inner = minimum_filter1d(free.astype(float), 2 * wide + 1, mode="nearest")
    return hann_smooth(inner, wide)


def told(tight: np.ndarray, steep: np.ndarray, fps: float) -> tuple[TimedLine, ...]:
    """One line for each kind of stretch, with its seconds; tight and steep (T,) bool."""
    lines = []
    for which, what in (
        (tight, f"the path bends more tightly than {TIGHT:g} m radius"),
        (steep, f"the path is steeper than {STEEP:g} degrees"),
    ):
        spans = [(first / fps, (end - 1) / fps) for first, end in runs(which)]
        if spans:
            more = f" and {len(spans) - 1} times more" if len(spans) > 1 else ""
            when = f"from {spans[0][0]:.1f} s to {spans[0][1]:.1f} s{more}"
            lines.append(TimedLine(f"{what} {when}: feet are not planted there; smooth the path", *spans))
    return tuple(lines)


def _lasting(bad: np.ndarray, arc: np.ndarray, fps: float) -> np.ndarray:
    """`bad` (T,) where it goes on for LASTING metres within the metre around it."""
    if not bad.any():
        return bad
    step = np.abs(np.diff(arc, prepend=arc[:1]))
    way, passed = np.cumsum(step * bad), np.cumsum(step)
    first = np.clip(passed - 0.5, 0.0, max(passed[-1] - 1.0, 0.0))
    within = np.interp(first + 1.0, passed, way) - np.interp(first, passed, way)
    return _joined(within >= LASTING, fps)


def _joined(which: np.ndarray, fps: float) -> np.ndarray:
    """`which` (T,) with gaps of at most _JOINED seconds between two true ones filled."""
    out, gap = which.copy(), int(_JOINED * fps)
    spans = runs(which)
    for (_, end), (first, _) in zip(spans[:-1], spans[1:]):
        if first - end <= gap:
            out[end:first] = True
    return out
