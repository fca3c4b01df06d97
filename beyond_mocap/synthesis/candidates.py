"""The cheapest of many pairs of a rate and a library frame, without weighing them all.

Pairs lie in the order of their speeds, and each costs at least the speed that it misses. What every eighth of them
costs tells how dear the cheapest are at most, and so how far from the asked speed they can lie.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_SAMPLED = 8
# as many pairs as are wanted lie below the cost below which this many times their share of the sample lies
_ABOVE = 1.25
_ROUNDING = 1e-3


def cheapest(
    cost_of: Callable[[slice], np.ndarray], speeds: np.ndarray, speed: float, weight: float, looked_at: int, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The `count` cheapest of the `looked_at` pairs nearest to a speed in m/s: their numbers (k,), ascending, and costs
    (k,).

    speeds (K,) m/s of the pairs, ascending; weight: what a metre per second of missed speed costs each pair at least;
    cost_of: (n,) costs of a part of the pairs.
    """
    near = _nearest(speeds, speed, looked_at)
    part, cost = _promising(cost_of, speeds, speed, weight, near, count)
    best = np.sort(np.argpartition(cost, count)[:count]) if len(cost) > count else np.arange(len(cost))
    return part.start + best, cost[best]


def _nearest(speeds: np.ndarray, speed: float, count: int) -> slice:
    middle = int(np.searchsorted(speeds, speed))
    low = int(np.clip(middle - count // 2, 0, max(0, len(speeds) - count)))
    return slice(low, min(low + count, len(speeds)))


def _promising(cost_of, speeds: np.ndarray, speed: float, weight: float, near: slice, count: int):
    """The part of `near` that holds the `count` cheapest pairs, and what its pairs cost; all of `near` where it is
    small or the sample deceives."""
    rank = int(_ABOVE * count / _SAMPLED)
    if near.stop - near.start > 4 * _SAMPLED * rank and weight > 0.0:
        most = np.partition(cost_of(slice(near.start, near.stop, _SAMPLED)), rank)[rank]
        reach = float(most) / weight + _ROUNDING
        low, high = np.searchsorted(speeds, [speed - reach, speed + reach])
        part = slice(max(int(low), near.start), min(int(high), near.stop))
        cost = cost_of(part)
        if np.count_nonzero(cost <= most) >= count:
            return part, cost
    return near, cost_of(near)
