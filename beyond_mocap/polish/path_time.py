"""When a rider is where on its new path, and which frame of its motion it shows there.

By arc length (Path editing §3.2) the new path is passed as fast as the motion passed its own; by time (figure 3.8) each
path is passed within the same time, however long it is. A speed factor plays the motion faster or slower; the frames shown
then lie between recorded ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion import quaternion
from ..motion.arc_length import ArcLength
from ..motion.path import Path
from .path_frame import Residuals


@dataclass(frozen=True, eq=False)
class Timing:
    """N output frames: at (N,) the row of the residuals that is shown, fractional; arc (N,) m of the new path."""

    at: np.ndarray
    arc: np.ndarray

    def first(self, count: int) -> Timing:
        """Its first `count` frames."""
        return Timing(self.at[:count], self.arc[:count])


def by_arc_length(residuals: Residuals, speed: float, delay: float) -> Timing:
    """The motion `speed` times as fast as it was recorded, `delay` seconds later; it waits in its first frame."""
    at = _played(len(residuals), speed, delay, residuals.fps)
    return Timing(at, np.interp(at, np.arange(len(residuals)), np.cumsum(residuals.step)))


def by_time(residuals: Residuals, path: Path, arc: ArcLength, speed: float, delay: float) -> Timing:
    """The same on a path whose parameter runs with time, from end to end within the motion."""
    at = _played(len(residuals), speed, delay, residuals.fps)
    return Timing(at, arc.at(parameter_at(path, at / max(len(residuals) - 1, 1))))


def parameter_at(path: Path, share: np.ndarray) -> np.ndarray:
    """The path's parameters (N,) when a share (N,) of the time is over."""
    low, high = path.domain
    return low + (high - low) * share


def shown(residuals: Residuals, at: np.ndarray) -> Residuals:
    """The residuals at rows `at` (N,), fractional: places linear, rotations slerped; what is of one frame alone, feet
    that stand, from the nearest. Steps and turns are those from one output frame to the next."""
    count = len(residuals)
    low = np.clip(np.floor(at + 1e-9).astype(int), 0, count - 1)
    share = np.clip(at - low, 0.0, 1.0)
    share[share < 1e-9] = 0.0
    if not share.any():
        whole = residuals.rows(low)
        return whole if np.all(np.diff(low) == 1) else _stepped(residuals, whole, at)
    high = np.minimum(low + 1, count - 1)
    first, second = residuals.rows(low), residuals.rows(high)
    near = residuals.rows(np.where(share < 0.5, low, high))

    def mixed(name: str) -> np.ndarray:
        a, b = getattr(first, name), getattr(second, name)
        return a + (b - a) * share.reshape(-1, *[1] * (a.ndim - 1))

    rotations = quaternion.slerp(first.rotations, second.rotations, share[:, None])
    out = {name: mixed(name) for name in ("place", "frames", "under", "up")}
    return _stepped(residuals, near.changed(rotations=rotations, **out), at)


def _stepped(residuals: Residuals, rows: Residuals, at: np.ndarray) -> Residuals:
    index = np.arange(len(residuals))

    def since(values: np.ndarray) -> np.ndarray:
        return np.diff(np.interp(at, index, np.cumsum(values)), prepend=0.0)

    return rows.changed(step=since(residuals.step), turn=since(residuals.turn))


def _played(count: int, speed: float, delay: float, fps: float) -> np.ndarray:
    last = int(np.floor((count - 1) / speed + 1e-6))
    waits = int(round(delay * fps))
    return np.concatenate([np.zeros(waits), np.arange(last + 1) * speed])
