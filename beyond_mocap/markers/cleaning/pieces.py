"""Pieces of a marker's trajectory, cut where it is not visible and where it leaps as no body does.

Pieces that jump (ghosts, reflections) are removed, and those of unlabeled markers get the label that is missing there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..model.marker_set import UNLABELED
from .carriers import CarriedMarker
from .cluster_shape import compute_quantile
from .gaps import bridge_gap

# A step that bends the trajectory by more than this is a leap, in metres, if it is also more than what a limb can do in
# a frame, in m/s^2 (in the carriers' frame, and in the world), and this many times the marker's own 95 % quantile.
_LEAP_LOCAL, _LEAP_WORLD, _LEAP_OWN_RATIO = 0.02, 0.04, 6.0
_LEAP_SWING_LOCAL, _LEAP_SWING_WORLD = 200.0, 500.0

_MAX_BURST_SECONDS = 0.08  # s, the longest burst that is removed as a jump
# how far off its trajectory a burst lies at least, in metres and as a share of the marker's movement meanwhile
_MIN_BURST_OFFSET, _MIN_BURST_SHARE = 0.015, 0.3
_MIN_GHOST_OFFSET = 0.06  # metres from where the carriers predict the marker, from which on a longer stretch is a ghost
# A single sample is off if it leaves the trajectory by this many metres (in the carriers' frame, in the world), by more
# than limbs can do in a frame, in m/s^2, and by this many times the 90 % quantile of the samples around it. Cameras and
# skin move single samples of runs by 6 to 11 mm; real jumps of recordings lie 15 to 100 mm off.
_SPIKE_LOCAL, _SPIKE_WORLD, _SPIKE_RATIO = 0.012, 0.015, 3.0
_SPIKE_SWING_LOCAL, _SPIKE_SWING_WORLD = 100.0, 300.0
_AROUND_FRAMES = 12  # frames before and after that count as around
# Share of a jump in the carriers' frame that must also show in the world; else it is a carrier that jumps.
_MIN_WORLD_SHARE = 0.5

_MIN_PIECE_SECONDS = 0.02  # s, shorter pieces are not assigned
# Without carriers: distance in metres between the ends of a piece and the label's trajectory, and the gap between them
# in seconds, at most.
_MAX_JOIN_DISTANCE, _MAX_JOIN_SECONDS = 0.02, 0.05
_AGREEMENT_TOLERANCE = 0.01  # metres by which label and unlabeled marker may differ where both are visible


class Piece(NamedTuple):
    """An unbroken stretch of one marker.

    Attributes:
        marker: index of the marker.
        first: first frame.
        end: the frame after the last.
    """

    marker: int
    first: int
    end: int


def detect_leaps(positions: np.ndarray, carried: Mapping[int, CarriedMarker], fps: float) -> np.ndarray:
    """Detect the frames at which markers leap.

    The bend of the trajectory is tested in the world, and in the frame of the marker's carriers.

    Args:
        positions: (T, M, 3) metres.
        carried: marker -> how it is carried.
        fps: frames per second.
    Returns:
        (T, M) bool, True at the frame after the leap.
    """
    out = _exceeds_bend(positions, max(_LEAP_WORLD, _LEAP_SWING_WORLD / fps**2))
    local = max(_LEAP_LOCAL, _LEAP_SWING_LOCAL / fps**2)
    for marker, one in carried.items():
        if not one.carriers:
            continue
        known = np.isfinite(one.local[:, 0])
        both = np.concatenate([[False], known[1:] & known[:-1]])
        out[:, marker] |= both & _exceeds_bend(one.local[:, None], local)[:, 0]
    return out


def split_pieces(positions: np.ndarray, leaping: np.ndarray) -> list[Piece]:
    """Split the trajectories of markers into pieces.

    Args:
        positions: (T, M, 3) metres.
        leaping: (T, M) bool of `detect_leaps`.
    Returns:
        All pieces, by marker, then by time.
    """
    seen = np.isfinite(positions[..., 0])
    found = []
    for marker in range(positions.shape[1]):
        visible = np.concatenate([[False], seen[:, marker], [False]])
        # a piece begins after a frame without sight or at a leap, and ends before one
        begins = visible[1:-1] & (~visible[:-2] | leaping[:, marker])
        firsts = np.flatnonzero(begins)
        ends = np.flatnonzero(visible[1:-1] & (~visible[2:] | np.append(leaping[1:, marker], False))) + 1
        found += [Piece(marker, int(first), int(end)) for first, end in zip(firsts, ends)]
    return found


def measure_bend(places: np.ndarray) -> np.ndarray:
    """Measure how much the step into each frame differs from the two before and the two after: the smallest difference.

    A leap differs from them all; a frame after a leap, or between two, does not.

    Args:
        places: (T, ..., 3) metres.
    Returns:
        (T, ...) metres; NaN where there is nothing to compare with.
    """
    steps = np.diff(places, axis=0)
    least = np.full(places.shape[:-1], np.inf)
    # step k is compared with steps k - apart and k + apart; frame k + 1 is the end of step k
    for apart in (1, 2):
        off = np.linalg.norm(steps[apart:] - steps[:-apart], axis=-1)
        off = np.where(np.isnan(off), np.inf, off)
        if len(off):
            least[1 + apart :] = np.minimum(least[1 + apart :], off)
            least[1:-apart] = np.minimum(least[1:-apart], off)
    return np.where(np.isfinite(least), least, np.nan)


def _exceeds_bend(places, least):
    """Return which of places (T, N, 3) metres bend by more than `least` metres and the marker's own usual: (T, N)
    bool.
    """
    bends = measure_bend(places)
    own = np.nan_to_num(compute_quantile(bends, 0.95))
    return np.nan_to_num(bends) > np.maximum(least, _LEAP_OWN_RATIO * own)


class Jump(NamedTuple):
    """Samples of one marker that were removed.

    Attributes:
        marker: index of the marker.
        first: first frame.
        end: the frame after the last.
        off: metres from its trajectory.
    """

    marker: int
    first: int
    end: int
    off: float


def remove_jumps(positions: np.ndarray, carried: Mapping[int, CarriedMarker], fps: float) -> tuple[np.ndarray,
        list[Jump]]:
    """Remove samples that jump.

    Args:
        positions: (T, M, 3) metres.
        carried: marker -> how it is carried.
        fps: frames per second.
    Returns:
        The positions with NaN for removed samples, and the jumps.
    """
    out, found = positions.copy(), []
    for jump in [*_iter_bursts(positions, carried, fps), *_iter_ghosts(positions, carried, fps)]:
        out[jump.first : jump.end, jump.marker] = np.nan
        found.append(jump)
    for jump in _iter_spikes(out, carried, fps):
        out[jump.first, jump.marker] = np.nan
        found.append(jump)
    return out, sorted(found, key=lambda jump: (jump.first, jump.marker))


def _iter_bursts(positions, carried, fps):
    """Find short pieces between leaps (or a leap and a gap) that lie off the trajectory before and after them."""
    leaping = detect_leaps(positions, carried, fps)
    most = max(3, int(round(_MAX_BURST_SECONDS * fps)))
    seen = np.isfinite(positions[..., 0])
    # the shortest first, so that a good piece between two jumps is not taken for one
    for piece in sorted(split_pieces(positions, leaping), key=lambda piece: piece.end - piece.first):
        marker, first, end = piece
        has_leap = leaping[first, marker] or (end < len(positions) and leaping[end, marker])
        if end - first > most or not has_leap:
            continue
        one = carried.get(marker)
        off, allowed = _measure_offset(positions[:, marker], seen[:, marker], piece, most, fps)
        if one is not None and one.carriers:
            near, near_allowed = _measure_offset(one.local, seen[:, marker] & np.isfinite(one.local[:, 0]), piece, most,
                                                 fps)
            if np.isfinite(near_allowed):
                # a marker that only seems to jump, because a carrier does, stays on its trajectory in the world
                off, allowed = (near, near_allowed) if off > _MIN_WORLD_SHARE * near else (0.0, near_allowed)
        if off > allowed:
            seen[first:end, marker] = False
            yield Jump(marker, first, end, off)


def _iter_ghosts(positions, carried, fps):
    """Find longer pieces that begin or end in a leap and lie throughout far from where the markers around predict
    them.
    """
    leaping = detect_leaps(positions, carried, fps)
    most = max(3, int(round(_MAX_BURST_SECONDS * fps)))
    seen = np.isfinite(positions[..., 0])
    for marker, first, end in split_pieces(positions, leaping):
        one = carried.get(marker)
        has_leap = leaping[first, marker] or (end < len(positions) and leaping[end, marker])
        if one is None or not one.carriers or not has_leap or end - first <= most:
            continue
        away = one.deviation[first:end]
        near = float(np.nan_to_num(compute_quantile(away, 0.05)))
        is_comparable = np.isfinite(away).mean() > 0.5 and 2 * (end - first) < seen[:, marker].sum()
        if is_comparable and near > max(_MIN_GHOST_OFFSET, 2.0 * one.tolerance):
            yield Jump(marker, first, end, near)


def _measure_offset(trajectory, seen, piece, most, fps):
    """Measure how far a piece lies off the smooth curve across it, and how far it may, in metres.

    `trajectory` (T, 3) is that of the marker; without a curve the result is 0 and inf.
    """
    _, first, end = piece
    before, after = np.flatnonzero(seen[:first]), np.flatnonzero(seen[end:]) + end
    if not (len(before) and len(after)) or after[0] - before[-1] > 2 * most or not seen[first:end].all():
        return 0.0, np.inf
    low, high = int(before[-1]), int(after[0])
    curve = bridge_gap(np.where(seen[:, None], trajectory, np.nan), low + 1, high, fps)
    if curve is None:
        return 0.0, np.inf
    off = np.linalg.norm(trajectory[first:end] - curve[first - low - 1 : end - low - 1], axis=-1)
    return float(off.min()), max(_MIN_BURST_OFFSET, _MIN_BURST_SHARE
                                 * float(np.linalg.norm(trajectory[high] - trajectory[low])))


def _iter_spikes(positions, carried, fps):
    """Find single samples off the curve through their neighbours."""
    world = _measure_spikes(positions)
    usual = _compute_usual_around(world)
    local_least, world_least = max(_SPIKE_LOCAL, _SPIKE_SWING_LOCAL / fps**2), max(_SPIKE_WORLD, _SPIKE_SWING_WORLD
                                                                                   / fps**2)
    for marker in range(positions.shape[1]):
        one = carried.get(marker)
        off, around, least = world[:, marker], usual[:, marker], np.full(len(positions), world_least)
        if one is not None and one.carriers:
            local = _measure_spikes(np.where(np.isfinite(positions[:, marker]), one.local, np.nan)[:, None])[:, 0]
            known = np.isfinite(local)
            around = np.where(known, _compute_usual_around(local[:, None])[:, 0], around)
            least = np.where(known, local_least, least)
            off = np.where(known, np.where(off > _MIN_WORLD_SHARE * local, local, 0.0), off)
        with np.errstate(invalid="ignore"):
            spike = off > np.maximum(least, _SPIKE_RATIO * around)  # NaN is no spike
        for frame in np.flatnonzero(spike):
            # of neighbours, the one farthest off is the spike; the others are only affected by it
            if off[frame] >= np.nanmax(off[max(frame - 2, 0) : frame + 3]):
                yield Jump(marker, int(frame), int(frame) + 1, float(off[frame]))


def _measure_spikes(places):
    """Measure how far each sample is off the curve through two before and two after it, (T, N) metres; NaN if one is
    missing.
    """
    out = np.full(places.shape[:2], np.nan)
    if len(places) > 4:
        # cubic through the four neighbours, evaluated in the middle: (-1, 4, 4, -1) / 6
        through = (4.0 * (places[1:-3] + places[3:-1]) - places[:-4] - places[4:]) / 6.0
        out[2:-2] = np.linalg.norm(places[2:-2] - through, axis=-1)
    return out


def _compute_usual_around(off):
    """Compute the 90 % quantile of the frames around each one, (T, N) metres, without itself and its next
    neighbours.
    """
    frames = len(off)
    steps = [step for step in range(-_AROUND_FRAMES, _AROUND_FRAMES + 1) if abs(step) > 2]
    index = np.clip(np.arange(frames)[:, None] + steps, 0, max(frames - 1, 0))
    return np.nan_to_num(compute_quantile(off[index], 0.9, axis=1)) if frames else off


class Assignment(NamedTuple):
    """An unlabeled marker that took a label.

    Attributes:
        unlabeled: index of the unlabeled marker.
        label: index of the label.
        first: first frame.
        end: the frame after the last.
        off: metres from where it should be.
    """

    unlabeled: int
    label: int
    first: int
    end: int
    off: float


def find_unlabeled(labels: Sequence[str], known: Sequence[str] = ()) -> list[int]:
    """Find the unlabeled markers (`*7`, `U12`, ...).

    Args:
        labels: all labels.
        known: labels of the marker set; they are labels in any form.
    Returns:
        Indices of the unlabeled markers.
    """
    return [index for index, label in enumerate(labels) if label not in known and UNLABELED.match(label)]


def assign_labels(positions: np.ndarray, carried: Mapping[int, CarriedMarker], unlabeled: Sequence[int],
                  fps: float) -> tuple[np.ndarray, list[Assignment]]:
    """Assign pieces of unlabeled markers to the labels that they belong to.

    The best match goes first; a label takes at most one piece at a time, and each frame of a piece is used once.

    Args:
        positions: (T, M, 3) metres.
        carried: marker -> how it is carried.
        unlabeled: indices of the unlabeled markers.
        fps: frames per second.
    Returns:
        The positions with the pieces moved, and the assignments.
    """
    out, found = positions.copy(), []
    alone = np.ascontiguousarray(positions[:, list(unlabeled)])
    candidates = [
        Piece(unlabeled[piece.marker], piece.first, piece.end)
        for piece in split_pieces(alone, detect_leaps(alone, {}, fps)) if piece.end - piece.first
        >= max(2, _MIN_PIECE_SECONDS * fps)
    ]
    lacking = [marker for marker in carried if marker not in unlabeled and np.isnan(positions[:, marker, 0]).any()]
    rated = (_rate_match(positions, carried, piece, marker, fps) for piece in candidates for marker in lacking)
    matches = [offer for offer in rated if offer]
    for offer in sorted(matches):
        _, piece, marker, off = offer
        trajectory = out[piece.first : piece.end, piece.marker]
        free = np.isfinite(trajectory[:, 0]) & np.isnan(out[piece.first : piece.end, marker, 0])
        if not free.any():
            continue
        frames = np.flatnonzero(free) + piece.first
        out[frames, marker] = out[frames, piece.marker]
        out[frames, piece.marker] = np.nan
        found.append(Assignment(piece.marker, marker, int(frames[0]), int(frames[-1]) + 1, off))
    return out, sorted(found, key=lambda one: one.first)


def _rate_match(positions, carried, piece, marker, fps):
    """Rate a piece that may be this marker: (rank, piece, marker, metres off), or None."""
    stretch = slice(piece.first, piece.end)
    trajectory = positions[stretch, piece.marker]
    missing = np.isnan(positions[stretch, marker, 0])
    if not missing.any() or _has_conflict(trajectory, positions[stretch, marker]):
        return None
    one = carried[marker]
    join_distance = _measure_join_distance(positions, piece, marker, fps)
    if one.carriers:
        off = np.linalg.norm(one.to_local(_expand_piece(positions, piece))[stretch] - one.place, axis=-1)[missing]
        known = off[np.isfinite(off)]
        if len(known) >= max(2, 0.3 * missing.sum()):
            median, worst = float(np.median(known)), float(np.percentile(known, 95.0))
            fits = median < one.tolerance and worst < 2.0 * one.tolerance
            # soft carriers alone are no proof: the trajectories must join as well
            sure = one.tolerance < 0.06 or join_distance is not None
            return (median / one.tolerance, piece, marker, median) if fits and sure else None
    return (2.0 + join_distance, piece, marker, join_distance) if join_distance is not None else None


def _expand_piece(positions, piece):
    """Return the unlabeled marker's trajectory over all frames, NaN outside the piece: (T, 3) metres."""
    trajectory = np.full((len(positions), 3), np.nan)
    trajectory[piece.first : piece.end] = positions[piece.first : piece.end, piece.marker]
    return trajectory


def _has_conflict(trajectory, labelled):
    """Return whether label and unlabeled marker are both visible, in different places."""
    apart = np.linalg.norm(trajectory - labelled, axis=-1)
    return bool((apart > _AGREEMENT_TOLERANCE).any())


def _measure_join_distance(positions, piece, marker, fps):
    """Measure how far the piece is from the label's trajectory where they should meet, in metres.

    The larger distance of both ends is returned; None if it is too large, or no end is near enough in time.
    """
    seen = np.isfinite(positions[:, marker, 0])
    before, after = np.flatnonzero(seen[: piece.first]), np.flatnonzero(seen[piece.end :]) + piece.end
    within, trajectory = max(1, int(_MAX_JOIN_SECONDS * fps)), positions[:, piece.marker]
    misses = []
    if len(before) and piece.first - before[-1] <= within and piece.end - piece.first > 1:
        steps = piece.first - before[-1]
        # extrapolate the piece linearly to the label's last visible frame before it
        back = trajectory[piece.first] - steps * (trajectory[piece.first + 1] - trajectory[piece.first])
        misses.append(float(np.linalg.norm(back - positions[before[-1], marker])))
    if len(after) and after[0] - (piece.end - 1) <= within and piece.end - piece.first > 1:
        steps = after[0] - (piece.end - 1)
        on = trajectory[piece.end - 1] + steps * (trajectory[piece.end - 1] - trajectory[piece.end - 2])
        misses.append(float(np.linalg.norm(on - positions[after[0], marker])))
    return max(misses) if misses and max(misses) < _MAX_JOIN_DISTANCE else None
