"""Variety among neighbours: choose each player's preferred clip lag, and find players who show the same clip in
step.
"""

from __future__ import annotations

import numpy as np

from ...synthesis.search.preferences import PERIOD

NEAR_DISTANCE = 10.0
"""m between two players within which the same clip in step is noticed."""

PHASE_SECONDS = 0.15
"""s between the times in a clip within which two players are in step."""

LAG_STEP = 0.3
"""s between the lags that can be chosen."""

NEXT_LAG_WEIGHT = 0.3
"""Weight of a neighbour with the next lag, relative to one with the same lag."""

SWEEPS = 6
"""Rounds in which every player chooses, knowing the choice of all others."""


def choose_lags(positions: np.ndarray) -> np.ndarray:
    """Choose each player's preferred lag (`Plan.lag`), so that players who are often near each other differ.

    There are PERIOD / LAG_STEP lags. The player who is near others most chooses first. Each takes the lag whose users,
    and those of the lags next to it, they are near least; then all choose again.

    Args:
        positions: (P, N, 2) m at evenly spaced times, NaN where a player is absent; one or a few samples per second are
            enough.
    Returns:
        (P,) s.
    """
    count = round(PERIOD / LAG_STEP)
    near = np.zeros((len(positions), len(positions)))
    for one, place in enumerate(positions):
        near[one] = (np.linalg.norm(positions - place, axis=-1) < NEAR_DISTANCE).mean(axis=-1)
    np.fill_diagonal(near, 0.0)
    chosen = np.full(len(positions), -1)
    order = np.argsort(-near.sum(axis=1), kind="stable")
    for one in np.tile(order, SWEEPS):
        chosen[one] = -1
        use = np.array([near[one, chosen == number].sum() for number in range(count)])
        chosen[one] = int(np.argmin(use + NEXT_LAG_WEIGHT * (np.roll(use, 1) + np.roll(use, -1))))
    return chosen * LAG_STEP


def find_in_step(clips: np.ndarray, seconds: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Find who shows the same clip as a player within NEAR_DISTANCE, within PHASE_SECONDS of it.

    Args:
        clips: (P, T) int, the clip of each player (a mirrored one is another clip), -1 where absent.
        seconds: (P, T) s on the clip's clock.
        positions: (P, T, 2) m.
    Returns:
        (P, T) bool.
    """
    is_in_step = np.zeros(clips.shape, bool)
    for one in range(len(clips) - 1):
        others = slice(one + 1, None)
        same = (clips[others] == clips[one]) & (clips[one] >= 0) & (np.abs(seconds[others] - seconds[one])
                                                                    < PHASE_SECONDS)
        near = np.linalg.norm(positions[others] - positions[one], axis=-1) < NEAR_DISTANCE
        is_in_step[others] |= same & near
        is_in_step[one] |= (same & near).any(axis=0)
    return is_in_step


def measure_share_in_step(clips: np.ndarray, seconds: np.ndarray, positions: np.ndarray) -> float:
    """Measure the share of the time of all players in which they are in step with a neighbour; 0 if none is present."""
    is_present = clips >= 0
    return float(find_in_step(clips, seconds, positions)[is_present].mean()) if is_present.any() else 0.0
