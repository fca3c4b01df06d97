"""Variety among neighbours: choose each player's preferred clip lag, and find players who show the same clip in
step.
"""

from __future__ import annotations

import numpy as np

from ...synthesis.search.preferences import PERIOD

NEAR = 10.0
"""m between two players within which the same clip in step is noticed."""

PHASE = 0.15
"""s between the times in a clip within which two players are in step."""

APART = 0.3
"""s between the lags that can be chosen."""

BESIDE = 0.3
"""Weight of a neighbour with the next lag, relative to one with the same lag."""

SWEEPS = 6
"""Rounds in which every player chooses, knowing the choice of all others."""


def lags(positions: np.ndarray) -> np.ndarray:
    """Choose each player's preferred lag (`Plan.lag`), so that players who are often near each other differ.

    There are PERIOD / LAG_STEP lags. The player who is near others most chooses first. Each takes the lag whose users,
    and those of the lags next to it, they are near least; then all choose again.

    Args:
        positions: (P, N, 2) m at evenly spaced times, NaN where a player is absent; one or a few samples per second are
            enough.
    Returns:
        (P,) s.
    """
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
    """Find who shows the same clip as a player within NEAR_DISTANCE, within PHASE_SECONDS of it.

    Args:
        clips: (P, T) int, the clip of each player (a mirrored one is another clip), -1 where absent.
        seconds: (P, T) s on the clip's clock.
        positions: (P, T, 2) m.
    Returns:
        (P, T) bool.
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
    """Measure the share of the time of all players in which they are in step with a neighbour; 0 if none is present."""
    there = shown >= 0
    return float(in_step(shown, seconds, positions)[there].mean()) if there.any() else 0.0
