"""The transitions with the lowest cost from the states of one slot to the candidates of the next.

A beam keeps a few dozen of the many thousand pairs of a state and a candidate. The changes of pose and of recording,
which bound the cost of a pair from below, are computed for all of them at once; replayed stretches and playback rates
only for pairs that may still be kept, and feet only for what remains of these. The result is the same as if every pair
were evaluated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

SAME_FRAME = 0.05  # library frames: places closer than this are the same, apart from rounding


@dataclass(frozen=True, eq=False)
class SlotCandidates:
    """K candidates of a slot.

    Attributes:
        clip: (K,) clip index.
        start: (K,) fractional library frame.
        rate: (K,) playback rate.
        cost: (K,) of what is shown from there on.
        piece: (K,) piece of a key moment that begins there, or -1.
    """

    clip: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    cost: np.ndarray
    piece: np.ndarray

    def select(self, which: np.ndarray) -> "SlotCandidates":
        """Select candidates by index."""
        return SlotCandidates(*(values[which] for values in vars(self).values()))


class BeamTransitions:
    """All transitions from B states to the candidates of the next slot.

    A transition costs a cut, unless the clip shows that frame next anyway, and the change of playback rate. Costs are
    float32 above `base`, the cost of the cheapest state, so that they stay exact in long searches.

    Attributes:
        costs: the search's `PathCosts`.
        clip: (B,) clip that each state shows.
        end: (B,) library frame at which it ends.
        left: (B,) the same, whole.
        rate: (B,) playback rate.
        recent: (B, M) buckets of frames that it has shown lately, -1 for none.
        young: (B,) what each state's last cut adds to the next one.
        base: cost of the cheapest state.
        above: (B,) float32, cost above the base.
    """

    def __init__(self, costs, clip: np.ndarray, end: np.ndarray, rate: np.ndarray, cost: np.ndarray, recent: np.ndarray,
                 young: np.ndarray):
        self.costs, self.clip, self.end, self.recent = costs, clip, end, recent
        self.rate = rate.astype(np.float32)
        self.left = costs.index.round_frame(end)
        self.young = young.astype(np.float32)
        self.base = float(cost.min())
        self.above = (cost - self.base).astype(np.float32)

    @cached_property
    def seen_buckets(self) -> np.ndarray:
        """(B, buckets) bool: whether a state has lately shown a bucket of frames or its neighbours."""
        # one bucket more on either side, cut off in the end; -1 (nothing shown) falls into the first of these
        seen = np.zeros((len(self.recent), self.costs.index.bucket[-1] + 3), bool)
        row = np.arange(len(self.recent))[:, None]
        for shift in (0, 1, 2):
            seen[row, np.maximum(self.recent + shift, 0)] = True
        return seen[:, 1:-1]

    def compute_all(self, to: SlotCandidates) -> np.ndarray:
        """Compute the cost (B, K) of each transition, including what the candidate shows."""
        frame = self.costs.index.round_frame(to.start)
        _, least, _ = self._compute_lower_bounds(to, frame, np.float32(np.inf))
        _, cost = self._compute_full_costs(to, frame, least, np.arange(least.size))
        return self.base + cost.reshape(least.shape).T.astype(float)

    def bound_own_cost(self, known: np.ndarray, kept_count: int) -> float:
        """Compute what a candidate that is reached by a cut may cost at most, to be among the `kept_count` cheapest.

        Args:
            known: (L,) costs of other ways to fill the slot.
            kept_count: how many the beam keeps.
        """
        if len(known) < kept_count:
            return np.inf
        limit = np.partition(known, kept_count - 1)[kept_count - 1] - self.base
        return float(limit) - self.costs.weights.switch - float((self.above + self.young).min())

    def find_cheapest(self, to: SlotCandidates, known: np.ndarray, kept_count: int) -> tuple[np.ndarray, np.ndarray,
            np.ndarray]:
        """Find the cheapest transition to each candidate that may be kept.

        Of candidates that begin no piece, those are left out that cannot be among the `kept_count` cheapest of them and
        of `known`.

        Args:
            to: K candidates.
            known: (L,) costs of other ways to fill the slot.
            kept_count: how many the beam keeps.
        Returns:
            Numbers of the candidates (k,), costs (k,), and the states (k,) before them.
        """
        limit = np.partition(known, kept_count - 1)[kept_count - 1] - self.base if len(known) >= kept_count else np.inf
        # drop candidates whose own cost already exceeds the limit set by `known`
        near = np.flatnonzero((to.piece >= 0) | (to.cost <= limit))
        if not len(near):
            return near, np.zeros(0), near
        to, frame = to.select(near), self.costs.index.round_frame(to.start[near])
        rows, least, changed = self._compute_lower_bounds(to, frame, np.float32(limit))
        if not len(rows):
            return rows, np.zeros(0), rows
        near, to, frame, count = near[rows], to.select(rows), frame[rows], least.shape[1]
        # bound[k]: full cost of the pair with the lowest lower bound, so an upper bound of the candidate's cost
        first = np.arange(len(least)) * count + np.argmin(changed, axis=1)
        _, bound = self._compute_full_costs(to, frame, least, first)
        free = to.piece < 0
        # no free candidate above the `kept_count`-th best of all upper bounds can be kept
        rivals = np.concatenate([bound[free], known - self.base])
        if len(rivals) > kept_count:
            bound[free] = np.minimum(bound[free], np.partition(rivals, kept_count - 1)[kept_count - 1])
        # only pairs whose lower bound is within the upper bound are evaluated in full; flat index = candidate * B +
        # state
        pairs, cost = self._compute_full_costs(to, frame, least, np.flatnonzero(changed <= bound[:, None]), most=bound)
        candidate = pairs // count
        # `pairs` is sorted by candidate, so each candidate is one run
        begins = np.flatnonzero(np.diff(candidate, prepend=-1))
        at = _find_cheapest_of_runs(cost, begins)
        at = at[cost[at] <= bound[candidate[at]]]
        return near[candidate[at]], self.base + cost[at].astype(float), pairs[at] % count

    def _compute_lower_bounds(self, to: SlotCandidates, frame: np.ndarray, limit: np.float32
                              ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute lower bounds of the transitions to the candidates that may be kept.

        Args:
            to: K candidates.
            frame: (K,) whole library frames where they begin.
            limit: what a candidate that begins no piece may cost, above the base.
        Returns:
            Numbers of the candidates (k,); lower bounds (k, B) float32, above the base: what each transition costs
            without repetition, rates and feet; and the same with the change of recording.
        """
        cuts, cost = self.costs.cuts, to.cost.astype(np.float32)
        ends, which = self._distinct_ends
        leave, enter = cuts.compute_cut_ends(self.left, frame)
        before = leave + self.young + self.above
        least_before = np.full(len(ends), np.float32(np.inf))
        np.minimum.at(least_before, which, before)
        # a row for each frame at which states end, not for each state, as long as candidates are left out
        posed = cuts.compute_pose_cost(ends, frame)
        posed += enter + cost
        cheapest = (posed + least_before[:, None]).min(axis=0)
        # without a cut nothing but the costs of state and candidate remains
        candidate, state = self._find_uncut_pairs(to)
        uncut = self.above[state] + cost[candidate]
        np.minimum.at(cheapest, candidate, uncut)
        # others cannot be kept: the known ways to fill the slot cost less
        rows = np.flatnonzero((cheapest <= limit) | (to.piece >= 0))
        other = cuts.compute_recording_change(ends[:, None], frame.take(rows))
        lower_bound = posed.take(rows, axis=1).take(which, axis=0)
        lower_bound += before[:, None]
        changed = lower_bound + other.take(which, axis=0)
        at = np.searchsorted(rows, candidate)
        is_left = np.append(rows, -1)[at] == candidate
        at, state = at[is_left], state[is_left]
        lower_bound[state, at] = changed[state, at] = uncut[is_left]
        return rows, np.ascontiguousarray(lower_bound.T), np.ascontiguousarray(changed.T)

    @cached_property
    def _distinct_ends(self) -> tuple[np.ndarray, np.ndarray]:
        """The distinct frames (U,) at which states end, and which of them each state's is, (B,): a beam has few."""
        return np.unique(self.left, return_inverse=True)

    def _compute_full_costs(
        self, to: SlotCandidates, frame: np.ndarray, lower_bound: np.ndarray, pairs: np.ndarray,
        most: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute the full costs of some pairs.

        Args:
            to: K candidates.
            frame: (K,) whole library frames where they begin.
            lower_bound: (K, B) lower bounds.
            pairs: (P,) flat indices into `lower_bound`.
            most: (K,) of each candidate's pairs, those that cost more are left out; None for no limit.
        Returns:
            (p,) flat indices of those that are not left out, and (p,) float32 costs, above the base.
        """
        candidate, state = np.divmod(pairs, lower_bound.shape[1])
        least, rate = lower_bound.ravel().take(pairs), self._compute_rate_changes(to, candidate, state)
        goes_on = self._goes_on(to, candidate, state)
        change, replay = self._compute_repetition(frame.take(candidate), state)
        if most is not None:  # rounded sums do not fall where a term is added, so feet cannot make a pair cheaper
            within = np.flatnonzero(least + np.where(goes_on, np.float32(0.0), change + replay) + rate
                                    <= most.take(candidate))
            pairs, candidate, state, least, rate, goes_on, change, replay = (
                values.take(within) for values in (pairs, candidate, state, least, rate, goes_on, change, replay))
        jump = self.costs.cuts.measure_foot_jump(self.left.take(state), frame.take(candidate))
        cut = np.float32(self.costs.weights.feet) * jump
        cut += change
        cut += replay
        cut[goes_on] = 0.0
        return pairs, least + cut + rate

    def _compute_repetition(self, frame: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute what cuts from states to library frames (P,) cost for another recording, and (P,) for what has been
        shown lately.
        """
        costs, left = self.costs, self.left.take(state)
        bucket = costs.index.bucket.take(frame)
        shown = self.seen_buckets.ravel().take(state * self.seen_buckets.shape[1] + bucket)
        # a stand may be shown again: nothing in it is recognized
        lifted = np.maximum(costs.index.lifted.take(frame), np.float32(0.1))
        return costs.cuts.compute_recording_change(left, frame), np.float32(costs.weights.replay) * shown * lifted

    def _compute_rate_changes(self, to: SlotCandidates, candidate: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Compute what pairs (P,) cost for the change of the playback rate."""
        change = np.abs(to.rate.astype(np.float32).take(candidate) - self.rate.take(state))
        return np.float32(self.costs.weights.rate_change) * change

    def _goes_on(self, to: SlotCandidates, candidate: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Return (P,) bool: whether pairs continue without a cut."""
        is_same = np.abs(to.start.take(candidate) - self.end.take(state)) < SAME_FRAME
        return is_same & (to.clip.take(candidate) == self.clip.take(state))

    def _find_uncut_pairs(self, to: SlotCandidates) -> tuple[np.ndarray, np.ndarray]:
        """Find all pairs that continue without a cut.

        Returns:
            Candidates (M,) and states (M,).
        """
        # states sorted by their end; for each candidate the range low .. high of ends within SAME_FRAME
        by_end = np.argsort(self.end, kind="stable")
        low, high = (np.searchsorted(self.end[by_end], to.start + off) for off in (-SAME_FRAME, SAME_FRAME))
        candidate = np.flatnonzero(high > low)
        many = high[candidate] - low[candidate]
        # enumerate all ranges in one array: position in the run of repeats plus the run's own `low`
        at = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many - low[candidate], many)
        candidate, state = np.repeat(candidate, many), by_end[at]
        meets = self._goes_on(to, candidate, state)
        return candidate[meets], state[meets]


def _find_cheapest_of_runs(cost: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """Find the first cheapest entry of each run.

    Args:
        cost: (P,), runs one after the other.
        begins: (k,) where the runs begin.
    Returns:
        (k,) indices.
    """
    if not len(begins):
        return begins
    best = np.minimum.reduceat(cost, begins)
    equal = np.flatnonzero(cost == np.repeat(best, np.diff(np.append(begins, len(cost)))))
    # number of the run of each minimum; where it grows is the first minimum of a run
    run = np.searchsorted(begins, equal, side="right")
    return equal[np.diff(run, prepend=0) > 0]
