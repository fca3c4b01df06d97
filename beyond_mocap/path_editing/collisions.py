"""Collisions of bodies: which, when, where and how close, exactly, between frames too.

A body is an upright capsule on its place on the ground: a segment of `height` less its own thickness, with `distance`
as the least gap between two such segments. So bodies on two floors, or one on a bridge, do not collide. Between two
frames each body moves in a straight line; the gap is then a convex function of time with at most three pieces (one body
below the other, level, above), and its minimum and the times at which it crosses `distance` are those of quadratics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

HEIGHT = 1.8
"""Metres of an upright body."""
DISTANCE = 0.6
"""Metres between the middles of two bodies at which their shoulders begin to touch."""
_JUMP = 15.0  # m/s: faster than anyone runs; such a step is a motion that restarts elsewhere


@dataclass(frozen=True, kw_only=True)
class Collision:
    """Two bodies nearer than the required distance, without interruption.

    Attributes:
        first: number of one body.
        second: number of the other, first < second.
        start: seconds.
        end: seconds.
        time: seconds, when they are nearest.
        gap: metres between them then.
        place: (3,) metres, the middle between both then, world frame.
    """

    first: int
    second: int
    start: float
    end: float
    time: float
    gap: float
    place: tuple[float, float, float]


def find_collisions(times: np.ndarray, places: np.ndarray, distance: float = DISTANCE, height: float = HEIGHT) -> list:
    """Find all collisions, by time.

    Args:
        times: (T,) seconds, rising.
        places: (N, T, 3) metres on the ground, world frame.
        distance: metres below which two bodies collide.
        height: metres of a body.
    Returns:
        List of `Collision`.
    """
    found = []
    for first in range(len(places) - 1):
        found += find_collisions_of(first, range(first + 1, len(places)), times, places=places, distance=distance,
                                    height=height)
    return sorted(found, key=lambda collision: (collision.start, collision.first, collision.second))


def find_collisions_of(body: int, others, times, places, distance: float = DISTANCE, height: float = HEIGHT) -> list:
    """Find the collisions of one body with others.

    Args:
        body: number of the body.
        others: numbers of the others.
        times: (T,) seconds, rising.
        places: (N, T, 3) metres, world frame.
        distance: metres below which two bodies collide.
        height: metres of a body.
    Returns:
        List of `Collision`.
    """
    others = np.asarray([other for other in others if other != body], dtype=int)
    if len(times) < 2 or not len(others):
        return []
    rows, steps = np.indices((len(others), len(times) - 1)).reshape(2, -1)
    return find_collisions_at(body, others[rows], steps, times=times, places=places, distance=distance, height=height)


def find_collisions_at(body: int, others, steps, times, places, distance: float = DISTANCE,
                       height: float = HEIGHT) -> list:
    """Find the collisions of one body with others within given steps.

    Args:
        body: number of the body.
        others: (M,) numbers of the others, equal ones together.
        steps: (M,) step s from frame s to s + 1, rising for each body.
        times: (T,) seconds, rising.
        places: (N, T, 3) metres, world frame.
        distance: metres below which two bodies collide.
        height: metres of a body.
    Returns:
        List of `Collision`.
    """
    off = places[others, steps] - places[body, steps]
    move = places[others, steps + 1] - places[body, steps + 1] - off
    reach = distance + np.sqrt(move[:, 0] ** 2 + move[:, 1] ** 2)
    # A quick test first: only pairs that their relative movement within the step can bring together.
    near = np.flatnonzero(off[:, 0] ** 2 + off[:, 1] ** 2 <= reach**2)
    others, steps, off, move = others[near], steps[near], off[near], move[near]
    goes = ~(_find_jumps(body, steps, times, places) | _find_jumps(others, steps, times, places))
    enter, leave, nearest, gap = compute_gaps(off, move, distance, max(height - distance, 0.0))
    hit = goes & (gap < distance)
    found = []
    for other in np.unique(others[hit]):
        of = hit & (others == other)
        pair = [min(body, other), max(body, other)]
        found += _join_steps(pair, steps[of], enter[of], leave=leave[of], nearest=nearest[of], gap=gap[of], times=times,
                             places=places)
    return found


def _find_jumps(bodies, steps, times, places):
    """Return which steps (M,) of these bodies are jumps, not movement."""
    step = places[bodies, steps + 1] - places[bodies, steps]
    return np.einsum("mk,mk->m", step, step) > (_JUMP * (times[steps + 1] - times[steps])) ** 2


def _join_steps(pair, steps, enter, leave, nearest, gap, times, places):
    """Join the steps of one pair to collisions, where one continues in the next step."""
    found = []
    breaks = np.flatnonzero((np.diff(steps) > 1) | (leave[:-1] < 1.0) | (enter[1:] > 0.0)) + 1
    for part in np.split(np.arange(len(steps)), breaks):
        best = part[np.argmin(gap[part])]
        span = [times[step] + share * (times[step + 1] - times[step])
                for step, share in ((steps[part[0]], enter[part[0]]), (steps[part[-1]], leave[part[-1]]))]
        step, share = steps[best], nearest[best]
        both = places[pair, step] * (1 - share) + places[pair, step + 1] * share
        when = times[step] + share * (times[step + 1] - times[step])
        found.append(Collision(first=int(pair[0]), second=int(pair[1]), start=float(span[0]), end=float(span[1]),
                               time=float(when), gap=float(gap[best]), place=tuple(map(float, both.mean(axis=0)))))
    return found


def compute_gaps(off: np.ndarray, move: np.ndarray, distance: float, span: float):
    """Compute when two bodies are nearest within a step, and when they come and leave.

    Args:
        off: (M, 3) metres, offset of one body from the other at the start of the step.
        move: (M, 3) metres, change of the offset during the step.
        distance: metres below which two bodies collide.
        span: metres of the vertical segments.
    Returns:
        Shares (M,) of the step at which the gap falls below and rises above `distance` (meaningless if it stays above),
        at which it is smallest, and the smallest gap (M,) metres.
    """
    if not len(off) or max(np.abs(off[:, 2]).max(), np.abs(off[:, 2] + move[:, 2]).max()) <= span:  # all on one level
        level, always = np.array([1.0, 1.0, 0.0]), np.zeros(len(off))
        nearest, gap, enter, leave = _minimize_gap(off * level, move * level, always, always + 1.0, distance)
        return enter, leave, nearest, gap
    enter, leave = np.full(len(off), np.inf), np.full(len(off), -np.inf)
    nearest, gap = np.zeros(len(off)), np.full(len(off), np.inf)
    # Three pieces: segments overlap in height (no vertical gap), the other body above, the other body below.
    for low, high, shift in ((-span, span, None), (span, np.inf, span), (-np.inf, -span, -span)):
        begin, end = _find_interval(off[:, 2], move[:, 2], low, high)
        level = np.array([1.0, 1.0, 0.0 if shift is None else 1.0])
        start, change = (off - np.array([0.0, 0.0, shift or 0.0])) * level, move * level
        at, least, into, out = _minimize_gap(start, change, begin, end, distance)
        better = least < gap
        nearest, gap = np.where(better, at, nearest), np.where(better, least, gap)
        enter, leave = np.minimum(enter, into), np.maximum(leave, out)
    return enter, leave, nearest, gap


def compute_least_gaps(first, second, distance: float = DISTANCE, height: float = HEIGHT) -> np.ndarray:
    """Compute the smallest gap between pairs of bodies.

    Args:
        first: (A, T, 3) metres, or (1, T, 3).
        second: (A, T, 3) metres, or (1, T, 3).
        distance: metres below which two bodies collide.
        height: metres of a body.
    Returns:
        (A,) metres.
    """
    off = second - first
    move = np.diff(off, axis=1).reshape(-1, 3)
    gap = compute_gaps(off[:, :-1].reshape(-1, 3), move, distance, max(height - distance, 0.0))[3]
    return gap.reshape(len(off), -1).min(axis=1, initial=np.inf)


def _find_interval(value, change, low, high):
    """Find the shares (M,), (M,) of a step between which value + share * change lies in [low, high]; empty: first >
    last.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = (low - value) / change, (high - value) / change
    is_constant = change == 0.0
    inside = (value >= low) & (value <= high)
    first, last = np.minimum(first, last), np.maximum(first, last)
    first = np.where(is_constant, np.where(inside, 0.0, 2.0), np.maximum(first, 0.0))
    last = np.where(is_constant, np.where(inside, 1.0, -1.0), np.minimum(last, 1.0))
    return first, last


def _minimize_gap(start, change, begin, end, distance):
    """Minimize |start + share * change| for shares in [begin, end], and find where it is below `distance`."""
    a, b = np.einsum("mk,mk->m", change, change), np.einsum("mk,mk->m", start, change)
    empty = begin > end
    at = np.divide(-b, a, out=np.zeros_like(a), where=a > 0)
    at = np.where(empty, 0.0, np.minimum(np.maximum(at, begin), end))
    least = np.linalg.norm(start + at[:, None] * change, axis=1)
    # The discriminant of |start + share * change|^2 = distance^2.
    room = b**2 - a * (np.einsum("mk,mk->m", start, start) - distance**2)
    root = np.sqrt(np.maximum(room, 0.0))
    into, out = (np.divide(-b + sign * root, a, out=np.full_like(a, sign * np.inf), where=a > 0) for sign in (-1, 1))
    into, out = (np.minimum(np.maximum(share, begin), end) for share in (into, out))
    separated = empty | (least >= distance)
    return at, np.where(empty, np.inf, least), np.where(separated, np.inf, into), np.where(separated, -np.inf, out)
