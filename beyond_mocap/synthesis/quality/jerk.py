"""How hard a seam hits: the third difference around it against what uncut recordings of the same speed show.

Jerk index t stands for frames t .. t+3, so its middle is frame t + 1.5. A seam at frame s (the first of the new piece)
has its middle at s - 0.5; its window of +-8 frames is jerk indices s-10 .. s+6.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from .root import nearest_known, speed_class

REACH = 8
_WIDTH = 2 * REACH + 1
SEAM_TO_JERK = 2


def jerk(positions: np.ndarray, fps: float) -> np.ndarray:
    """Largest third difference of any joint: positions (T, J, 3) m -> (T-3,) m/s^3, empty for fewer than four
    frames."""
    if len(positions) < 4:
        return np.zeros(0)
    third = positions[3:] - positions[:-3] + 3.0 * (positions[1:-2] - positions[2:-1])
    return np.sqrt(np.max(np.sum(third**2, axis=-1), axis=-1)) * fps**3


def windowed(values: np.ndarray) -> np.ndarray:
    """Largest value within +-8 indices: (N,) -> (N,); windows end with the values."""
    return maximum_filter1d(values, _WIDTH, mode="nearest") if len(values) else values


def uncut_windows(values: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Windowed maxima of an uncut clip where the whole window lies inside it, and the speed in their middle.

    values (T-3,) m/s^3 of `jerk`, speed (T,) m/s -> (M,), (M,) with M = T - 19, or none in a short clip.
    """
    if len(values) < _WIDTH:
        return np.zeros(0), np.zeros(0)
    whole = slice(REACH, len(values) - REACH)
    return windowed(values)[whole], speed[SEAM_TO_JERK:][whole]


def real_p95(windows: np.ndarray, speed: np.ndarray, least: int = 30) -> np.ndarray:
    """95th percentile (5,) m/s^3 of uncut windows (M,) in each speed class of speed (M,) m/s.

    A class with fewer than `least` windows takes the nearest class that has them (runs above 4.5 m/s are rare); NaN
    where none has.
    """
    classes = speed_class(speed)
    values = [windows[classes == k] for k in range(5)]
    return nearest_known(np.array([np.percentile(v, 95) if len(v) >= least else np.nan for v in values]))


def seam_ratios(values: np.ndarray, seams: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Windowed jerk at each seam over the real p95 at that speed: (S,).

    values (T-3,) m/s^3; seams (S,) frames; speed (T,) m/s; real (5,) m/s^3 of `real_p95`.
    """
    if not len(values) or not len(seams):
        return np.zeros(0)
    middle = np.clip(seams - SEAM_TO_JERK, 0, len(values) - 1)
    return windowed(values)[middle] / real[speed_class(speed[seams])]


def ratios(values: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Windowed jerk over the real p95 at that speed, in the middle of every window: (T-3,); see `seam_ratios`."""
    pace = speed[SEAM_TO_JERK : SEAM_TO_JERK + len(values)]
    return windowed(values) / real[speed_class(pace)]


def rest_ratios(values: np.ndarray, seams: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """The same ratio in the middle of every window that touches no seam's window: (M,). A locked knee can pop
    anywhere."""
    if not len(values):
        return np.zeros(0)
    free = np.ones(len(values), dtype=bool)
    for seam in seams - SEAM_TO_JERK:
        free[max(seam - 2 * REACH, 0) : seam + 2 * REACH + 1] = False
    return ratios(values, speed, real)[free]
