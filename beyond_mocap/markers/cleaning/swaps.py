"""Label swaps: two markers that have each other's label for a stretch, found by their clusters and trajectories.

Exchanged labels deform the clusters around them, and exchanging them back removes the deformation; both are required.
Where there is no cluster, two leaps in which each marker continues where the other one was, there and back, are
sufficient evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...base.time_series import find_runs
from ..rigid_fit import fit_rigid, place_points
from .carriers import CarriedMarker
from .cluster_shape import compute_median

# an exchange must reduce the deformation to this share and by this many metres
_MAX_REMAINING_SHARE, _MIN_REDUCTION = 0.6, 0.008
_MIN_DEFORMATION_RATIO = 2.0  # multiples of the usual deformation that it must exceed before
# afterwards it must be at most so many metres, or multiples of the usual, or this share of that before
_GOOD_DEFORMATION, _GOOD_RATIO, _GOOD_SHARE = 0.015, 2.5, 0.25
_TEST_INTERVAL = 0.025  # s between frames of the slow tests; a shorter swap is only found by its leaps
# two markers leap onto each other's trajectories at this distance in metres, if they miss them by at most this share
_MIN_SWAP_DISTANCE, _MAX_MISS_SHARE = 0.03, 0.4
_MAX_SWAPS = 200  # with more, something else is wrong

Pairs = tuple[tuple[int, int], ...]


class Swap(NamedTuple):
    """Markers that had each other's labels.

    Attributes:
        pairs: the pairs of markers.
        first: first frame.
        end: the frame after the last.
        is_corrected: whether they were exchanged back; else only reported.
    """

    pairs: Pairs
    first: int
    end: int
    is_corrected: bool


def exchange_markers(positions: np.ndarray, pairs: Pairs) -> np.ndarray:
    """Exchange each pair's markers in positions (T, M, 3)."""
    order = np.arange(positions.shape[1])
    for one, other in pairs:
        order[one], order[other] = other, one
    return positions[:, order]


def correct_double_leaps(positions: np.ndarray, carried: Mapping[int, CarriedMarker]) -> tuple[np.ndarray, list[Swap]]:
    """Correct pairs that leap onto each other's trajectories twice.

    Between the leaps they are exchanged, unless their clusters show that they are before and after.

    Args:
        positions: (T, M, 3) metres.
        carried: marker -> how it is carried.
    Returns:
        The corrected positions, and the swaps.
    """
    out, found, deformation = positions.copy(), [], _Deformation(carried)
    by_stretch: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for pair, frames in _collect_crossing_frames(_find_crossings(positions)).items():
        for stretch in zip(frames[::2], frames[1::2]):
            by_stretch.setdefault(stretch, []).append(pair)
    for (first, end), pairs in by_stretch.items():
        for low, high in _find_exchanged_stretches(deformation, out, tuple(pairs), first, end):
            out[low:high] = exchange_markers(out[low:high], tuple(pairs))
            found.append(Swap(tuple(pairs), low, high, True))
    return out, found


def correct_swaps(positions: np.ndarray, carried: Mapping[int, CarriedMarker], leaping: np.ndarray, fps: float,
                  opposite: Sequence[Pairs] = (),
                  check_cancelled: Callable[[], None] = lambda: None) -> tuple[np.ndarray, list[Swap]]:
    """Correct swaps that deform clusters and whose exchange removes the deformation.

    The exchange that reduces the deformation the most is made first, and the others are rated again where they are
    affected. A pair without a cluster that leaps once onto each other's trajectories is only reported.

    Args:
        positions: (T, M, 3) metres.
        carried: marker -> how it is carried.
        leaping: (T, M) bool of `pieces.detect_leaps`.
        fps: frames per second.
        opposite: pairs that are easily confused (left and right), and whole segments of them; always tested.
        check_cancelled: called for each test; it may raise.
    Returns:
        The corrected positions, and the swaps.
    """
    out, found, deformation = positions.copy(), [], _Deformation(carried)
    crossings = _find_crossings(positions)
    step = max(1, int(_TEST_INTERVAL * fps))
    tested = [pairs for pairs in _list_tests(positions, carried, crossings, fps, opposite)
              if deformation.has_evidence(pairs)]
    candidates = {}
    for pairs in tested:
        check_cancelled()
        candidates[pairs] = _rate_exchanges(deformation, out, pairs, leaping, step)
    for _ in range(_MAX_SWAPS):
        rated = ((gain, pairs, first, end) for pairs, rows in candidates.items() for gain, first, end in rows)
        best = max(rated, default=None)
        if best is None:
            break
        _, pairs, first, end = best
        out[first:end] = exchange_markers(out[first:end], pairs)
        found.append(Swap(pairs, first, end, True))
        affected = deformation.find_affected(pairs)
        for other in tested:
            if other == pairs:
                candidates[other] = [row for row in candidates[other] if row[1:] != (first, end)]
            elif candidates[other] and affected & {marker for pair in other for marker in pair}:
                candidates[other] = _rate_exchanges(deformation, out, other, leaping, step)
    found += _iter_unconfirmed(crossings, deformation, found, len(positions))
    return out, sorted(found, key=lambda swap: swap.first)


def _rate_exchanges(deformation, positions, pairs, leaping, step):
    """Rate the stretches in which these pairs should be exchanged: [(gain, first, end)].

    A coarse test on every `step`-th frame comes first.
    """
    keep, swap = deformation.compare_exchange(positions[::step], pairs)
    if not np.any(keep - swap > _MIN_REDUCTION):
        return []
    keep, swap = deformation.compare_exchange(positions, pairs)
    found = _find_stretches(keep, swap, deformation.compute_usual(pairs),
                            leaping[:, [i for pair in pairs for i in pair]])
    return [(float(np.nansum((keep - swap)[first:end])) * 2 * len(pairs), first, end) for first, end in found]


def _find_exchanged_stretches(deformation, positions, pairs, first, end):
    """Return the stretches in which these pairs are exchanged: between their two leaps, before and after, or none."""
    inside = [(first, end)]
    if not deformation.has_evidence(pairs):
        return inside if end - first <= len(positions) // 2 else [(0, first), (end, len(positions))]
    keep, swap = deformation.compare_exchange(positions, pairs)
    gain = keep - swap
    middle = compute_median(gain[first:end])
    around = compute_median(np.concatenate([gain[:first], gain[end:]]))
    if middle < -_MIN_REDUCTION and around > _MIN_REDUCTION:
        return [(0, first), (end, len(positions))]
    return inside if middle > -_MIN_REDUCTION or end - first <= len(positions) // 4 else []


def _collect_crossing_frames(crossings):
    """Collect {pair: frames at which its markers leap onto each other's trajectories}."""
    found: dict[tuple[int, int], list[int]] = {}
    for frame, pairs in crossings:
        for pair in pairs:
            found.setdefault(pair, []).append(frame)
    return found


class _Deformation:
    """The deformation of markers with their carriers, as labeled and with some markers exchanged."""

    def __init__(self, carried):
        self._carried = carried

    def has_evidence(self, pairs: Pairs) -> bool:
        """Return whether any cluster would show that these markers are exchanged."""
        return bool(self._find_affected_shapes(pairs))

    def _find_affected_shapes(self, pairs):
        """Find the markers whose shapes are tested: the pairs' own, or where those have no carriers, those that they
        carry.
        """
        own = {marker for pair in pairs for marker in pair}
        with_helpers = [marker for marker in sorted(own) if marker in self._carried and self._carried[marker].carriers]
        return with_helpers or [other for other, one in self._carried.items() if own & set(one.carriers)]

    def find_affected(self, pairs: Pairs) -> set[int]:
        """Return all markers whose shape changes with an exchange of these pairs."""
        markers = {marker for pair in pairs for marker in pair}
        return markers | {other for other, one in self._carried.items() if markers & set(one.carriers)}

    def compute_usual(self, pairs: Pairs) -> float:
        """Compute the mean of the usual deformation of the pairs' shapes, in metres."""
        ones = [self._carried[marker] for marker in self._find_affected_shapes(pairs)]
        return float(np.mean([max(one.shape.usual_deformation, one.sigma / np.sqrt(len(one.carriers) + 1.0))
                              for one in ones]))

    def compare_exchange(self, positions: np.ndarray, pairs: Pairs) -> tuple[np.ndarray, np.ndarray]:
        """Measure the mean deformation of the pairs' shapes, as labeled and with the pairs exchanged.

        Args:
            positions: (T, M, 3) metres.
            pairs: the pairs of markers.
        Returns:
            (T,) metres each; NaN where unknown.
        """
        markers = self._find_affected_shapes(pairs)
        keep, swap = (
            np.stack([self._measure_rms(version, marker) for marker in markers])
            for version in (positions, exchange_markers(positions, pairs))
        )
        return tuple(
            np.nansum(rms, axis=0) / np.where(np.isfinite(rms).any(axis=0), np.isfinite(rms).sum(axis=0), np.nan)
            for rms in (keep, swap)
        )

    def _measure_rms(self, positions, marker):
        """Measure how far marker and carriers are from their shape, (T,) metres; NaN where too few are visible."""
        one = self._carried[marker]
        places = np.vstack([one.place, one.shape.places])
        sigma = np.append(one.sigma, one.shape.sigma)
        seen = positions[:, [marker, *one.carriers]]
        fit = fit_rigid(places, seen, 1.0 / (sigma**2 + 0.005**2))
        away = np.linalg.norm(place_points(fit, places) - seen, axis=-1)
        count = np.isfinite(away).sum(axis=1)
        rms = np.sqrt(np.nansum(away**2, axis=1) / np.maximum(count, 1))
        return np.where(fit.is_determined & (count > 3) & np.isfinite(away[:, 0]), rms, np.nan)


def _list_tests(positions, carried, crossings, fps, opposite):
    """List the exchanges worth testing, groups before single pairs.

    They are those suggested by leaps, by two strayed markers, and the likely ones (left and right).
    """
    tests: dict[Pairs, None] = {}
    for _, pairs in crossings:
        if len(pairs) > 1:
            tests[pairs] = None
    for pairs in opposite:
        tests[tuple(pairs)] = None
    for _, pairs in crossings:
        for pair in pairs:
            tests[(pair,)] = None
    for pair in _find_strayed_pairs(positions, carried, fps):
        tests[(pair,)] = None
    return sorted(tests, key=lambda pairs: -len(pairs))


def _find_strayed_pairs(positions, carried, fps):
    """Find pairs of markers that are each far from their own predicted place, and near that of the other."""
    markers = [marker for marker, one in carried.items() if one.carriers]
    if not markers:
        return []
    frames = np.arange(0, len(positions), max(1, int(_TEST_INTERVAL * fps)))
    predicted = np.stack([carried[marker].predict_places()[frames] for marker in markers], axis=1)
    tolerances = np.array([carried[marker].tolerance for marker in markers])
    places = positions[frames][:, markers]
    off = np.linalg.norm(places - predicted, axis=-1) > tolerances
    found: dict[tuple[int, int], None] = {}
    for frame in np.flatnonzero(off.sum(axis=1) > 1):
        bad = np.flatnonzero(off[frame])
        across = np.linalg.norm(places[frame, bad][:, None] - predicted[frame, bad][None], axis=-1)
        own = np.diagonal(across)
        # (i, j): marker i lies where the carriers of j predict j, and clearly nearer than to its own place
        better = (across < tolerances[bad][None]) & (across < 0.5 * own[:, None])
        for i, j in np.argwhere(np.triu(better & better.T, 1)):
            found[(markers[bad[i]], markers[bad[j]])] = None
    return list(found)


def _find_stretches(keep, swap, usual, leaping):
    """Find the (first, end) frames in which an exchange is required, from where it begins to be better."""
    gain = keep - swap
    is_good = (swap < max(_GOOD_DEFORMATION, _GOOD_RATIO * usual)) | (swap < _GOOD_SHARE * keep)
    clear = (gain > np.maximum(_MIN_REDUCTION, (1.0 - _MAX_REMAINING_SHARE) * keep)) & is_good & (keep
            > _MIN_DEFORMATION_RATIO * usual)
    leap = leaping.any(axis=1)
    found = []
    for first, end in find_runs(~(gain <= 0.0)):  # better, or unknown
        inside = np.flatnonzero(clear[first:end]) + first
        if not len(inside):
            continue
        low, high = int(inside[0]), int(inside[-1]) + 1
        known = np.flatnonzero(gain[first:end] > 0.0) + first
        # the exchange began at a leap if there is one, else where it begins to be better
        leaps_before, leaps_after = np.flatnonzero(leap[first : low + 1]) + first, np.flatnonzero(leap[high : end
                + 1]) + high
        found.append((int(leaps_before[-1] if len(leaps_before) else known[0]),
                      int(leaps_after[0] if len(leaps_after) else known[-1] + 1)))
    return found


def _find_crossings(positions):
    """Find where markers continue, from one frame to the next, on each other's trajectories: [(frame, pairs)]."""
    expected = np.full_like(positions, np.nan)
    expected[1:] = positions[:-1]
    # expected place: linear extrapolation from the two frames before
    ahead = 2.0 * positions[1:-1] - positions[:-2]
    expected[2:] = np.where(np.isnan(ahead), expected[2:], ahead)
    has_leapt = np.nan_to_num(np.linalg.norm(positions - expected, axis=-1)) > 0.5 * _MIN_SWAP_DISTANCE
    found = []
    for frame in np.flatnonzero(has_leapt.sum(axis=1) > 1).tolist():
        markers = np.flatnonzero(has_leapt[frame])
        if pairs := _match_crossing_pairs(positions[frame, markers], expected[frame, markers], markers):
            found.append((frame, pairs))
    return found


def _match_crossing_pairs(now, expected, markers):
    """Find the pairs whose connecting vector reverses about the middle between them.

    No segment reverses in one frame, and markers that pass each other do so on their trajectories.

    Args:
        now: (N, 3) metres, where the markers are.
        expected: (N, 3) metres, where their trajectories predict them.
        markers: (N,) their indices.
    Returns:
        The pairs, each marker at most once.
    """
    arrow, expected_arrow = now[None] - now[:, None], expected[None] - expected[:, None]
    apart = np.linalg.norm(arrow, axis=-1)
    miss = np.linalg.norm(arrow + expected_arrow, axis=-1)
    middle = 0.5 * np.linalg.norm((now - expected)[None] + (now - expected)[:, None], axis=-1)
    is_reversed = np.triu((apart > _MIN_SWAP_DISTANCE) & (miss < _MAX_MISS_SHARE * apart)
                          & (middle < _MAX_MISS_SHARE * apart), 1)
    used: set[int] = set()
    pairs = []
    for i, j in sorted(np.argwhere(is_reversed).tolist(), key=lambda pair: miss[tuple(pair)]):
        if not {i, j} & used:
            used |= {i, j}
            pairs.append((int(markers[i]), int(markers[j])))
    return tuple(sorted(pairs))


def _iter_unconfirmed(crossings, deformation, found, frames):
    """Report leaps onto each other's trajectories of markers without a cluster, which nothing has corrected."""
    for pair, crossing_frames in _collect_crossing_frames(crossings).items():
        known = any(pair in swap.pairs and swap.first - 3 <= crossing_frames[-1] <= swap.end + 3 for swap in found)
        if not known and not deformation.has_evidence((pair,)):
            yield Swap((pair,), crossing_frames[-1], frames, False)
