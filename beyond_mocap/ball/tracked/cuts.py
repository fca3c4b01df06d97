"""Where the ball's course may change: a small set of cuts that holds every real change and more.

A cut k lies between the samples k - 1 and k. First each place between two samples is judged by how much the lines
through the samples before and after it differ; then dynamic programming chooses, among the promising ones, those that
explain the samples by smooth pieces, with a low price per cut. What a cut is (a touch, a bounce, nothing) is decided
later, with the players.
"""

from __future__ import annotations

import numpy as np

from .pieces import Fits, fit_between

_SIDES = (0.12, 0.28)  # seconds looked at on either side
_WORTH = 0.9  # m/s, the least change of velocity looked at
_LONGEST = 2.4  # seconds of a piece here
_PAUSE = 0.8  # seconds after which a place is offered in any case
PRICE = 5.0  # nats for one more cut here


def promising(times: np.ndarray, points: np.ndarray, known: np.ndarray, interval: float) -> np.ndarray:
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
    return places[cheapest(pieces, places, price)]


def cheapest(pieces: Fits, places: np.ndarray, price: float) -> np.ndarray:
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
