"""What a moment looks like to the classifier: its signals and those around it, as one row of numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .signals import Signals

OFFSETS = np.array([-18, -12, -8, -5, -3, -1, 0, 1, 3, 5, 8, 12, 18])
"""Samples (1/30 s) around a moment that its window looks at: close ones near it, 0.6 s to both sides."""

LENGTH = 13 * 80
"""Numbers of a window."""


def windows(signals: Signals) -> np.ndarray:
    """(N, LENGTH) one row a sample; before the first and after the last sample these are held."""
    count = len(signals)
    flat = np.concatenate([part.reshape(count, -1) for part in (signals.middle, signals.paired, signals.trunk)], axis=1)
    around = np.clip(np.arange(count)[:, None] + OFFSETS, 0, count - 1)
    return flat[around].reshape(count, -1)


@dataclass(frozen=True, eq=False)
class Space:
    """Windows reduced to their principal components. mean, scale (LENGTH,): of each number; basis (LENGTH,
    K)."""

    mean: np.ndarray
    scale: np.ndarray
    basis: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, components: int) -> "Space":
        """The space of windows (N, LENGTH), in at most so many components."""
        mean, scale = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-6)
        unit = (rows - mean) / scale
        _, vectors = np.linalg.eigh(unit.T @ unit)
        kept = min(components, len(rows))
        return cls(mean, scale, vectors[:, ::-1][:, :kept].astype(np.float32))

    def within(self, rows: np.ndarray) -> np.ndarray:
        """(N, K) windows (N, LENGTH) in it, of unit variance in all."""
        return (rows - self.mean) / self.scale @ self.basis / np.sqrt(self.basis.shape[0])
