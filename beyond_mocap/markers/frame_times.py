"""When a trial's frames were really taken: some systems expose at whole milliseconds and write the nominal rate.

At 360 Hz the steps then are 3, 3, 3, 2, 3, 3, 3, 3, 2 ms instead of 2.78, and every marker of the body seems 28 %
slower in one frame of four or five and 8 % faster in the others. No filter of one marker tells this from movement; all
markers together do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .trial import MarkerTrial

TICK = 1e-3
"""Seconds: the clock that the exposures are bound to."""
_SMOOTH = 19  # frames over which a marker's step is smoothed, several times the pattern's length
_LEAST_ALIKE = 0.8  # correlation of the markers' common unsteadiness with the clock's
_PHASES = 36


def frame_times(trial: MarkerTrial) -> np.ndarray | None:
    """Seconds (T,) on the trial's clock at which the frames were taken, or None where they stand evenly.

    The steps of all markers, each against its own smooth course, give one common unsteadiness per frame; it is compared
    with the one that a clock of whole milliseconds would make, at every phase, and believed where both correlate by
    more than 0.8.
    """
    step = 1.0 / (trial.fps * TICK)
    if abs(step - round(step)) < 1e-3 or step < 1.5 or len(trial) < 3 * _SMOOTH:
        return None
    common, weight = _common_unsteadiness(trial.positions)
    if not np.sum(weight * common**2) > 0.0:
        return None
    best, found = _LEAST_ALIKE, None
    for phase in np.arange(_PHASES) / _PHASES:
        ticks = np.floor(np.arange(len(trial)) * step + phase + 1e-9)
        jitter = np.diff(ticks) / step - 1.0
        size = np.sqrt(np.sum(weight * common**2) * np.sum(weight * jitter**2))
        alike = np.sum(weight * common * jitter) / max(size, 1e-300)
        if alike > best:
            best, found = alike, ticks
    if found is None:
        return None
    times = found * TICK
    return trial.start + times - np.mean(times - np.arange(len(trial)) / trial.fps)


def evenly(trial: MarkerTrial) -> MarkerTrial:
    """The trial as it would be with evenly spaced frames; itself where it has them. What is not seen stays so."""
    times = frame_times(trial)
    if times is None:
        return trial
    note = f"the frames were taken at whole milliseconds, not every {1000.0 / trial.fps:.2f} ms: put at even times"
    return replace(trial, positions=_at_even_times(trial, times), notes=(*trial.notes, note))


def _common_unsteadiness(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By what share (T-1,) the steps of all markers are longer than their smooth course, and how much it weighs."""
    from scipy.signal import savgol_filter

    steps = np.diff(positions, axis=0)
    known = np.isfinite(steps).all(axis=-1)
    filled = np.where(known[..., None], steps, 0.0)
    smooth = savgol_filter(filled, _SMOOTH, 3, axis=0)
    gap = np.apply_along_axis(np.convolve, 0, ~known, np.ones(_SMOOTH), "same") > 0.5
    smooth[gap] = 0.0
    weight = np.einsum("tmc,tmc->t", smooth, smooth)
    shared = np.einsum("tmc,tmc->t", filled - smooth, smooth)
    return np.where(weight > 0.0, shared / np.maximum(weight, 1e-300), 0.0), weight


def _at_even_times(trial: MarkerTrial, times: np.ndarray) -> np.ndarray:
    """(T, M, 3) m by cubic splines through what is seen, one for all markers that are seen in the same frames."""
    from scipy.interpolate import CubicSpline

    out = np.array(trial.positions)
    patterns, which = np.unique(trial.seen, axis=1, return_inverse=True)
    for number, seen in enumerate(patterns.T):
        if np.count_nonzero(seen) < 4:
            continue
        markers = np.flatnonzero(which.ravel() == number)
        course = CubicSpline(times[seen], trial.positions[seen][:, markers])
        at = np.clip(trial.seconds[seen], times[seen][0], times[seen][-1])
        out[np.ix_(seen, markers)] = course(at)
    return out
