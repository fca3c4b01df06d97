"""In which order a training sees its examples: stretches of some frames, shuffled anew in each epoch."""

from __future__ import annotations

import numpy as np


def stretches(lengths, frames: int, seed: int, epoch: int) -> np.ndarray:
    """Stretches (N, 2) of `frames` steps, (example, first frame), shuffled.

    lengths: frames of each example. Stretches lie end to end from a random frame on, so that within an epoch nearly
    every frame is predicted once; examples too short for one are left out. Seed and epoch alone decide.
    """
    rng = np.random.default_rng([seed, epoch])
    rows = []
    for example, length in enumerate(lengths):
        steps = length - 1
        if steps < frames:
            continue
        first = int(rng.integers(0, min(frames, steps - frames + 1)))
        starts = np.arange(first, steps - frames + 1, frames)
        rows.append(np.stack([np.full_like(starts, example), starts], axis=1))
    rows = np.concatenate(rows) if rows else np.zeros((0, 2), int)
    return rows[rng.permutation(len(rows))]


def batches(rows: np.ndarray, size: int) -> np.ndarray:
    """Rows (N, ...) as whole batches (B, size, ...); the last is filled up from the beginning."""
    count = max(1, -(-len(rows) // size))
    return rows[np.arange(count * size) % len(rows)].reshape(count, size, *rows.shape[1:])
