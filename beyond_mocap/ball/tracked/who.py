"""Who touches the ball: how near everybody is to it, and one choice of players over all touches together."""

from __future__ import annotations

import numpy as np

REACH = 0.6  # m from a player's middle at which the ball is played without cost
STRAY = 0.45  # m, by which bodies and tracking go beyond it
HIGHEST = 2.4  # m of the ball's centre, a header without cost
STRANGER = 9.0  # nats for a touch by nobody who is tracked, in a match
ALONE = 4.0  # the same where one player alone is tracked
_RISE = 0.3  # m, by which jumps and heights go beyond HIGHEST
_OTHER = 1.0  # nats for a touch by somebody else than the one before
_FOLLOWED = 1.0  # s, a player who touches twice within this is near the ball meanwhile


def distances(times: np.ndarray, ball: np.ndarray, positions: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(P, K) m over the ground from each player to the ball at moments `at` (K,), inf where a player is not there.

    times: (N,) s; ball: (K, 2) m, where it is then; positions: (P, N, 2) m.
    """
    out = np.full((len(positions), len(at)), np.inf)
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    share = np.clip((at - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)[:, None]
    for player, path in enumerate(positions):
        place = path[after - 1] * (1.0 - share) + path[after] * share
        away = np.linalg.norm(place - ball, axis=1)
        out[player] = np.where(np.isfinite(away), away, np.inf)
    return out


def reach_cost(away: np.ndarray, height: np.ndarray | None, stranger: float = STRANGER) -> np.ndarray:
    """Nats for a player `away` m from the ball (over the ground) touching it at `height` m."""
    cost = 0.5 * (np.maximum(away - REACH, 0.0) / STRAY) ** 2
    if height is not None:
        cost = cost + 0.5 * (np.maximum(height - HIGHEST, 0.0) / _RISE) ** 2
    return np.minimum(cost, stranger)


def choose(away: np.ndarray, times: np.ndarray, between: np.ndarray, stranger: float = STRANGER) -> np.ndarray:
    """(K,) the player of every touch, -1 for nobody: the cheapest chain by dynamic programming over the touches.

    away: (P, K) m. times: (K,) s. between: (P, K) m, a player's mean distance from the ball since the touch before.
    """
    players, count = away.shape
    if not count:
        return np.zeros(0, int)
    own = np.full((players + 1, count), stranger)
    own[:players] = 0.5 * (np.maximum(away - REACH, 0.0) / STRAY) ** 2 + away / STRAY
    back = np.zeros((players + 1, count), int)
    best = own[:, 0]
    for touch in range(1, count):
        stays = best.copy()
        if times[touch] - times[touch - 1] < _FOLLOWED:
            stays[:players] += 0.5 * np.maximum(between[:, touch] - 2.0 * REACH, 0.0) ** 2
        other = best.min() + _OTHER
        back[:, touch] = np.where(stays <= other, np.arange(players + 1), best.argmin())
        best = np.minimum(stays, other) + own[:, touch]
    who = np.zeros(count, int)
    who[-1] = best.argmin()
    for touch in range(count - 1, 0, -1):
        who[touch - 1] = back[who[touch], touch]
    return np.where(who == players, -1, who)
