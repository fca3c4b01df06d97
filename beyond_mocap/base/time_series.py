"""Values over frames: derivatives, smoothing with constant ends, interpolation, and runs of equal values."""

from __future__ import annotations

import numpy as np


def time_derivative(values: np.ndarray, fps: float) -> np.ndarray:
    """Compute central differences over time, one-sided at the ends; zero for a single frame.

    Args:
        values: (T, ...), any unit.
        fps: frames per second.
    Returns:
        (T, ...), that unit per second.
    """
    return np.gradient(values, axis=0) * fps if len(values) > 1 else np.zeros_like(values)


def gaussian_smooth(values: np.ndarray, width: float) -> np.ndarray:
    """Smooth values with a Gaussian kernel; the end values are repeated beyond the ends.

    Args:
        values: (T, K), any unit.
        width: standard deviation, frames; below 1/3 nothing changes.
    Returns:
        (T, K), that unit.
    """
    reach = int(3.0 * width)
    if reach < 1 or len(values) < 2:
        return values
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    held = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, bell / bell.sum(), "valid") for column in held.T], axis=1)


def hann_smooth(values: np.ndarray, reach: int) -> np.ndarray:
    """Smooth values with a Hann window; the end values are repeated beyond the ends.

    Args:
        values: (T,), any unit.
        reach: frames of the window to either side.
    Returns:
        (T,), that unit.
    """
    window = np.hanning(2 * reach + 3)[1:-1]
    return np.convolve(np.pad(values, reach, mode="edge"), window / window.sum(), mode="valid")


def compute_running_maximum(values: np.ndarray, before: int, after: int) -> np.ndarray:
    """Compute the largest value around each frame; windows end with the values.

    Args:
        values: (T,) numbers or bool.
        before, after: frames of the window before and after each frame.
    Returns:
        (T,), the same unit and type.
    """
    if not len(values):
        return values
    largest, span, width = np.pad(values, (before, after), mode="edge"), 1, before + after + 1
    while 2 * span <= width:  # largest[i] is that of the frames i to i + span - 1
        largest, span = np.maximum(largest[:-span], largest[span:]), 2 * span
    return np.maximum(largest[: len(values)], largest[width - span :])


def interpolate_columns(
    sample_times: float | np.ndarray, times: np.ndarray, values: np.ndarray, fill_value: float | None = None
) -> np.ndarray:
    """Interpolate values linearly at other times.

    Args:
        sample_times: (...), seconds or another clock.
        times: (N,), ascending, on the same clock.
        values: (N, K), any unit.
        fill_value: the value before the first time and after the last; None repeats the end values.
    Returns:
        (..., K), that unit.
    """
    return np.stack([np.interp(sample_times, times, column, fill_value, fill_value) for column in values.T], axis=-1)


def find_runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Find the runs of True.

    Args:
        flags: (T,) bool.
    Returns:
        (first, end) of every run: its first index and the index after its last.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def measure_time_to_nearest(times: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Measure how far (T,) times are from the nearest of (M,) moments, before or after; inf without any.

    Args:
        times: (T,) in any unit.
        moments: (M,) in the same unit, ascending.
    """
    edges = np.concatenate([[-np.inf], moments, [np.inf]])
    number = np.searchsorted(edges, times)
    return np.minimum(edges[number] - times, times - edges[number - 1])


def drop_short_runs(flags: np.ndarray, least: float) -> np.ndarray:
    """Keep the runs of True of flags (T,) that have at least so many frames."""
    kept = np.zeros_like(flags)
    for first, end in find_runs(flags):
        kept[first:end] = end - first >= least
    return kept


def find_equal_runs(values: np.ndarray) -> list[tuple[int, int]]:
    """Find the runs of equal neighbours; each run begins where the previous one ends.

    Args:
        values: (T,), T at least 1.
    Returns:
        (first, end) of every run: its first index and the index after its last.
    """
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values)]
    return list(zip(edges[:-1], edges[1:]))


def number_runs(flags: np.ndarray) -> np.ndarray:
    """Number the runs of True.

    Args:
        flags: (T,) bool.
    Returns:
        (T,) int: a different number above 0 in each run of True, 0 elsewhere.
    """
    return np.cumsum(np.diff(flags, prepend=False)) * flags
