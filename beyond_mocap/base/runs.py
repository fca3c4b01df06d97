"""Runs: the unbroken stretches in which something holds or stays the same."""

from __future__ import annotations

import numpy as np


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
