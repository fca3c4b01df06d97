"""Key poses over time: rows of a table as smooth curves, and how one movement is laid over another."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..base.easing import quintic_step


def keyed(rows, times: np.ndarray) -> np.ndarray:
    """Rows (time, values...) as smooth curves without overshoot (T, values), held before the first and after the
    last."""
    first, last, curve = _curve(tuple(map(tuple, rows)))
    return curve(np.clip(times, first, last))


def keyed_rounded(rows, times: np.ndarray, frames: float) -> np.ndarray:
    """`keyed` without corners in the speed: (T, values) behind a Gaussian of `frames` standard deviation."""
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(keyed(rows, times), frames, axis=0, mode="nearest")


@lru_cache(maxsize=256)
def _curve(rows: tuple) -> tuple[float, float, PchipInterpolator]:
    """First and last time and the curve of a table; kept, as a made movement is planned again and again."""
    table = np.array(rows, dtype=float)
    return table[0, 0], table[-1, 0], PchipInterpolator(table[:, 0], table[:, 1:], axis=0)


def envelope(times: np.ndarray, begin: float, full: float, fade: float, end: float) -> np.ndarray:
    """0 before `begin`, 1 from `full` to `fade`, 0 after `end` (T,)."""
    return quintic_step((times - begin) / (full - begin)) * (1.0 - quintic_step((times - fade) / (end - fade)))


def mixed(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    weight = weight.reshape(weight.shape + (1,) * (a.ndim - 1))
    return a * (1.0 - weight) + b * weight
