"""Find which bodies come close to each other and when, and separate tracks that come closer than two trunks allow,
before motions are constructed from them.

The shifts are the least and smoothest ones: they minimise sum SHIFT_WEIGHT (|s|^2 + SHIFT_SECONDS^6 |s'''|^2) over all
bodies, plus the square of the missing distance while two are too close. The direction in which they are pushed turns
with their relative position. Where one runs straight through the other it would reverse abruptly, so the first rounds
smooth it over time, and they pass each other on the side on which they are offset.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import starmap

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.time_series import find_runs
from ...base.vectors import arctan2
from ...motion.track import smooth_zero_phase_hann

DISTANCE = 0.55
"""m between the middles of two bodies that stand or run side by side."""

SHIFT_WEIGHT, SHIFT_SECONDS = 0.003, 0.5
"""Weight of a shift relative to the missing distance, and s in which it fades in and out."""

REACH = 2.5
"""s before and after a meeting within which shifts start and end."""

TOUCH_FIRMNESS = 30.0
"""How much more firmly a player keeps their path while they touch the ball."""

_SMOOTH_SECONDS = (1.0, 1.0, 0.8, 0.8, 0.6, 0.6, 0.4, 0.4, 0.2, 0.2, 0.1,
                   0.1)  # s of smoothing of directions, per round
_ROUNDS, _STEP = 24, 0.5  # directions change as bodies separate, so shifts go half of the way each round
_HOLD_WEIGHT = 1e6  # weight that fixes a value: far above all others

Span = tuple[int, int, tuple[int, int]]
"""First frame, end, and the numbers of two bodies."""


def compute_spacing(
    times: np.ndarray, positions: np.ndarray, firmness: np.ndarray | None = None, distance: float = DISTANCE,
    solve_all: Callable[[Sequence[tuple]], Iterable[np.ndarray]] | None = None,
) -> np.ndarray:
    """Compute the horizontal shifts with which bodies keep their distance.

    Shifts are 0 except around meetings, and at the first and last frame.

    Args:
        times: (N,) s, evenly spaced, ascending.
        positions: (P, N, 2) m, NaN where a player is absent.
        firmness: (P, N) how firmly each keeps their path against the others, 1 by default (`compute_firmness`).
        distance: m, the least distance.
        solve_all: returns `solve_episode` of several arguments, in their order; None solves them here.
    Returns:
        (P, N, 2) m.
    """
    shifts = np.zeros(positions.shape)
    if len(times) < 4:
        return shifts
    fps = (len(times) - 1) / (times[-1] - times[0])
    weights = np.ones(positions.shape[:2]) if firmness is None else firmness
    places = [(list(episode.bodies), slice(episode.first, episode.end), episode)
              for episode in find_episodes(positions, distance, round(REACH * fps))]
    tasks = [(episode, positions[bodies, span], weights[bodies, span], distance, fps)
             for bodies, span, episode in places]
    for (bodies, span, _), found in zip(places, solve_all(tasks) if solve_all else starmap(solve_episode, tasks)):
        shifts[bodies, span] = found
    return np.where(np.isfinite(positions), shifts, 0.0)


def compute_firmness(count: int, moments: np.ndarray, fps: float, seconds: float = 0.6) -> np.ndarray:
    """Compute how firmly a player keeps their path around touches of the ball.

    Args:
        count: T frames.
        moments: (K,) frames of the touches.
        fps: frames per second.
        seconds: s before and after a touch over which the firmness falls to 1.
    Returns:
        (T,) TOUCH_FIRMNESS at touches, 1 far from them.
    """
    if not len(moments):
        return np.ones(count)
    distance = np.abs(np.arange(count)[:, None] - np.asarray(moments)).min(axis=1) / (seconds * fps)
    return 1.0 + (TOUCH_FIRMNESS - 1.0) * np.cos(0.5 * np.pi * np.clip(distance, 0.0, 1.0)) ** 2


@dataclass(frozen=True)
class Episode:
    """Bodies that come close to each other, directly or through a third.

    Attributes:
        bodies: their indices, ascending.
        first: first frame.
        end: end frame.
        pairs: (one, other) of those that come close.
    """

    bodies: tuple[int, ...]
    first: int
    end: int
    pairs: tuple[tuple[int, int], ...]


def find_episodes(positions: np.ndarray, distance: float, reach: int) -> list[Episode]:
    """Find all times at which two bodies come too close.

    Args:
        positions: (P, N, 2) m, NaN where a player is absent.
        distance: m, the least distance.
        reach: frames added before and after.
    Returns:
        The episodes: spans that overlap in time and share a body are one.
    """
    found = []
    for one in range(len(positions) - 1):
        off = positions[one + 1 :] - positions[one]
        near = np.einsum("pnk,pnk->pn", off, off) < distance**2
        for other in np.flatnonzero(near.any(axis=1)):
            pair = (one, one + 1 + int(other))
            found += [(max(low - reach, 0), min(high + reach, len(near[0])), pair) for low,
                      high in find_runs(near[other])]
    return join_spans(found)


def join_spans(spans: list[Span]) -> list[Episode]:
    """Join spans (first frame, end, pair) that overlap in time and share a body into episodes."""
    groups: list[tuple[int, int, set, set]] = []
    for first, end, pair in sorted(spans):
        bodies, pairs = set(pair), {pair}
        while overlapping := [g for g in groups if g[0] < end and first < g[1] and g[2] & bodies]:  # may meet more
            groups = [g for g in groups if not any(g is other for other in overlapping)]
            for low, high, others, other_pairs in overlapping:
                first, end, bodies, pairs = min(first, low), max(end, high), bodies | others, pairs | other_pairs
        groups.append((first, end, bodies, pairs))
    whole = [Episode(tuple(sorted(bodies)), first, end, tuple(sorted(pairs))) for first, end, bodies, pairs in groups]
    return sorted(whole, key=lambda episode: (episode.first, episode.bodies))


def find_meetings(spans: list[Span], past_spans: list[Span]) -> list[Episode]:
    """Find the episodes of these spans, with all bodies they meet at the same time.

    A body is then not pushed into one that is not part of the solution.

    Args:
        spans: spans to resolve.
        past_spans: all spans known so far, which may bring in more bodies, and in turn those they meet.
    Returns:
        The episodes.
    """
    spans = list(spans)
    while True:
        found = join_spans(spans)
        more = [
            (max(first, episode.first), min(end, episode.end), pair) for episode in found for first, end,
            pair in past_spans if first < episode.end and episode.first < end and set(pair) & set(episode.bodies)
            and pair not in episode.pairs
        ]
        if not more:
            return found
        spans += more


def solve_episode(episode: Episode, places: np.ndarray, firmness: np.ndarray, distance: float,
                  fps: float) -> np.ndarray:
    """Solve the shifts of one episode's bodies.

    Args:
        episode: K bodies that come close to each other, for T frames.
        places: (K, T, 2) m.
        firmness: (K, T) how firmly each keeps their path.
        distance: m, the least distance.
        fps: frames per second.
    Returns:
        (K, T, 2) m.
    """
    bodies, count = len(places), places.shape[1]
    smoothness = _build_smoothness(firmness, fps)
    number = {body: row for row, body in enumerate(episode.bodies)}
    pairs = [(number[one], number[other]) for one, other in episode.pairs]
    shifts = np.zeros(places.shape)
    for round_number in range(_ROUNDS):
        seconds = _SMOOTH_SECONDS[round_number] if round_number < len(_SMOOTH_SECONDS) else 0.0
        rows = [_build_distance_rows(places, shifts, pair, distance=distance, seconds=seconds, fps=fps)
                for pair in pairs]
        index, values, goal = (np.concatenate(parts) for parts in zip(*rows))
        if not len(index):
            break
        squares = smoothness.copy()
        squares.add_rows(index, values, np.ones(len(index)), goal)
        least = squares.solve().reshape(count, bodies, 2).transpose(1, 0, 2)
        shifts = shifts + _STEP * (least - shifts)
    return shifts


def _build_smoothness(firmness: np.ndarray, fps: float) -> BandedLeastSquares:
    """Build the squares that keep shifts small and smooth, and hold both ends; firmness (K, T)."""
    squares = BandedLeastSquares(firmness.shape[1], 2 * len(firmness))
    hold_weights = np.zeros(firmness.shape[1])
    hold_weights[:2], hold_weights[-2:] = _HOLD_WEIGHT, _HOLD_WEIGHT
    for body, weight in enumerate(firmness):
        for axis in (0, 1):
            squares.add_value(SHIFT_WEIGHT * weight + hold_weights, 2 * body + axis)
            squares.add_smoothness(SHIFT_WEIGHT * (SHIFT_SECONDS * fps) ** 6 * weight, 2 * body + axis)
    return squares


def _build_distance_rows(
    places: np.ndarray, shifts: np.ndarray, pair: tuple[int, int], distance: float, seconds: float, fps: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build the rows of one pair for `BandedLeastSquares.add_rows`: where it is too close, in which direction and how
    far it has to separate; directions are smoothed over `seconds`.
    """
    one, other = pair
    bodies = len(places)
    offset = places[one] + shifts[one] - places[other] - shifts[other]
    near = np.einsum("tk,tk->t", offset, offset) < distance**2
    directions, needs = np.zeros(offset.shape), np.zeros(len(offset))
    for low, high in find_runs(near):
        part = offset[low:high]
        angle = np.unwrap(arctan2(part[:, 1], part[:, 0]))
        if seconds and high - low > 2:
            angle = smooth_zero_phase_hann(angle[:, None], fps, seconds)[:, 0]
        direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        along = np.einsum("tk,tk->t", direction, part)
        # Solve |part + need * direction| = distance for the need.
        needs[low:high] = np.sqrt(along**2 + distance**2 - np.einsum("tk,tk->t", part, part)) - along
        directions[low:high] = direction
    frame = np.flatnonzero(near)
    direction, need = directions[frame], np.minimum(needs[frame], distance)
    # Unknown number of body b, axis a at frame t: (t * bodies + b) * 2 + a.
    index = (frame * 2 * bodies)[:, None] + np.array([2 * one, 2 * one + 1, 2 * other, 2 * other + 1])
    shift = (shifts[one] - shifts[other])[frame]
    return index, np.concatenate([direction, -direction], axis=1), need + np.einsum("tk,tk->t", direction, shift)
