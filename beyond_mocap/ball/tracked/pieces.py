"""Pieces of the ball's path, smooth curves of third degree through runs of samples, and the cuts between them.

A piece is x(t) = p + v t + a t^2 / 2 + j t^3 / 6 from its first moment on. Nothing but friction and drag, and gravity
in the air, bends it: a and j are held near zero by their usual size at the piece's speed. So a short piece is nearly a
line, and a slow ball that gains speed was touched.

A cut k lies between the samples k - 1 and k: a small set holds every real change of course and more. First each place
between two samples is judged by how much the lines through the samples before and after it differ; then dynamic
programming chooses, among the promising ones, those that explain the samples by smooth pieces, with a low price per
cut. What a cut is (a touch, a bounce, nothing) is decided later, with the players.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

USUAL_SPEED = 20.0  # m/s
REST_ACCELERATION, REST_JERK = 2.0, 2.0  # m/s^2, m/s^3 of a ball that hardly moves
BY_SPEED = 0.35  # 1/s, 1/s^2, more of either with its speed
IN_AIR, FALLING = 0.5, 9.0  # m above which it falls; m/s^2
_CHUNK = 400  # starts worked out at once

_SIDES = (0.12, 0.28)  # seconds looked at on either side
_WORTH = 0.9  # m/s, the least change of velocity looked at
_LONGEST = 2.4  # seconds of a piece here
_PAUSE = 0.8  # seconds after which a place is offered in any case
PRICE = 5.0  # nats for one more cut here


@dataclass(frozen=True, eq=False)
class Fits:
    """K pieces over samples first[k] .. last[k] (inclusive).

    begin: (K,) s, the origin of each. coefficients: (K, 4, D): p, v, a/2, j/6. cost: (K,) half the weighted squares.
    inverse: (K, 4, 4) covariance of one coordinate's coefficients."""

    first: np.ndarray
    last: np.ndarray
    begin: np.ndarray
    coefficients: np.ndarray
    cost: np.ndarray
    inverse: np.ndarray

    def __len__(self) -> int:
        return len(self.first)

    def take(self, which) -> Fits:
        """Some of them."""
        return Fits(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def position(self, time: np.ndarray, which=slice(None)) -> np.ndarray:
        """(n, D) m at `time` (n,), each of its own piece."""
        return np.einsum("ni,nid->nd", powers(time - self.begin[which]), self.coefficients[which])

    def velocity(self, time: np.ndarray, which=slice(None)) -> np.ndarray:
        """(n, D) m/s at `time` (n,), each of its own piece."""
        return np.einsum("ni,nid->nd", slopes(time - self.begin[which]), self.coefficients[which])

    def spread(self, time: np.ndarray, which=slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Variances (n,) of one coordinate's position and velocity at `time` (n,)."""
        since = time - self.begin[which]
        place, speed, inverse = powers(since), slopes(since), self.inverse[which]
        return (np.einsum("ni,nij,nj->n", place, inverse, place), np.einsum("ni,nij,nj->n", speed, inverse, speed))


def powers(since: np.ndarray) -> np.ndarray:
    """(n, 4): 1, t, t^2, t^3."""
    return since[:, None] ** np.arange(4)


def slopes(since: np.ndarray) -> np.ndarray:
    """(n, 4): the derivatives of `powers`."""
    one = np.ones_like(since)
    return np.stack([0.0 * one, one, 2.0 * since, 3.0 * since**2], axis=1)


def fit_between(times: np.ndarray, points: np.ndarray, weights: np.ndarray, cuts: np.ndarray, longest: float,
                steps: int | None = None) -> Fits:  # fmt: skip
    """Pieces between all pairs of cuts that are at most `longest` seconds (and `steps` cuts) apart.

    times: (N,) s. points: (N, D) m, any number where weights (N,) (1 / m^2) are zero. cuts: (C,) growing indices; a
    piece between cuts a and b has the samples a .. b - 1. Neighbouring cuts always make a piece."""
    parts = []
    for low in range(0, len(cuts) - 1, _CHUNK):
        starts = np.arange(low, min(low + _CHUNK, len(cuts) - 1))
        end = np.searchsorted(times[np.minimum(cuts, len(times) - 1)], times[cuts[starts]] + longest, "right") - 1
        if steps is not None:
            end = np.minimum(end, starts + steps)
        end = np.maximum(np.minimum(end, len(cuts) - 1), starts + 1)
        counts = end - starts
        begin = np.repeat(starts, counts)
        upto = begin + 1 + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        parts.append(_solve(times, points, weights, cuts=cuts, begin=begin, upto=upto))
    names = Fits.__dataclass_fields__
    return Fits(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _solve(times, points, weights, cuts, begin, upto) -> Fits:
    """The pieces between cuts begin[k] and upto[k], whose starts are a few neighbouring cuts."""
    starts = np.unique(begin)
    length = int((cuts[upto] - cuts[begin]).max())
    index = np.minimum(cuts[starts][:, None] + np.arange(length), len(times) - 1)
    since = times[index] - times[cuts[starts]][:, None]
    weight = weights[index]
    powered = weight[..., None] * since[..., None] ** np.arange(7)
    moments = np.cumsum(powered, axis=1)
    value = points[index]
    cross = np.cumsum(powered[..., :4, None] * value[..., None, :], axis=1)
    square = np.cumsum(weight * (value**2).sum(axis=2), axis=1)
    row, column = np.searchsorted(starts, begin), cuts[upto] - cuts[begin] - 1
    normal = moments[row, column][:, np.add.outer(np.arange(4), np.arange(4))]
    seconds = np.maximum(since[row, column], 1e-3)
    speed = np.linalg.norm(value[row, column] - value[row, 0], axis=1) / seconds
    bend = REST_ACCELERATION + BY_SPEED * speed
    if points.shape[1] == 3:
        highest = np.maximum.accumulate(value[..., 2], axis=1)[row, column]
        bend = np.where(highest > IN_AIR, np.maximum(bend, FALLING), bend)
    rigid = np.zeros((len(row), 4))
    rigid[:, 0], rigid[:, 1], rigid[:, 2] = 1e-6, USUAL_SPEED**-2, 4.0 / bend**2
    rigid[:, 3] = 36.0 / (REST_JERK + BY_SPEED * speed) ** 2
    normal[:, np.arange(4), np.arange(4)] += rigid
    right = cross[row, column]
    inverse = np.linalg.inv(normal)
    found = inverse @ right
    cost = 0.5 * (square[row, column] - (found * right).sum(axis=(1, 2)))
    return Fits(cuts[begin], cuts[upto] - 1, times[cuts[begin]], coefficients=found, cost=np.maximum(cost, 0.0),
                inverse=inverse)


def find_promising(times: np.ndarray, points: np.ndarray, known: np.ndarray, interval: float) -> np.ndarray:
    """Growing places 0 < k < N where the velocity may change, and 0 and N. points (N, D) with gaps bridged."""
    count = len(times)
    chosen = np.zeros(count + 1, bool)
    for seconds in _SIDES:
        change = velocity_change(points, max(2, round(seconds / interval)), interval)
        top = np.maximum(np.pad(change[1:], (0, 1)), np.pad(change[:-1], (1, 0))) <= change
        peaks = np.flatnonzero(top & (change > _WORTH))
        for near in (-1, 0, 1):
            chosen[np.clip(peaks + near, 1, count - 1)] = True
    chosen[[0, count]] = True
    chosen[np.flatnonzero(np.diff(known.astype(int))) + 1] = True  # gaps begin and end
    places = np.flatnonzero(chosen)
    pause = max(2, round(_PAUSE / interval))
    for first, second in zip(places[:-1], places[1:]):
        chosen[first:second:pause] = True
    return np.flatnonzero(chosen)


def velocity_change(points: np.ndarray, side: int, interval: float) -> np.ndarray:
    """(N + 1,) m/s: how much the slopes of the lines through `side` samples before and after each place differ."""
    count = len(points)
    share = np.arange(side) - (side - 1) / 2.0
    share = share / (share**2).sum() / interval
    change = np.zeros(count + 1)
    if count < 2 * side:
        return change
    windows = np.lib.stride_tricks.sliding_window_view(points, side, axis=0)
    slope = windows @ share
    change[side : count - side + 1] = np.linalg.norm(slope[side:] - slope[:-side], axis=1)
    return change


def choose_cuts(times, points, weights, places, price: float = PRICE) -> np.ndarray:
    """Those of `places` that, as cuts between pieces, explain the samples best (the first and last always)."""
    pieces = fit_between(times, points, weights, places, _LONGEST)
    return places[find_cheapest(pieces, places, price)]


def find_cheapest(pieces: Fits, places: np.ndarray, price: float) -> np.ndarray:
    """Indices into `places` of the cheapest way from the first to the last, each piece paying `price` beside its
    cost."""
    begin = np.searchsorted(places, pieces.first)
    upto = np.searchsorted(places, pieces.last + 1)
    order = np.argsort(upto, kind="stable")
    begin, upto, cost = begin[order], upto[order], pieces.cost[order] + price
    edges = np.searchsorted(upto, np.arange(len(places) + 1))
    best, back = np.zeros(len(places)), np.zeros(len(places), int)
    for place in range(1, len(places)):
        own = slice(edges[place], edges[place + 1])
        total = best[begin[own]] + cost[own]
        choice = int(total.argmin())
        best[place], back[place] = total[choice], begin[own][choice]
    way = [len(places) - 1]
    while way[-1] > 0:
        way.append(back[way[-1]])
    return np.array(way[::-1])
