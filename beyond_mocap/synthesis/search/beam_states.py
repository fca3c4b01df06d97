"""What a path search keeps of each slot: the ways to fill it that are worth to be continued."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MEMORY_SLOTS = 15
"""Slots whose buckets a state remembers (4 s at 30 frames per second)."""


@dataclass(frozen=True, eq=False)
class BeamStates:
    """B ways to fill a slot.

    Attributes:
        clip: (B,) clip index.
        start: (B,) fractional library frame.
        rate: (B,) playback rate.
        cost: (B,) of the best sequence that ends here.
        back: (B,) state of the slot before.
        piece: (B,) of a key moment, or -1.
        recent: (B, M) buckets shown lately.
        age: (B,) slots since the last cut.
    """

    clip: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    cost: np.ndarray
    back: np.ndarray
    piece: np.ndarray
    recent: np.ndarray
    age: np.ndarray
