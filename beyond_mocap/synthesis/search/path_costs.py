"""What a stretch of a clip costs in a place of the track, and what a cut from one frame to another costs.

All that `path_search` weighs stands here: how far speed, turn, facing and words are from what is asked, and how far two
poses are apart. Costs are per slot, about a metre per second of missed speed each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...annotation.gaits import wanted_offset
from ...library.library import Library
from ..plan import Plan
from .offer import RATES, SLOT, Offer, Pairs
from .preferences import Used, price
from .wanted import Wanted

# The cheapest of many pairs of a rate and a library frame, without weighing them all.
#
# Pairs lie in the order of their speeds, and each costs at least the speed that it misses. What every eighth of them
# costs tells how dear the cheapest are at most, and so how far from the asked speed they can lie.


_SAMPLED = 8
# as many pairs as are wanted lie below the cost below which this many times their share of the sample lies
_ABOVE = 1.25
_ROUNDING = 1e-3

_CONTINUITY = ("switch", "pose", "rate_change")


def cheapest(
    cost_of: Callable[[slice], np.ndarray], speeds: np.ndarray, speed: float, weight: float, looked_at: int, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The `count` cheapest of the `looked_at` pairs nearest to a speed in m/s: their numbers (k,), ascending, and costs
    (k,).

    speeds (K,) m/s of the pairs, ascending; weight: what a metre per second of missed speed costs each pair at least;
    cost_of: (n,) costs of a part of the pairs."""
    near = _nearest(speeds, speed, looked_at)
    part, cost = _promising(cost_of, speeds, speed, weight=weight, near=near, count=count)
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


TERMS = {
    "speed": "speed other than the track's",
    "turn": "turning other than the track's",
    "facing": "facing elsewhere than wanted",
    "words": "asked words that the clip lacks",
    "unasked": "an action that nobody asked for, or no words at all",
    "made": "made clip, not recorded",
    "rate": "played faster or slower than recorded",
    "strike": "strikes the ball otherwise than it comes",
    "pose": "change of pose at the cut",
    "feet": "standing feet that jump at the cut",
    "left": "wild motion left at the cut",
    "cut": "the cut itself, and wild motion entered",
    "replay": "shown a moment ago",
    "rate_change": "change of playing speed",
    "avoided": "a word that must not be",
    "style": "no clip of the style",
    "variety": "out of step with this player's own lag",
}
"""Name of a part of the costs -> what it is about, as "Why this clip?" says it."""


@dataclass(frozen=True)
class Weights:
    """What a unit of each misfit costs. speed per m/s; drag per m/s and second that both feet stand longer than in a
    walk; turn per radian and slot; facing per radian between the body and where it should face; words for lacking all
    of the asked ones; unasked for frames of an action that nobody asked for, or that carry no word; made for a made
    clip, which steps in only where recordings miss the speed by more, made_key at key moments, where a recording is
    worth more; rate per unit of warp; stretch per unit of warp beyond 0.85 to 1.15; switch for any cut; pose per metre
    of joint distance; feet per metre that a foot which stands before and after a cut would jump; wild for cutting where
    the clips jerk by as much again as is usual; rate_change per unit; replay for a stretch shown less than 4 s ago;
    held per frame beyond a clip's end."""

    speed: float = 1.0
    drag: float = 1.0
    turn: float = 0.5
    facing: float = 0.15
    words: float = 1.0
    unasked: float = 2.0
    made: float = 0.2
    made_key: float = 0.8
    rate: float = 0.24
    stretch: float = 4.0
    switch: float = 0.1
    pose: float = 2.0
    feet: float = 1.5
    wild: float = 0.3
    rate_change: float = 0.16
    replay: float = 1.5
    held: float = 0.1


_NEAR_KEY = 45  # frames around a key moment in which its own words may be shown

AVOIDED = 1000.0
"""What a slot costs that shows a word which it must not: more than a whole track of anything else."""

Term = tuple[str, np.ndarray]
"""A part of a cost, by name."""


@dataclass(frozen=True, eq=False)
class Alike:
    """How far two poses are apart: the sum of the distances of their bones (N, P, 3), weighted, of the library's
    frames; the mean over `offsets` in frames from the cut, so that what follows and went before counts too."""

    bones: np.ndarray
    offsets: tuple[int, ...] = (0,)


class PathCosts:
    """The costs of one order on one library of N frames."""

    def __init__(
        self, library: Library, wanted: Wanted, weights: Weights = Weights(), used: tuple[Used, ...] = (),
        alike: Alike | None = None,
    ):
        """used: footage that another solution is to do without where it can. alike: another measure of how far two
        poses are apart than that of the features."""
        self.library, self.wanted, self.weights = library, wanted, weights
        self.price = price(library, used) if used else None
        self.alike = alike
        self.frames, self.offer = library.frames, Offer.of(library, wanted.allowed)
        self.wanted_offset = wanted_offset(wanted.track)
        self._rate_cost = (weights.rate * np.abs(RATES - 1.0)).astype(np.float32)
        self._kept: dict[tuple[frozenset[str], frozenset[str]], np.ndarray] = {}
        self._asked: dict[tuple[int, int], tuple[float, float]] = {}

    def inside(self, frame: np.ndarray) -> np.ndarray:
        """Nearest whole library frames."""
        return np.clip(np.round(frame).astype(int), 0, len(self.frames) - 1)

    def asked(self, first: int, end: int) -> tuple[float, float]:
        """Mean speed in m/s and change of direction in radians that the track asks from frame first to end."""
        if (first, end) not in self._asked:
            track = self.wanted.track
            last = min(end, len(track.times) - 1)
            speed = float(track.speed[first : last + 1].mean())
            turn = float(track.direction[last] - track.direction[first]) * min(1.0, speed)
            self._asked[first, end] = speed, turn
        return self._asked[first, end]

    def misfit(self, first: int, end: int, number: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """(K,) what library frames (K,), played from there on at RATES[number (K,)], cost in the output's first .. end;
        inf where the clip ends before or may not be used."""
        cost = _added(self._played_terms(first, end, self.offer.pairs(number, frame)))
        cost += self._still(self._words(first, end), self.wanted.avoided_in(first, end))[frame]
        return np.where(self.offer.valid[number, frame], cost, np.inf)

    def misfit_terms(self, first: int, end: int, number: np.ndarray, frame: np.ndarray) -> Iterator[Term]:
        """What `misfit` is the sum of, by name, each (K,)."""
        yield from self._played_terms(first, end, self.offer.pairs(number, frame))
        yield from self._still_terms(frame, self._words(first, end), self.wanted.avoided_in(first, end))

    def cheapest(self, first: int, end: int, looked_at: int, count: int):
        """The `count` pairs of rate and library frame that cost least of the `looked_at` nearest in speed: number (K,),
        frame (K,), misfit (K,). The others' misfit in speed alone would put them behind, and a large library is
        searched as fast as a small one."""
        words, avoid = self._words(first, end), self.wanted.avoided_in(first, end)
        pairs, still, (speed, _) = self.offer.in_speed(avoid), self._still(words, avoid), self.asked(first, end)

        def cost_of(part: slice) -> np.ndarray:
            some = pairs.part(part)
            return _added(self._played_terms(first, end, some)) + still[some.frame]

        best, cost = cheapest(cost_of, pairs.speed, speed, weight=self.weights.speed, looked_at=looked_at, count=count)
        return pairs.number[best], pairs.frame[best], cost

    def _words(self, first: int, end: int) -> frozenset[str]:
        return self.wanted.asked[(first + end) // 2] or frozenset()

    def _played_terms(self, first: int, end: int, pairs: Pairs) -> Iterator[Term]:
        """How far pairs (K,) are from what the track asks, the rate, and the player's taste."""
        turn = pairs.turn * np.float32((end - first) / SLOT)
        yield from self._motion_terms(first, end, pairs.speed, turn=turn, offset=pairs.offset,
                                      long_stance=pairs.long_stance)
        yield "rate", self._rate_cost[pairs.number]
        if self.wanted.taste is not None:
            yield "variety", self.wanted.taste.cost(first, pairs.frame)

    def _still(self, words: frozenset[str], avoid: frozenset[str]) -> np.ndarray:
        """(N,) what the library's frames cost wherever these words are asked and avoided."""
        if (words, avoid) not in self._kept:
            terms = self._still_terms(np.arange(len(self.frames)), words, avoid)
            self._kept[words, avoid] = _added(terms).astype(np.float32)
        return self._kept[words, avoid]

    def _still_terms(self, frame: np.ndarray, words: frozenset[str], avoid: frozenset[str]) -> Iterator[Term]:
        """What it is the sum of, by name, each (K,) of frames (K,)."""
        w, (missing, unasked) = self.weights, self.offer.lacking(words)
        yield "words", w.words * missing[frame]
        yield "unasked", np.float32(w.unasked) * unasked[frame]
        yield "made", np.float32(w.made) * self.offer.made[frame]
        if self.wanted.off_style is not None:
            yield "style", self.wanted.off_style[frame]
        if self.price is not None:
            yield "price", self.price[frame]
        if avoid:
            yield "avoided", AVOIDED * self.offer.showing(avoid)[frame]

    def key_misfit(self, first: int, end: int, clip: np.ndarray, start: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """(K,) the same for pieces of key moments: clips (K,) from library frames start (K,) on at any rate (K,), held
        at their ends. Words do not count here but for those that must not be. A kick that was recorded slower than the
        player runs is played faster, within the limits of what may give way (../shared/metrics.md)."""
        return _added(self._key_terms(first, end, clip, start, rate)) * ((end - first) / SLOT)

    def key_terms(self, first: int, end: int, clip: np.ndarray, start: np.ndarray, rate: np.ndarray) -> Iterator[Term]:
        """What `key_misfit` is the sum of, by name, each (K,)."""
        for name, values in self._key_terms(first, end, clip, start, rate):
            yield name, values * ((end - first) / SLOT)

    def _key_terms(self, first: int, end: int, clip: np.ndarray, start: np.ndarray, rate: np.ndarray) -> Iterator[Term]:
        """The same per SLOT frames."""
        low, high = self.frames.first[clip], self.frames.first[clip] + self.frames.count[clip] - 1
        length = end - first
        a, b = (np.clip(at, low, high) for at in (start, start + rate * length))
        path = [_between(self.frames.path, at, high) for at in (a, b)]
        turn = _between(self.frames.heading, b, high) - _between(self.frames.heading, a, high)
        speed = np.linalg.norm(path[1] - path[0], axis=1) * self.library.fps / length
        middle = self.inside((a + b) / 2.0)
        yield from self._motion_terms(
            first, end, speed, turn=turn, offset=self.offer.offset[middle], long_stance=self.offer.long_stance[middle]
        )
        held = np.maximum(low - start, 0) + np.maximum(start + rate * length - high, 0)
        off = np.abs(rate - 1.0)
        far = self.weights.stretch * np.maximum(off - 0.15, 0.0)
        yield "rate", self.weights.rate * off + far + self.weights.held * held
        yield "made", self.weights.made_key * self.offer.made[self.inside(start)]
        if self.wanted.off_style is not None:
            yield "style", self.wanted.off_style[self.inside(start)]
        if self.price is not None:
            yield "price", self.price[middle]
        if self.wanted.avoided:
            yield "avoided", AVOIDED * SLOT / length * self._avoided_between(first, end, a, b)

    def _avoided_between(self, first: int, end: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(K,) bool: whether library frames a .. b (K,) show a word that the output's first .. end must not, but for
        those that a key moment close by asks for."""
        avoid = self.wanted.avoided_in(first, end)
        near = (key.asked.words for key in self.wanted.keys if first - _NEAR_KEY <= key.frame < end + _NEAR_KEY)
        shown = np.append(0, np.cumsum(self.offer.annotation.showing(avoid.difference(*near))))
        return shown[self.inside(b) + 1] > shown[self.inside(a)]

    def _motion_terms(self, first: int, end: int, speed, turn, offset, long_stance) -> Iterator[Term]:
        wanted_speed, wanted_turn = self.asked(first, end)
        w, moving = self.weights, min(1.0, wanted_speed)
        yield "speed", np.abs(speed - wanted_speed) * (w.speed + w.drag * long_stance)
        yield "turn", w.turn * (0.3 + 0.7 * moving) * np.abs(turn - wanted_turn)
        aside = np.abs(offset - float(self.wanted_offset[(first + end) // 2]))
        yield "facing", w.facing * moving * np.minimum(aside, 2.0 * np.pi - aside)

    def cut_terms(self, ends: np.ndarray, start: np.ndarray) -> Iterator[Term]:
        """What a cut from library frames ends (B,) to start (K,) costs, by name, each (B, K) or broadcast to it: how
        far their poses are apart ("pose", first), and how wild the motion is that is left or entered (nobody can blend
        out of a kick half way)."""
        ends, start = self.inside(ends), self.inside(start)
        yield "pose", self.apart(ends, start)
        yield "feet", np.float32(self.weights.feet) * self.feet_apart(ends[:, None], start)
        left, entered = self.left_and_entered(ends, start)
        yield "left", left[:, None]
        yield "cut", entered

    def left_and_entered(self, ends: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(B,) what it costs to leave library frames ends (B,), (K,) what to cut to start (K,), whatever the other."""
        left = self.weights.wild * self.offer.wild_before[ends]
        entered = self.weights.switch + self.weights.wild * self.offer.wild_after[start]
        return left.astype(np.float32), entered.astype(np.float32)

    def apart(self, ends: np.ndarray, start: np.ndarray) -> np.ndarray:
        """(B, K) what the change of pose between library frames ends (B,) and start (K,) costs."""
        weight = np.float32(self.weights.pose)
        if self.alike is None:
            return distances(weight * self.frames.features[ends], weight * self.frames.features[start])
        total = np.zeros((len(ends), len(start)), np.float32)
        for offset in self.alike.offsets:
            a, b = (weight * self.alike.bones[self._beside(frames, offset)] for frames in (ends, start))
            for bone in range(a.shape[1]):
                total += distances(a[:, bone], b[:, bone])
        return total / np.float32(len(self.alike.offsets))

    def _beside(self, frames: np.ndarray, offset: int) -> np.ndarray:
        """(K,) library frames so many frames from others (K,), held at the ends of their clips."""
        clip = self.frames.clip[frames]
        first = self.frames.first[clip]
        return np.clip(frames + offset, first, first + self.frames.count[clip] - 1)

    def feet_apart(self, ends: np.ndarray, start: np.ndarray) -> np.ndarray:
        """m between the feet that stand before and after cuts from library frames `ends` to `start`, of shapes that go
        together."""
        feet, stands = self.frames.feet, self.offer.stands
        apart = np.zeros(np.broadcast_shapes(ends.shape, start.shape), np.float32)
        for foot in (0, 1):
            x, y = (feet[ends, axis] - feet[start, axis] for axis in (2 * foot, 2 * foot + 1))
            apart += np.sqrt(x * x + y * y) * (stands[ends, foot] & stands[start, foot])
        return apart


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(B, K) distances between points (B, D) and (K, D)."""
    square = _with_square(a, -2.0 * a, 1) @ _with_square(b, b, 0).T
    return np.sqrt(np.maximum(square, 0.0, out=square), out=square)


def _with_square(points: np.ndarray, scaled: np.ndarray, place: int) -> np.ndarray:
    """(K, D + 2) `scaled` (K, D) points with their squared lengths and ones behind, or the other way round, so that one
    product is |a|^2 + |b|^2 - 2 a b."""
    out = np.ones((len(points), points.shape[1] + 2), points.dtype)
    out[:, :-2] = scaled
    np.einsum("kd,kd->k", points, points, out=out[:, -2 + place])
    return out


def _added(terms: Iterator[Term]) -> np.ndarray:
    """The sum of named parts, in their order; the first one is overwritten."""
    _, total = next(terms)
    for _, values in terms:
        total += values
    return total


def _between(values: np.ndarray, at: np.ndarray, last: np.ndarray) -> np.ndarray:
    """`values` (N, ...) at fractional frames `at` (K,) that lie no later than `last` (K,)."""
    low = np.floor(at).astype(int)
    weight = (at - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1.0 - weight) + values[np.minimum(low + 1, last)] * weight


def balanced(alpha: float, weights: Weights = Weights()) -> Weights:
    """`weights` with words times alpha / 0.2 and continuity (what a cut and its change of pose and rate cost) times
    (1 - alpha) / 0.8, so that alpha = 0.2, the paper's and the default, leaves them as they are.

    Speed, turn and facing keep their weights: they hold the body on its track, which is nothing to be traded. So do
    actions that nobody asked for, and replayed stretches."""
    words, continuity = alpha / Plan.alpha, (1.0 - alpha) / (1.0 - Plan.alpha)
    return replace(
        weights, words=weights.words * words, **{name: getattr(weights, name) * continuity for name in _CONTINUITY}
    )
