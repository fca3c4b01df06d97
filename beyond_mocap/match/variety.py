"""Whether neighbours show the same clip in step."""

from __future__ import annotations

import numpy as np

NEAR = 10.0
"""Metres between two players within which the same clip in step is seen."""

PHASE = 0.15
"""Seconds between the places in a clip within which two players are in step."""


def in_step(shown: np.ndarray, seconds: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(P, T) bool: who shows at which time the same clip as somebody within NEAR metres, within PHASE seconds of it.

    shown (P, T) int: which clip, a mirrored one being another, -1 where somebody is not there; seconds (P, T) of its
    own clock; positions (P, T, 2) m, of P players at T common times.
    """
    found = np.zeros(shown.shape, bool)
    for one in range(len(shown) - 1):
        others = slice(one + 1, None)
        same = (shown[others] == shown[one]) & (shown[one] >= 0) & (np.abs(seconds[others] - seconds[one]) < PHASE)
        near = np.linalg.norm(positions[others] - positions[one], axis=-1) < NEAR
        found[others] |= same & near
        found[one] |= (same & near).any(axis=0)
    return found


def share_in_step(shown: np.ndarray, seconds: np.ndarray, positions: np.ndarray) -> float:
    """Share of the time of all players in which they are in step with a neighbour (`in_step`); 0 where nobody is."""
    there = shown >= 0
    return float(in_step(shown, seconds, positions)[there].mean()) if there.any() else 0.0
