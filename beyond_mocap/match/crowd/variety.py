"""Neighbours who do not show the same clip in step: which lag each player likes, and who is in step all the same."""

from __future__ import annotations

import numpy as np

from ...synthesis.search.preferences import PERIOD

NEAR = 10.0
"""Metres between two players within which the same clip in step is seen."""

PHASE = 0.15
"""Seconds between the places in a clip within which two players are in step."""

APART = 0.3
"""Seconds between the lags of two players who come near each other."""

BESIDE = 0.3
"""How much somebody near who has the next lag counts against one who has the same."""

SWEEPS = 6
"""Times that everybody chooses, knowing what all others have chosen."""


def lags(positions: np.ndarray) -> np.ndarray:
    """(P,) s: the lag that each player is to like (`Plan.lag`), so that those who are much near each other have others.

    positions (P, N, 2) m at evenly spaced times, NaN where somebody is not there; a sample or a few a second will do.
    There are PERIOD / APART lags. Whoever is near others most chooses first, and each takes the lag which, with those
    beside it, those have near whom he is least; then they choose again."""
    count = round(PERIOD / APART)
    near = np.zeros((len(positions), len(positions)))
    for one, place in enumerate(positions):
        near[one] = (np.linalg.norm(positions - place, axis=-1) < NEAR).mean(axis=-1)
    np.fill_diagonal(near, 0.0)
    chosen = np.full(len(positions), -1)
    order = np.argsort(-near.sum(axis=1), kind="stable")
    for one in np.tile(order, SWEEPS):
        chosen[one] = -1
        taken = np.array([near[one, chosen == number].sum() for number in range(count)])
        chosen[one] = int(np.argmin(taken + BESIDE * (np.roll(taken, 1) + np.roll(taken, -1))))
    return chosen * APART


def in_step(shown: np.ndarray, seconds: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(P, T) bool: who shows at which time the same clip as somebody within NEAR metres, within PHASE seconds of it.

    shown (P, T) int: which clip, a mirrored one being another, -1 where somebody is not there; seconds (P, T) of its
    own clock; positions (P, T, 2) m, of P players at T common times."""
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
