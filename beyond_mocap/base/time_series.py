"""Values over frames: their rate of change, smoothing with held ends, and unbroken runs."""

from __future__ import annotations

import numpy as np


def time_derivative(values: np.ndarray, fps: float) -> np.ndarray:
    """Central differences over time, one-sided at the ends; zero for a single frame.

    Args:
        values: (T, ...), any unit.
        fps: frames per second.
    Returns:
        (T, ...), that unit per second.
    """
    return np.gradient(values, axis=0) * fps if len(values) > 1 else np.zeros_like(values)


def gaussian_smooth(values: np.ndarray, width: float) -> np.ndarray:
    """Values averaged by a Gaussian bell, their ends held.

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
    """Values averaged by a Hann window, their ends held.

    Args:
        values: (T,), any unit.
        reach: frames of the window to either side.
    Returns:
        (T,), that unit.
    """
    window = np.hanning(2 * reach + 3)[1:-1]
    return np.convolve(np.pad(values, reach, mode="edge"), window / window.sum(), mode="valid")


def interpolate(
    at: float | np.ndarray, times: np.ndarray, values: np.ndarray, outside: float | None = None
) -> np.ndarray:
    """Values at other times, linearly between those that are known.

    Args:
        at: (...), s or another clock.
        times: (N,), rising, on the same clock.
        values: (N, K), any unit.
        outside: what stands before the first time and after the last; None holds the values there.
    Returns:
        (..., K), that unit.
    """
    return np.stack([np.interp(at, times, column, outside, outside) for column in values.T], axis=-1)


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """(first, end) of every run of True in `flags` (T,): its first index and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def equal_runs(values: np.ndarray) -> list[tuple[int, int]]:
    """(first, end) of every run of equal neighbours in `values` (T,), T at least 1, one run beginning where another
    ends."""
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values)]
    return list(zip(edges[:-1], edges[1:]))


def run_numbers(flags: np.ndarray) -> np.ndarray:
    """(T,) int: in each run of True in `flags` (T,) bool a number of its own above 0, and 0 elsewhere."""
    return np.cumsum(np.diff(flags, prepend=False)) * flags
