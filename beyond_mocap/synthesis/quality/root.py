"""How well the body is where the track says: root and pelvis error, the body's own sway, surge, speeds and coverage.

Everything here is on the ground plane: pelvis (T, 2) and track (T, 2) in metres on the pitch, one row per output frame.
The *root* of `../shared/metrics.md` is the pelvis behind a 1.5 s window, which takes out the sway that a body must
keep; the track goes through the same window.
"""

from __future__ import annotations

import numpy as np

from ...base.time_series import interpolate, time_derivative
from ...base.vectors import unit_vectors
from ...motion.track import Track, zero_phase_hann

ROOT_WINDOW = 1.5  # s
TRAVEL_WINDOW = 1.0  # s
STANDING = 0.5  # m/s: slower counts as standing
SPEED_EDGES = (1.0, 2.0, 3.0, 4.5)  # m/s between the classes of `speed_class`


def track_at(track: Track, at: np.ndarray) -> np.ndarray:
    """The measured track (T, 2) m at the seconds `at` (T,): straight lines between samples, held beyond the ends.

    Not smoothed. Samples that cleaning filled in or replaced as outliers are left out. NaN where none is measured.
    """
    known = track.measured
    if not known.any():
        return np.full((len(at), 2), np.nan)
    return interpolate(at, track.times[known], track.positions[known])


def root_error(pelvis: np.ndarray, track: np.ndarray, fps: float) -> np.ndarray:
    """Distance (T,) m between pelvis (T, 2) and track (T, 2), both through the same zero-phase Hann window of 1.5 s.

    The window is linear, so one pass over the difference is the difference of two passes.
    """
    return np.linalg.norm(zero_phase_hann(pelvis - track, fps, ROOT_WINDOW), axis=-1)


def pelvis_error(pelvis: np.ndarray, track: np.ndarray) -> np.ndarray:
    """Distance (T,) m between pelvis (T, 2) and track (T, 2) as they are, no window."""
    return np.linalg.norm(pelvis - track, axis=-1)


def sway(pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Distance (T,) m of a pelvis (T, 2) from its own 1.5 s Hann path: a recording's own pelvis error."""
    return pelvis_error(pelvis, zero_phase_hann(pelvis, fps, ROOT_WINDOW))


def travel_speed(pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Speed (T,) m/s of a pelvis or track (T, 2) behind a 1 s Hann window: how fast the body gets about."""
    return np.linalg.norm(time_derivative(zero_phase_hann(pelvis, fps, TRAVEL_WINDOW), fps), axis=-1)


def speed_class(speed: np.ndarray) -> np.ndarray:
    """Class 0..4 of speeds (...,) m/s: 0-1, 1-2, 2-3, 3-4.5, above."""
    return np.digitize(speed, SPEED_EDGES)


def surge(pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Pelvis speed along its path minus that speed's 1.5 s Hann: (T, 2) m -> (T,) m/s.

    The path's direction is that of the velocity behind the same window. Its rms guards against buying still feet with a
    surging pelvis.
    """
    speed = time_derivative(pelvis, fps)
    course = zero_phase_hann(speed, fps, ROOT_WINDOW)
    course = unit_vectors(course)
    along = np.sum(speed * course, axis=-1, keepdims=True)
    return (along - zero_phase_hann(along, fps, ROOT_WINDOW))[:, 0]


def class_rms(values: np.ndarray, classes: np.ndarray, least: int = 30) -> np.ndarray:
    """Root mean square (5,) of values (N,) in each speed class (N,); classes with fewer than `least` values take the
    nearest class that has them, NaN where none has."""
    rms = [np.sqrt(np.mean(values[classes == k] ** 2)) if np.sum(classes == k) >= least else np.nan for k in range(5)]
    return nearest_known(np.array(rms))


def nearest_known(values: np.ndarray) -> np.ndarray:
    """Values (K,) with every NaN replaced by the nearest entry that is not NaN (the lower one of two)."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return values
    return np.array([values[known[np.argmin(np.abs(known - k))]] for k in range(len(values))])


def speed_coverage(wanted: np.ndarray, fastest: float, slowest: float, reach=(0.85, 1.15)) -> dict[str, float]:
    """Shares of frames that ask for a speed the library cannot play within the warp limits.

    wanted (T,) m/s; fastest root and slowest gait of the library, m/s. above: wanted > fastest x 1.15; below: wanted <
    slowest x 0.85 and more than standing (0.5 m/s). NaN where the library's speed is not known.
    """
    above = np.mean(wanted > fastest * reach[1]) if np.isfinite(fastest) else np.nan
    below = np.mean((wanted < slowest * reach[0]) & (wanted > STANDING)) if np.isfinite(slowest) else np.nan
    return {"above": float(above), "below": float(below)}
