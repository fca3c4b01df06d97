"""Where a body stays that moves slower than its track can be measured.

Tracks are off by some 8 cm, and below 1 m/s that noise is larger than what they say: a body that followed it would
never stand still. So a slow track is smoothed more, and where it stays within a small box for a while, the body rests
in the middle of that box.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...base.easing import smoothstep
from ...base.time_series import find_runs
from .data import SampledTrack
from .sampling import compute_travel_direction, smooth_zero_phase_hann

REST_HALF_DIAGONAL = 0.10
"""Metres from the middle to a corner of the box of a stand. Tracks of standing players wander by 8 cm; with 14 cm the
root was 12.7 cm off at the 95th percentile below 1 m/s, beyond the 12 cm that are allowed."""

LEAVE_DISTANCE = 0.10
"""Metres from a stand's middle at which a body leaves it, or comes to it."""

MOST_DISTANCE = 0.11
"""Metres from the smoothed track that a body stays within, also where a sharp turn of the track is smoothed away; with
LEAST_LEEWAY that is 12 cm, the most that docs/reference/report-figures.md allows."""

LEAST_LEEWAY, MOST_LEEWAY = 0.01, 0.04
"""Metres that a body may always stay off its planned place so that its feet rest, and that it may at most."""

MIN_REST_SECONDS = 0.6
"""Shortest stand; shorter ones are turning points of a walk."""

SLOW_WINDOW, FAST_WINDOW = 1.6, 1.2  # s of the plain window below the first of _MIXED_SPEEDS and of the corrected one
_MIXED_SPEEDS = (0.4, 1.0)  # m/s between which one passes into the other
_SPEED_WINDOW = 0.8  # s that smooth the speed which mixes them
_FADE_SECONDS = 0.5  # s over which a body comes to rest


def relax_track(track: SampledTrack) -> SampledTrack:
    """Let the body of a track rest where the track hardly moves.

    Above 1 m/s nothing changes; below, positions pass through a plain window of 1.6 s, and are constant in stands.

    Args:
        track: T frames.
    Returns:
        The same with other positions and what follows from them; `raw` has them too, since the body is held to it.
    """
    if len(track) < 3:
        return replace(track, leeway=np.full(len(track), LEAST_LEEWAY))
    positions = relax_positions(track.positions, track.raw, track.fps)
    velocity = np.gradient(positions, 1.0 / track.fps, axis=0, edge_order=2)
    raw = np.where(np.any(positions != track.positions, axis=1, keepdims=True), positions, track.raw)
    used = np.linalg.norm(positions - track.positions, axis=1)
    return replace(track, positions=positions, raw=raw, velocity=velocity, speed=np.linalg.norm(velocity, axis=1),
                   direction=compute_travel_direction(velocity, track.fps),
                   leeway=np.clip(LEAVE_DISTANCE - used, LEAST_LEEWAY, MOST_LEEWAY))


def relax_positions(fast: np.ndarray, measured: np.ndarray, fps: float) -> np.ndarray:
    """Smooth slow positions more, and let a body rest where they hardly move.

    Args:
        fast: (T, 2) m, smoothed for a moving body (`sampling.smooth_positions`).
        measured: (T, 2) m, as measured.
        fps: frames per second.
    Returns:
        (T, 2) m.
    """
    velocity = np.gradient(smooth_zero_phase_hann(measured, fps, FAST_WINDOW), 1.0 / fps, axis=0)
    speed = smooth_zero_phase_hann(np.linalg.norm(velocity, axis=1)[:, None], fps, _SPEED_WINDOW)
    share = smoothstep((speed - _MIXED_SPEEDS[0]) / (_MIXED_SPEEDS[1] - _MIXED_SPEEDS[0]))
    mixed = share * fast + (1.0 - share) * smooth_zero_phase_hann(measured, fps, SLOW_WINDOW)
    to_rest = np.zeros_like(mixed)
    for first, end, middle in _extend_rests(mixed, find_rests(mixed, fps)):
        to_rest[first:end] = middle - mixed[first:end]
    return fast + _limit_softly(mixed + smooth_zero_phase_hann(to_rest, fps, _FADE_SECONDS) - fast)


def _limit_softly(offset: np.ndarray) -> np.ndarray:
    """Limit offsets (T, 2) m softly to MOST_DISTANCE; up to LEAVE_DISTANCE they do not change."""
    length, room = np.linalg.norm(offset, axis=1, keepdims=True), MOST_DISTANCE - LEAVE_DISTANCE
    over = np.maximum(length - LEAVE_DISTANCE, 0.0)
    return offset * (np.minimum(length, LEAVE_DISTANCE) + room * np.tanh(over / room)) / np.maximum(length, 1e-9)


def _extend_rests(positions: np.ndarray, rests: list[tuple[int, int]]) -> Iterator[tuple[int, int, np.ndarray]]:
    """Extend each rest to where the positions have really gone somewhere: first frame, end, and middle (2,) m."""
    free_from = 0
    for number, (first, end) in enumerate(rests):
        middle = 0.5 * (positions[first:end].min(axis=0) + positions[first:end].max(axis=0))
        free_until = rests[number + 1][0] if number + 1 < len(rests) else len(positions)
        gone_before, gone_after = (np.flatnonzero(np.linalg.norm(part - middle, axis=1) > LEAVE_DISTANCE)
                                   for part in (positions[free_from:first], positions[end:free_until]))
        begin = free_from + int(gone_before[-1]) + 1 if len(gone_before) else free_from
        free_from = end + int(gone_after[0]) if len(gone_after) else free_until
        yield begin, free_from, middle


def find_rests(positions: np.ndarray, fps: float, seconds: float = MIN_REST_SECONDS) -> list[tuple[int, int]]:
    """Find the stretches in which positions stay within a small box: the longest first, without overlap.

    Args:
        positions: (T, 2) m.
        fps: frames per second.
        seconds: of the shortest stretch.
    Returns:
        (first, end) frames, in order of time.
    """
    found: list[tuple[int, int]] = []
    least = max(int(round(seconds * fps)), 2)
    length = measure_rest_lengths(positions, REST_HALF_DIAGONAL, least)
    queue: list[tuple[int, int, int, int]] = []
    _push_longest(queue, length, 0, len(positions))
    while queue and -queue[0][0] >= least:
        negative, start, first, end = heapq.heappop(queue)
        found.append((start, start - negative))
        # what is left before and behind it
        _push_longest(queue, length, first, start)
        _push_longest(queue, length, start - negative, end)
    return sorted(found)


def _push_longest(queue: list[tuple[int, int, int, int]], length: np.ndarray, first: int, end: int) -> None:
    """Push the longest stretch that begins and ends within first .. end: minus its length, its start, and both."""
    if end > first:
        inside = np.minimum(length[first:end], end - np.arange(first, end))
        best = int(np.argmax(inside))
        heapq.heappush(queue, (-int(inside[best]), first + best, first, end))


def measure_rest_lengths(positions: np.ndarray, half_diagonal: float, least: int = 1) -> np.ndarray:
    """Measure for every frame how many frames from it on fit the box.

    Args:
        positions: (T, 2) m.
        half_diagonal: m from the box's middle to its corner.
        least: frames; what is shorter may be given as 0. It costs much less where a player hardly rests.
    Returns:
        (T,) int.
    """
    out, limit = np.zeros(len(positions), dtype=int), (2.0 * half_diagonal) ** 2
    places = np.ascontiguousarray(positions.T)
    for first, end in find_runs(_may_rest(places, limit, least)):
        # from the frame behind the run on no `least` frames fit, so no box of the run ends later than that
        out[first:end] = _measure_run(places[:, first : end + least], end - first, limit)
    return out


def _may_rest(places: np.ndarray, limit: float, least: int) -> np.ndarray:
    """Return (T,) bool: frames from which on so many of places (2, T) fit the box with the squared diagonal `limit`."""
    may, count = np.zeros(places.shape[1], bool), places.shape[1] - least + 1
    if count > 0:
        *_, (size, low, high) = (one for one in _iter_extremes(places) if one[0] <= least)
        last = slice(least - size, least - size + count)  # two stretches of a power of two that overlap
        may[:count] = _fits(np.minimum(low[:, :count], low[:, last]), np.maximum(high[:, :count], high[:, last]), limit)
    return may


def _measure_run(places: np.ndarray, count: int, limit: float) -> np.ndarray:
    """Measure how many frames fit the box from each of the first `count` frames of places (2, N) on.

    A box grows with its frames, so each length is put together from powers of two, the largest first.
    """
    at, length = np.arange(count), np.zeros(count, dtype=int)
    lowest, highest = np.full((2, count), np.inf), np.full((2, count), -np.inf)
    for size, low, high in reversed(list(_iter_extremes(places))):
        ahead = at + length
        inside = np.minimum(ahead, low.shape[1] - 1)
        lower = np.minimum(lowest, low.take(inside, axis=1))
        higher = np.maximum(highest, high.take(inside, axis=1))
        fits = (ahead == inside) & _fits(lower, higher, limit)
        length[fits] += size
        lowest, highest = np.where(fits, lower, lowest), np.where(fits, higher, highest)
    return length


def _iter_extremes(places: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Yield each power of two, and the least and the greatest places (2, N) of so many frames from each one on."""
    size, low, high = 1, places, places
    while low.shape[1]:
        yield size, low, high
        low, high = np.minimum(low[:, :-size], low[:, size:]), np.maximum(high[:, :-size], high[:, size:])
        size *= 2


def _fits(low: np.ndarray, high: np.ndarray, limit: float) -> np.ndarray:
    """Return (N,) bool: whether boxes from low (2, N) to high (2, N) have at most the squared diagonal `limit`."""
    across, along = high - low
    return across**2 + along**2 <= limit
