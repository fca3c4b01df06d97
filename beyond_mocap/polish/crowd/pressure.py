"""What the contacts of two bodies press with, kept from round to round.

Bodies come apart to where contacts are no longer found, and would fall back into each other in the next round. So a
contact goes on pressing until nothing falls back on it: with a lack d of distance (negative where there is room), a
round turns its pressure p into max(0, p + STEP d), and asks for d + p (the method of multipliers for inequalities:
Bertsekas 1982, Constrained Optimization and Lagrange Multiplier Methods, ch. 3).
"""

from __future__ import annotations

import numpy as np

STEP = 0.2
"""Share of what lacks that a contact presses with from then on."""

MOST = 0.5
"""Metres that a contact presses with at most: bodies that cannot get apart are not thrown about."""


class Pressure:
    """The pressures (K,) m of contacts at frames (K,) that are known by whole numbers; 0 for all others."""

    def __init__(self):
        self.keys, self.values = np.zeros(0, int), np.zeros(0)

    def after(self, keys: np.ndarray, lack: np.ndarray, span: tuple[int, int]) -> np.ndarray:
        """(K,) m that contacts `keys` (K,), no number twice, press with when `lack` (K,) m is missing there; all others
        with numbers from span[0] to below span[1] press no more."""
        order = np.argsort(keys, kind="stable")
        at = np.minimum(np.searchsorted(self.keys, keys), max(len(self.keys) - 1, 0))
        before = np.where(self.keys[at] == keys, self.values[at], 0.0) if len(self.keys) else np.zeros(len(keys))
        now = np.clip(before + STEP * lack, 0.0, MOST)
        kept = order[now[order] > 0.0]
        low, high = np.searchsorted(self.keys, span)
        self.keys = np.concatenate([self.keys[:low], keys[kept], self.keys[high:]])
        self.values = np.concatenate([self.values[:low], now[kept], self.values[high:]])
        return now
