"""The cheapest way from the states of one slot to the frames that the next one is offered.

A beam keeps a few dozen of the hundred thousand pairs of a state and an offered frame. The change of pose, which bounds
what a pair costs from below, is worked out for all of them at once; feet, replayed stretches and rates only for pairs
that may still be kept. What is kept is what weighing every pair would keep.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

_SAME = 0.05  # library frames between two that are one but for rounding


@dataclass(frozen=True, eq=False)
class Offered:
    """K frames to come to: clip (K,), fractional library frame start (K,), rate (K,) and cost (K,) of what is shown
    from there on; piece (K,) of a key moment that begins there, or -1."""

    clip: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    cost: np.ndarray
    piece: np.ndarray

    def only(self, which: np.ndarray) -> "Offered":
        """The frames `which`, by index."""
        return Offered(*(getattr(self, field.name)[which] for field in fields(self)))


class Ways:
    """All ways on from B states: clip (B,) that each shows, library frame end (B,) at which it ends, rate (B,), cost
    (B,) so far, seen (B, buckets) bool what it has lately shown.

    A way costs a cut, unless the clip shows that frame next anyway, and the change of rate; `costs` are a search's
    `PathCosts`. Costs are float32 above `base`, that of the cheapest state, so that they stay exact in long searches.
    """

    def __init__(self, costs, clip: np.ndarray, end: np.ndarray, rate: np.ndarray, cost: np.ndarray, seen: np.ndarray):
        self.costs, self.clip, self.end, self.seen = costs, clip, end, seen
        self.rate = rate.astype(np.float32)
        self.base = float(cost.min())
        self.above = (cost - self.base).astype(np.float32)

    def every(self, to: Offered) -> np.ndarray:
        """(B, K) cost of each way, that of what is shown behind it counted."""
        least = self._least(to)
        pairs = np.arange(least.size)
        return self.base + self._whole(to, least, pairs).reshape(least.shape).T.astype(float)

    def cheapest(self, to: Offered, known: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The cheapest way to each frame: numbers of the frames (k,), costs (k,), states by which one comes (k,).

        Of frames that begin no piece those are left out that cannot be among the `most` cheapest of them and of `known`
        (L,) costs of other ways to fill the slot."""
        most_above = np.partition(known, most - 1)[most - 1] - self.base if len(known) >= most else np.inf
        near = np.flatnonzero((to.piece >= 0) | (to.cost <= most_above))
        to = to.only(near)
        least = self._least(to)
        count = least.shape[1]
        first = np.arange(len(least)) * count + np.argmin(least, axis=1)
        bound = self._whole(to, least, first)
        free = to.piece < 0
        rivals = np.concatenate([bound[free], known - self.base])
        if len(rivals) > most:
            bound[free] = np.minimum(bound[free], np.partition(rivals, most - 1)[most - 1])
        pairs = np.flatnonzero(least <= bound[:, None])
        offer = pairs // count
        cost = self._whole(to, least, pairs)
        begins = np.flatnonzero(np.diff(offer, prepend=-1))
        at = _cheapest_of_each(cost, begins)
        at = at[cost[at] <= bound[offer[at]]]
        return near[offer[at]], self.base + cost[at].astype(float), pairs[at] % count

    def _least(self, to: Offered) -> np.ndarray:
        """(K, B) float32 above the base: what each way costs at least."""
        costs = self.costs
        end, start = costs.inside(self.end), costs.inside(to.start)
        least = costs.apart(start, end)
        leave, enter = costs.left_and_entered(end, start)
        cost = to.cost.astype(np.float32)
        least += (enter + cost)[:, None]
        least += leave + self.above
        offer, state = self._meeting(to)
        least[offer, state] = self.above[state] + cost[offer]
        return least

    def _whole(self, to: Offered, least: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """(P,) float32 above the base: the whole cost of `pairs` (P,), flat indices into `least`."""
        costs, weights = self.costs, self.costs.weights
        offer, state = np.divmod(pairs, least.shape[1])
        start, end = to.start[offer], self.end[state]
        frame = costs.inside(start)
        cut = np.float32(weights.feet) * costs.feet_apart(costs.inside(end), frame)
        cut += np.float32(weights.replay) * self.seen[state, costs.offer.bucket[frame]]
        cut[_same(start, end) & (to.clip[offer] == self.clip[state])] = 0.0
        rate = np.float32(weights.rate_change) * np.abs(to.rate.astype(np.float32)[offer] - self.rate[state])
        return least.ravel()[pairs] + cut + rate

    def _meeting(self, to: Offered) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of the frames (M,) and states (M,) of all pairs that go on without a cut."""
        order = np.argsort(self.end, kind="stable")
        low, high = (np.searchsorted(self.end[order], to.start + off) for off in (-_SAME, _SAME))
        offer = np.flatnonzero(high > low)
        many = high[offer] - low[offer]
        at = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many - low[offer], many)
        offer, state = np.repeat(offer, many), order[at]
        meets = _same(to.start[offer], self.end[state]) & (to.clip[offer] == self.clip[state])
        return offer[meets], state[meets]


def _same(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(P,) bool: whether library frames are one but for rounding."""
    return np.abs(start - end) < _SAME


def _cheapest_of_each(cost: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(k,) index of the first cheapest of each run of `cost` (P,), where runs begin at `begins` (k,)."""
    if not len(begins):
        return begins
    best = np.minimum.reduceat(cost, begins)
    equal = np.flatnonzero(cost == np.repeat(best, np.diff(np.append(begins, len(cost)))))
    run = np.searchsorted(begins, equal, side="right")
    return equal[np.diff(run, prepend=0) > 0]
