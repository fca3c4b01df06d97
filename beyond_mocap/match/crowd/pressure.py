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
    """The pressures (K,) m of contacts that are known by whole numbers, and the sides (K, 3) to which the one is pushed
    out of the other; 0 for all others."""

    def __init__(self):
        self.keys, self.values, self.sides = np.zeros(0, int), np.zeros(0), np.zeros((0, 3))

    def pushes(self, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What contacts `keys` (K,) have pressed with so far: (K,) m and to which side (K, 3) unit."""
        if not len(self.keys):
            return np.zeros(len(keys)), np.zeros((len(keys), 3))
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[at] == keys, self.values[at], 0.0), self.sides[at]

    def keep(self, keys: np.ndarray, values: np.ndarray, sides: np.ndarray, span: tuple[int, int]) -> None:
        """Contacts `keys` (K,), no number twice, press with `values` (K,) m to the sides (K, 3) from now on; all others
        with numbers from span[0] to below span[1] press no more."""
        order = np.argsort(keys, kind="stable")
        kept = order[values[order] > 0.0]
        low, high = np.searchsorted(self.keys, span)
        for name, new in (("keys", keys), ("values", values), ("sides", sides)):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old[:low], new[kept], old[high:]]))


def pressed(before: np.ndarray, lack: np.ndarray) -> np.ndarray:
    """(K,) m that contacts press with which pressed with `before` (K,) m and lack `lack` (K,) m of distance."""
    return np.clip(before + STEP * lack, 0.0, MOST)
