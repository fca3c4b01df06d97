"""How far generated hands and feet are from their wanted trajectories (Fredriksson §4.5 eq. 4.1)."""

from __future__ import annotations

import numpy as np

LOST = 0.5
"""m: a motion with a hand or foot farther off than that, on average, has lost its body; no mean says anything of it."""


def deviations(generated: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(4,) m of one motion: mean distance over its frames; both (T, 4, 3) m in one frame of reference, the effectors
    in the order left hand, right hand, left foot, right foot."""
    return np.linalg.norm(np.asarray(generated, float) - np.asarray(wanted, float), axis=-1).mean(axis=0)


def lost_ones(deviations: np.ndarray) -> np.ndarray:
    """(N,) bool: which motions of deviations (N, 4) m lost their body."""
    deviations = np.asarray(deviations, float).reshape(-1, 4)
    return ~np.all(deviations < LOST, axis=-1)
