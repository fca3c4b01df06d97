"""Fit smooth cubic pieces to runs of the ball's samples, and choose the cuts between them.

A piece is x(t) = p + v t + a t^2 / 2 + j t^3 / 6 from its first moment on. Only friction, drag and (in the air) gravity
bend it: a and j are held near zero relative to their usual size at the piece's speed. So a short piece is nearly a
line, and a slow ball that gains speed was touched.

Cut k lies between the samples k - 1 and k. A small set of cuts contains every real change of velocity and more: each
place between two samples is rated by how much the lines through the samples before and after it differ; then dynamic
programming chooses the cuts that explain the samples by smooth pieces, with a low cost per cut. What a cut is (a touch,
a bounce, nothing) is decided later, with the players.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

USUAL_SPEED = 20.0  # m/s
REST_ACCELERATION, REST_JERK = 2.0, 2.0  # m/s^2, m/s^3, usual for a ball that hardly moves
BY_SPEED = 0.35  # 1/s, 1/s^2, growth of both with its speed
IN_AIR, FALLING = 0.5, 9.0  # m, above this the ball falls; m/s^2
_CHUNK = 400  # starts fitted together, to limit memory

_SIDE_SECONDS = (0.12, 0.28)  # s of the lines on either side
_MIN_CHANGE = 0.9  # m/s, least change of velocity of a candidate
_LONGEST = 2.4  # s of a piece while cuts are chosen
_PAUSE = 0.8  # s without a candidate after which one is added
CUT_COST = 5.0  # nats for each cut while cuts are chosen


@dataclass(frozen=True, eq=False)
class PieceFits:
    """K pieces over the samples first[k] .. last[k] (inclusive).

    Attributes:
        first: (K,) index of the first sample.
        last: (K,) index of the last sample.
        begin: (K,) s, the time origin of each piece.
        coefficients: (K, 4, D): p, v, a/2, j/6.
        cost: (K,) nats, half the sum of weighted squares.
        inverse: (K, 4, 4) covariance of one coordinate's coefficients.
    """

    first: np.ndarray
    last: np.ndarray
    begin: np.ndarray
    coefficients: np.ndarray
    cost: np.ndarray
    inverse: np.ndarray

    def __len__(self) -> int:
        return len(self.first)

    def select_rows(self, which) -> PieceFits:
        """Select some of the pieces."""
        return PieceFits(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def position(self, time: np.ndarray, which=slice(None)) -> np.ndarray:
        """Give the position (n, D) m at `time` (n,) s, each of its own piece."""
        return np.einsum("ni,nid->nd", build_powers(time - self.begin[which]), self.coefficients[which])

    def velocity(self, time: np.ndarray, which=slice(None)) -> np.ndarray:
        """Give the velocity (n, D) m/s at `time` (n,) s, each of its own piece."""
        return np.einsum("ni,nid->nd", build_power_slopes(time - self.begin[which]), self.coefficients[which])

    def spread(self, time: np.ndarray, which=slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Give the variances (n,) of one coordinate's position and velocity at `time` (n,) s."""
        since = time - self.begin[which]
        place, speed, inverse = build_powers(since), build_power_slopes(since), self.inverse[which]
        return (np.einsum("ni,nij,nj->n", place, inverse, place), np.einsum("ni,nij,nj->n", speed, inverse, speed))


def build_powers(since: np.ndarray) -> np.ndarray:
    """Build (n, 4): 1, t, t^2, t^3."""
    return since[:, None] ** np.arange(4)


def build_power_slopes(since: np.ndarray) -> np.ndarray:
    """Build (n, 4): the derivatives of 1, t, t^2, t^3."""
    one = np.ones_like(since)
    return np.stack([0.0 * one, one, 2.0 * since, 3.0 * since**2], axis=1)


def fit_between(times: np.ndarray, points: np.ndarray, weights: np.ndarray, cuts: np.ndarray, longest: float,
                steps: int | None = None) -> PieceFits:  # fmt: skip
    """Fit pieces between all pairs of cuts that are close enough.

    Args:
        times: (N,) s.
        points: (N, D) m, any number where the weight is zero.
        weights: (N,) 1/m^2.
        cuts: (C,) ascending indices; a piece between cuts a and b has the samples a .. b - 1.
        longest: s, the longest piece; neighbouring cuts always form a piece.
        steps: the most cuts one piece may leave out. None: any.
    Returns:
        The pieces, grouped by their first cut.
    """
    parts = []
    for low in range(0, len(cuts) - 1, _CHUNK):
        starts = np.arange(low, min(low + _CHUNK, len(cuts) - 1))
        end = np.searchsorted(times[np.minimum(cuts, len(times) - 1)], times[cuts[starts]] + longest, "right") - 1
        if steps is not None:
            end = np.minimum(end, starts + steps)
        end = np.maximum(np.minimum(end, len(cuts) - 1), starts + 1)
        counts = end - starts
        begin = np.repeat(starts, counts)
        # For start s the ends s + 1 .. end: a running count that restarts with each start.
        upto = begin + 1 + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        parts.append(_fit_group(times, points, weights, cuts=cuts, begin=begin, upto=upto))
    names = PieceFits.__dataclass_fields__
    return PieceFits(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _fit_group(times, points, weights, cuts, begin, upto) -> PieceFits:
    """Fit the pieces between cuts begin[k] and upto[k], whose starts are a few neighbouring cuts.

    The sums of all pieces that share a start are prefixes of one cumulative sum over its samples.
    """
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
    # normal[i, j] = sum of w t^(i + j); `rigid` adds the prior on each coefficient.
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
    return PieceFits(cuts[begin], cuts[upto] - 1, times[cuts[begin]], coefficients=found, cost=np.maximum(cost, 0.0),
                     inverse=inverse)


def find_candidate_cuts(times: np.ndarray, points: np.ndarray, known: np.ndarray, interval: float) -> np.ndarray:
    """Find candidate cuts where the velocity may change.

    Args:
        times: (N,) s.
        points: (N, D) m, gaps bridged.
        known: (N,) bool, samples the feed has.
        interval: s between samples.
    Returns:
        Ascending indices 0 < k < N, with 0 and N added.
    """
    count = len(times)
    chosen = np.zeros(count + 1, bool)
    for seconds in _SIDE_SECONDS:
        change = measure_velocity_change(points, max(2, round(seconds / interval)), interval)
        top = np.maximum(np.pad(change[1:], (0, 1)), np.pad(change[:-1], (1, 0))) <= change
        peaks = np.flatnonzero(top & (change > _MIN_CHANGE))
        for near in (-1, 0, 1):
            chosen[np.clip(peaks + near, 1, count - 1)] = True
    chosen[[0, count]] = True
    chosen[np.flatnonzero(np.diff(known.astype(int))) + 1] = True  # where gaps start and end
    places = np.flatnonzero(chosen)
    pause = max(2, round(_PAUSE / interval))
    for first, second in zip(places[:-1], places[1:]):
        chosen[first:second:pause] = True
    return np.flatnonzero(chosen)


def measure_velocity_change(points: np.ndarray, side: int, interval: float) -> np.ndarray:
    """Measure how much the slopes of the lines before and after each place differ.

    Args:
        points: (N, D) m.
        side: samples in each line.
        interval: s between samples.
    Returns:
        (N + 1,) m/s, zero near both ends.
    """
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


def choose_cuts(times, points, weights, places) -> np.ndarray:
    """Choose the cuts between pieces that explain the samples best.

    Args:
        times: (N,) s.
        points: (N, D) m.
        weights: (N,) 1/m^2.
        places: candidate cuts, ascending; the first and last always stay.
    Returns:
        The chosen places.
    """
    pieces = fit_between(times, points, weights, places, _LONGEST)
    return places[find_lowest_cost_cuts(pieces, places, CUT_COST)]


def find_lowest_cost_cuts(pieces: PieceFits, places: np.ndarray, cut_cost: float) -> np.ndarray:
    """Find the chain of pieces with the lowest cost, by dynamic programming.

    Args:
        pieces: the pieces between all pairs of places.
        places: candidate cuts, ascending.
        cut_cost: nats added per piece.
    Returns:
        Indices into `places`, from the first to the last.
    """
    begin = np.searchsorted(places, pieces.first)
    upto = np.searchsorted(places, pieces.last + 1)
    order = np.argsort(upto, kind="stable")
    begin, upto, cost = begin[order], upto[order], pieces.cost[order] + cut_cost
    # Pieces sorted by their end: those that end at place p are edges[p] .. edges[p + 1].
    edges = np.searchsorted(upto, np.arange(len(places) + 1))
    best, back = np.zeros(len(places)), np.zeros(len(places), int)
    for place in range(1, len(places)):
        own = slice(edges[place], edges[place + 1])
        total = best[begin[own]] + cost[own]
        choice = int(total.argmin())
        best[place], back[place] = total[choice], begin[own][choice]
    chain = [len(places) - 1]
    while chain[-1] > 0:
        chain.append(back[chain[-1]])
    return np.array(chain[::-1])
