"""jax.numpy for the features: picking joints by slices. A gather has a scatter as its derivative, which costs more than
the networks themselves on a processor."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np


class _Arrays:
    """`jax.numpy`, but for `take`."""

    def __getattr__(self, name: str):
        return getattr(jnp, name)

    @staticmethod
    def take(values, indices: np.ndarray, axis: int):
        """`values` at fixed `indices` along an axis: runs of neighbours are sliced and put together."""
        axis = axis % values.ndim
        indices = [int(index) for index in indices]
        starts = [i for i, index in enumerate(indices) if i == 0 or index != indices[i - 1] + 1]
        runs = [indices[first:last] for first, last in zip(starts, [*starts[1:], len(indices)])]
        return jnp.concatenate([jax.lax.slice_in_dim(values, r[0], r[-1] + 1, axis=axis) for r in runs], axis)


ARRAYS = _Arrays()
"""The array module that training gives to everything that takes one (`xp`)."""
