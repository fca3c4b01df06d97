"""The cheapest sequence through slots by dynamic programming (Faustino eq. 14, 15). It takes costs and knows no
motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np


def cheapest_path(
    unary: Sequence[np.ndarray], transition: Callable[[int], np.ndarray]
) -> tuple[np.ndarray, float]:
    """One choice per slot so that unary plus transition costs are least.

    unary: S arrays (K_s,), the cost of each choice of a slot; np.inf forbids. transition(s): (K_s, K_{s+1}), the cost
    of each choice of slot s + 1 after each of slot s. Returns the choices (S,) and the total cost. Ties go to the
    first.

        cheapest_path([np.array([0, 1.0]), np.array([5.0, 0])], lambda s: np.zeros((2, 2)))   # -> [0, 1], 0.0
    """
    total = np.asarray(unary[0], dtype=float)
    back: list[np.ndarray] = []
    for slot in range(1, len(unary)):
        through = total[:, None] + transition(slot - 1)
        before = np.argmin(through, axis=0)
        back.append(before)
        total = through[before, np.arange(through.shape[1])] + unary[slot]
    choice = np.empty(len(unary), dtype=int)
    choice[-1] = int(np.argmin(total))
    for slot in range(len(unary) - 1, 0, -1):
        choice[slot - 1] = back[slot - 1][choice[slot]]
    return choice, float(total[choice[-1]])
