"""Costs of the path search, of a stretch of a clip at a place of the track: how far speed, turning, facing and labels
are from what is requested.

`cut_costs` has what a cut from one frame to another costs, `cost_weights` what one unit of each misfit costs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...annotation import LOCOMOTION
from ...annotation.gaits import TURNING, compute_heading_offset
from ...annotation.vocabulary import DIRECTIONS
from ...library.library import Library
from ...motion.motion import RATE_TOLERANCE
from ..known_body import KnownFeatures
from .candidate_index import ACTING, PLAYBACK_RATES, SLOT, CandidateIndex, RatePairs
from .cost_weights import Term, Weights
from .cut_costs import BoneDistance, CutCosts
from .lean_cost import compute_lean_cost, compute_wanted_lean
from .preferences import AVOIDED_COST, UsedStretch, compute_reuse_cost
from .request import SearchRequest

_ROUNDING = 1e-3  # m/s, for float32

FREE_SPEED, FREE_TURN, FREE_ASIDE = (0.05, 0.06), np.radians(5.0), np.float32(np.radians(12.0))
KEY_TURN = 0.2  # share of the weights of turning and facing within the pieces of key moments
KEY_SLIDE = 0.5  # share of the weight of sliding there: the plant foot of a clip that is too slow is dragged
RESTING_SPEED = 0.15  # m/s of a track from which on a lifted foot costs nothing


def find_cheapest(
    cost_of: Callable[[slice], np.ndarray], speeds: np.ndarray, speed: float, weight: float, *, considered: int,
    count: int, most: float = np.inf, square_weight: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the `count` cheapest of the `considered` pairs nearest to a speed.

    All of them are evaluated: they lie side by side in memory, so that costs less than to pick those worth evaluating.

    Args:
        cost_of: returns the costs (n,) of a slice of the pairs.
        speeds: (K,) m/s of the pairs, ascending.
        speed: m/s that is requested.
        weight: least cost of a metre per second of missed speed, beyond what is free.
        considered: how many pairs are considered.
        count: how many are returned.
        most: highest cost of a pair that is returned.
        square_weight: least cost of the square of the missed speed, beside that.
    Returns:
        Their numbers (k,), ascending, and costs (k,).
    """
    near = _nearest_slice(speeds, speed, considered)
    if weight > 0.0 and np.isfinite(most):  # the missed speed alone costs more than that elsewhere
        free = FREE_SPEED[0] + FREE_SPEED[1] * speed
        # the larger root of square_weight reach^2 + weight (reach - free) = most, in a form that holds without a square
        highest = most + weight * free
        reach = 2.0 * highest / (weight + np.sqrt(weight**2 + 4.0 * square_weight * highest)) + _ROUNDING
        low, high = _locate_speeds(speeds, [speed - reach, speed + reach])
        near = slice(max(int(low), near.start), max(min(int(high), near.stop), near.start))
    cost = cost_of(near)
    within = np.flatnonzero(cost <= most)
    if len(within) > count:
        within = np.sort(within.take(np.argpartition(cost.take(within), count)[:count]))
    return near.start + within, cost.take(within)


def _nearest_slice(speeds: np.ndarray, speed: float, count: int) -> slice:
    """Return the slice of the `count` speeds nearest to `speed`, by rank."""
    middle = int(_locate_speeds(speeds, [speed])[0])
    low = int(np.clip(middle - count // 2, 0, max(0, len(speeds) - count)))
    return slice(low, min(low + count, len(speeds)))


def _locate_speeds(speeds: np.ndarray, values: Sequence[float]) -> np.ndarray:
    """Find where values (n,) lie in speeds, as np.searchsorted, which would convert float32 speeds to float64."""
    at = np.asarray(values, speeds.dtype)
    return np.searchsorted(speeds, np.where(at < values, np.nextafter(at, speeds.dtype.type(np.inf)), at))


_PLAIN = frozenset((*LOCOMOTION, *DIRECTIONS, TURNING))  # labels that do not ask for an unusual posture
_NEAR_KEY = 45  # frames around a key moment in which its own labels may be shown

class PathCosts:
    """The costs of one request on one library of N frames."""

    def __init__(
        self, library: Library, request: SearchRequest, weights: Weights = Weights(),
        used: tuple[UsedStretch, ...] = (), bone_distance: BoneDistance | None = None,
    ):
        """Prepare the costs.

        Args:
            library: the clips.
            request: the request.
            weights: cost of each misfit.
            used: source frames that another solution avoids where it can.
            bone_distance: another distance of poses than that of the features.
        """
        self.library, self.request, self.weights = library, request, weights
        self.reuse_cost = compute_reuse_cost(library, used) if used else None
        self.frames, self.index = library.frames, CandidateIndex.for_library(library, request.allowed)
        self.cuts = CutCosts(self.index, weights, bone_distance)
        self.wanted_offset = compute_heading_offset(request.track)
        self.wanted_lean, self.lean_counts = compute_wanted_lean(request.track, request.size)
        bodies = request.plan.bodies
        self.known = KnownFeatures(bodies, self.frames, library.skeleton, request.track.times,
                                   request.size) if bodies else None
        self._rate_cost = (weights.rate * np.abs(PLAYBACK_RATES - 1.0)).astype(np.float32)
        self._cached_costs: dict[tuple[frozenset[str], bool, frozenset[str]], np.ndarray] = {}
        self._cached_terms: dict[frozenset[str], tuple[np.ndarray, np.ndarray | None]] = {}
        # a strike turns as it was recorded: the body follows it there (`construct.construction`)
        self._key_weights = replace(weights, turn=KEY_TURN * weights.turn, facing=KEY_TURN * weights.facing,
                                    slide=KEY_SLIDE * weights.slide)
        self._cached_motion: dict[tuple[int, int], tuple[float, float]] = {}
        self._cached_lean: dict[tuple[int, int], np.ndarray] = {}

    def requested_motion(self, first: int, end: int) -> tuple[float, float]:
        """Return the track's mean speed, m/s, and change of direction, rad, from frame first to end; cached."""
        if (first, end) not in self._cached_motion:
            track = self.request.track
            last = min(end, len(track.times) - 1)
            speed = float(track.speed[first : last + 1].mean())
            if track.heading is None:
                # a slow body turns on the spot: its direction counts less
                turn = float(track.direction[last] - track.direction[first]) * min(1.0, speed)
            else:
                turn = float(track.heading[last] - track.heading[first])
            self._cached_motion[first, end] = speed, turn
        return self._cached_motion[first, end]

    def compute_misfit(self, first: int, end: int, number: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Compute the cost of playing library frames in a slot.

        Args:
            first, end: output frames of the slot.
            number: (K,) index of the playback rate.
            frame: (K,) library frame where it begins.
        Returns:
            (K,); inf where the clip ends before or may not be used.
        """
        terms = self._list_pair_terms(number, frame)
        cost = _sum_terms(self._iter_motion_costs(first, end, self.index.build_pairs(number, frame), terms))
        fixed = self._fixed_costs(*self._requested_labels(first, end), self.request.list_avoided(first, end))
        cost += fixed.take(frame)
        return np.where(self.index.valid[number, frame], cost, np.inf)

    def iter_misfit_terms(self, first: int, end: int, number: np.ndarray, frame: np.ndarray) -> Iterator[Term]:
        """Generate the terms of `compute_misfit`, by name, each (K,)."""
        yield from self._iter_motion_costs(first, end, self.index.build_pairs(number, frame),
                                           self._list_pair_terms(number, frame))
        yield from self._iter_fixed_terms(frame, *self._requested_labels(first, end),
                                          self.request.list_avoided(first, end))

    def find_cheapest(self, first: int, end: int, considered: int, count: int, most: float = np.inf):
        """Find the pairs of playback rate and library frame with the lowest cost among those nearest in speed.

        The missed speed alone would put the others behind, so a large library is searched as fast as a small one.

        Args:
            first, end: output frames of the slot.
            considered: how many pairs are considered.
            count: how many are returned.
            most: highest cost of those that are returned.
        Returns:
            number (K,), frame (K,), misfit (K,).
        """
        if most < 0.0:  # no cost is
            return np.zeros(0, int), np.zeros(0, int), np.zeros(0, np.float32)
        (words, is_asked), avoid = self._requested_labels(first, end), self.request.list_avoided(first, end)
        pairs, fixed_cost, (speed, _) = self.index.pairs_by_speed(avoid), self._fixed_costs(words,
                is_asked, avoid), self.requested_motion(first, end)
        if avoid not in self._cached_terms:
            self._cached_terms[avoid] = self._list_pair_terms(pairs.number, pairs.frame)
        rate, place = self._cached_terms[avoid]

        def cost_of(part: slice) -> np.ndarray:
            part_pairs, terms = pairs.select_pairs(part), (rate[part], None if place is None else place[part])
            cost = _sum_terms(self._iter_motion_costs(first, end, part_pairs, terms))
            return cost + fixed_cost.take(part_pairs.frame)

        best, cost = find_cheapest(cost_of, pairs.speed, speed, self.weights.speed, considered=considered, count=count,
                                   most=most, square_weight=self.weights.slide)
        return pairs.number[best], pairs.frame[best], cost

    def list_asked_labels(self, first: int, end: int) -> frozenset[str]:
        """Return the labels that the user asks for in the middle of a slot."""
        words, is_asked = self._requested_labels(first, end)
        return words if is_asked else frozenset()

    def _requested_labels(self, first: int, end: int) -> tuple[frozenset[str], bool]:
        """Return the labels requested in the middle of a slot, and whether the user has asked for them."""
        middle = (first + end) // 2
        return self.request.requested_labels[middle] or frozenset(), bool(self.request.is_asked[middle])

    def _list_pair_terms(self, number: np.ndarray, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """List what pairs cost for their playback rate (K,), and their places (K,) in the period of the player's lag,
        None without one: they are the same in every slot.
        """
        lag = self.request.lag_preference
        return self._rate_cost.take(number), None if lag is None else lag.place.take(frame)

    def _iter_motion_costs(self, first: int, end: int, pairs: RatePairs,
                           pair_terms: tuple[np.ndarray, np.ndarray | None]) -> Iterator[Term]:
        """Generate the terms that depend on the track: motion of pairs (K,), playback rate, and the player's lag."""
        # pairs hold the turn over SLOT frames, this slot may be longer or shorter
        turn = pairs.turn * np.float32((end - first) / SLOT)
        yield from self._iter_motion_terms(first, end, pairs.speed, turn=turn, offset=pairs.offset,
                                           long_stance=pairs.long_stance, lifted=pairs.lifted)
        middle = (first + end) // 2
        if self.lean_counts[middle] > 0.0:
            weight = np.float32(self.weights.lean * self.lean_counts[middle])
            yield "lean", weight * compute_lean_cost(pairs.lean, self._find_wanted_lean(first, end))
        if self.known is not None and self.known.counts[first]:
            away = self.known.measure_distance(first, self.frames.features[pairs.frame])
            yield "known", np.float32(self.weights.known) * away.astype(np.float32)
        rate, place = pair_terms
        yield "rate", rate
        if place is not None:
            yield "variety", self.request.lag_preference.compute_cost(first, place)

    def _find_wanted_lean(self, first: int, end: int) -> np.ndarray:
        """Find the mean lean (2,) of the track from frame first to end; cached."""
        if (first, end) not in self._cached_lean:
            self._cached_lean[first, end] = self.wanted_lean[first : end + 1].mean(axis=0)
        return self._cached_lean[first, end]

    def _fixed_costs(self, words: frozenset[str], is_asked: bool, avoid: frozenset[str]) -> np.ndarray:
        """Return the cost (N,) of the library's frames wherever these labels are requested and avoided; cached."""
        key = words, is_asked, avoid
        if key not in self._cached_costs:
            terms = self._iter_fixed_terms(np.arange(len(self.frames)), *key)
            self._cached_costs[key] = _sum_terms(terms).astype(np.float32)
        return self._cached_costs[key]

    def _iter_fixed_terms(self, frame: np.ndarray, words: frozenset[str], is_asked: bool,
                          avoid: frozenset[str]) -> Iterator[Term]:
        """Generate the terms of it, by name, each (K,) of frames (K,)."""
        w, (missing, unasked) = self.weights, self.index.measure_lacking(words)
        yield "words", (w.words if is_asked else w.automatic_words) * missing[frame]
        yield "unasked", np.float32(w.unasked) * unasked[frame]
        # what carries a requested label beyond a plain gait belongs, whatever it looks like
        belongs = self.index.annotation.find_frames_with(words - _PLAIN)
        yield "strange", np.float32(w.strange) * np.where(belongs, 0.0, self.index.strange)[frame]
        yield "made", np.float32(w.synthetic) * self.index.is_made_travel[frame]
        if self.request.style_cost is not None:
            yield "style", self.request.style_cost[frame]
        if self.request.manner_cost is not None:
            yield "manner", self.request.manner_cost[frame]
        if self.reuse_cost is not None:
            yield "reused", self.reuse_cost[frame]
        if avoid:
            yield "avoided", AVOIDED_COST * self.index.shows_labels(avoid)[frame]

    def compute_key_misfit(self, first: int, end: int, clip: np.ndarray, start: np.ndarray,
                           rate: np.ndarray) -> np.ndarray:
        """Compute the cost of pieces of key moments in a slot.

        Labels have no weight here except avoided ones. A kick that was recorded slower than the player runs is played
        faster: the playback rate yields before feet slide (docs/explanation/quality.md).

        Args:
            first, end: output frames of the slot.
            clip: (K,) clip index.
            start: (K,) fractional library frame where each begins.
            rate: (K,) any playback rate; clips are held at their ends.
        Returns:
            (K,) cost.
        """
        return _sum_terms(self._iter_key_terms_per_slot(first, end, clip, start, rate)) * ((end - first) / SLOT)

    def iter_key_terms(self, first: int, end: int, clip: np.ndarray, start: np.ndarray,
                       rate: np.ndarray) -> Iterator[Term]:
        """Generate the terms of `compute_key_misfit`, by name, each (K,)."""
        for name, values in self._iter_key_terms_per_slot(first, end, clip, start, rate):
            yield name, values * ((end - first) / SLOT)

    def _iter_key_terms_per_slot(self, first: int, end: int, clip: np.ndarray, start: np.ndarray,
                                 rate: np.ndarray) -> Iterator[Term]:
        """Generate the same per SLOT frames."""
        low, high = self.frames.first[clip], self.frames.first[clip] + self.frames.count[clip] - 1
        length = end - first
        # first and last library frame that is played, held inside the clip
        a, b = (np.clip(at, low, high) for at in (start, start + rate * length))
        path = [_interpolate_values(self.frames.path, at, high) for at in (a, b)]
        turn = _interpolate_values(self.frames.heading, b, high) - _interpolate_values(self.frames.heading, a, high)
        speed = np.linalg.norm(path[1] - path[0], axis=1) * self.library.fps / length
        middle = self.index.round_frame((a + b) / 2.0)
        yield from self._iter_motion_terms(
            first, end, speed, turn=turn, offset=self.index.offset[middle], long_stance=self.index.long_stance[middle],
            lifted=self.index.lifted[middle], weights=self._key_weights,
        )
        # library frames that lie beyond either end of the clip
        held = np.maximum(low - start, 0) + np.maximum(start + rate * length - high, 0)
        off = np.abs(rate - 1.0)
        far = self.weights.stretch * np.maximum(off - RATE_TOLERANCE, 0.0)
        yield "rate", self.weights.rate * off + far + self.weights.held * held
        yield "made", self.weights.synthetic_key * self.index.is_synthetic[self.index.round_frame(start)]
        if self.request.style_cost is not None:
            yield "style", self.request.style_cost[self.index.round_frame(start)]
        if self.reuse_cost is not None:
            yield "reused", self.reuse_cost[middle]
        if self.request.avoided:
            yield "avoided", AVOIDED_COST * SLOT / length * self._shows_avoided(first, end, a, b)

    def _shows_avoided(self, first: int, end: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return (K,) bool: whether library frames a .. b (K,) show a label that the output's first .. end avoids.

        Labels that a key moment close by requests do not count.
        """
        avoid = self.request.list_avoided(first, end)
        near = (key.requested.words for key in self.request.keys if first - _NEAR_KEY <= key.frame < end + _NEAR_KEY)
        running_count = np.append(0, np.cumsum(self.index.annotation.find_frames_with(avoid.difference(*near))))
        return running_count[self.index.round_frame(b) + 1] > running_count[self.index.round_frame(a)]

    def _iter_motion_terms(self, first: int, end: int, speed, turn, offset, long_stance,
                           lifted, weights: Weights | None = None) -> Iterator[Term]:
        """Generate the terms of speed, turning and facing against the track.

        Args:
            weights: those of key moments, whose bodies face as recorded; None: the search's own.
        """
        wanted_speed, wanted_turn = self.requested_motion(first, end)
        w = weights or self.weights
        missed = np.abs(speed - wanted_speed)
        free = FREE_SPEED[0] + FREE_SPEED[1] * wanted_speed
        yield "speed", np.maximum(missed - free, 0.0) * (w.speed + w.drag * long_stance)
        resting = 1.0 - wanted_speed / RESTING_SPEED
        if resting > 0.0 and not ACTING & self.list_asked_labels(first, end):  # who celebrates may lift a foot
            yield "lift", np.float32(w.lift * resting) * lifted
        yield "turn", w.turn * np.maximum(np.abs(turn - wanted_turn) - FREE_TURN, 0.0)
        # what the velocity in the body's frame misses beyond its speed: sideways or backward for forward
        aside = np.abs(offset - np.float32(self.wanted_offset[(first + end) // 2]))
        aside = np.maximum(np.minimum(aside, 2.0 * np.pi - aside) - FREE_ASIDE, 0.0)
        across = 2.0 * np.float32(wanted_speed) * speed * (1.0 - np.cos(aside))
        whole = np.sqrt(missed * missed + across)
        yield "facing", w.facing * (whole - missed)
        slid = whole if weights is None else missed
        yield "drag", w.slide * slid * slid

def _sum_terms(terms: Iterator[Term]) -> np.ndarray:
    """Return the sum of terms, in their order; the first one is overwritten."""
    _, total = next(terms)
    for _, values in terms:
        total += values
    return total


def _interpolate_values(values: np.ndarray, at: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Interpolate values (N, ...) at fractional frames `at` (K,) that lie no later than `last` (K,)."""
    low = np.floor(at).astype(int)
    weight = (at - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1.0 - weight) + values[np.minimum(low + 1, last)] * weight
