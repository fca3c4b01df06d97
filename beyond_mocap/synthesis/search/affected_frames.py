"""Frames that an edit affects: where the new request differs from the old one, and what of it has to be searched again.

Affected are frames with another request: other labels, also avoided ones, another speed (by more than 5 cm/s), turning
(by more than 0.05 rad over a slot), facing or planned heading (by more than 0.3 rad), and key moments that moved,
changed their labels, were added or removed, or whose ball has moved (by more than 15 cm), with the entry and exit of
their clips. A run-up of a second around them is searched too, so that the new motion leads into the old one; key
moments that stay are avoided where they are not inside. Where only the track or the ball has moved (by more than a
millimetre), or the planned heading has turned a little (by more than 0.05 rad), the source frames stay and the motion
is constructed again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...annotation.gaits import compute_heading_offset
from ...base.time_series import find_runs
from ...library.library import Library
from ...motion import quaternion
from ...motion.track import SampledTrack
from .edit_list import EditList, PlacedKey
from .request import RequestedKey, SearchRequest, compute_needed_frames

RUN_UP = 1.0  # s around affected frames that are searched too
MIN_STRETCH = 0.8  # s of the shortest stretch that is searched for another solution
# m/s, rad, rad, m, m: smaller changes do not count
SPEED_CHANGE, TURN_CHANGE, FACING_CHANGE, PLACE_CHANGE, BALL_CHANGE = 0.05, 0.05, 0.3, 0.001, 0.15
TRANSITION_MARGIN = 6  # frames to a transition within which a stretch ends at it

Stretch = tuple[int, int]


def find_moved_frames(before: SearchRequest, after: SearchRequest) -> np.ndarray:
    """Return (T,) bool: frames at which the track, its direction, the planned heading or the ball has moved."""
    old, new = before.track, after.track
    off = np.linalg.norm(old.positions - new.positions, axis=1) > PLACE_CHANGE
    off |= np.linalg.norm(old.raw - new.raw, axis=1) > PLACE_CHANGE
    off |= np.abs(quaternion.wrap_angle(new.direction - old.direction)) * np.minimum(1.0, new.speed) > TURN_CHANGE
    off |= _measure_heading_change(old, new) > TURN_CHANGE
    if old.held is not None or new.held is not None:
        off |= (0.0 if old.held is None else old.held) != (0.0 if new.held is None else new.held)
    ball = ~np.isclose(old.ball, new.ball, rtol=0.0, atol=PLACE_CHANGE, equal_nan=True).all(axis=1)
    return off | ball | (old.ball_measured != new.ball_measured)


def find_changed_frames(before: SearchRequest, after: SearchRequest, slot: int) -> np.ndarray:
    """Return (T,) bool: frames with other requested labels, speed, turning over `slot` frames, or facing."""
    old, new = before.track, after.track
    words = np.array([a != b for a, b in zip(before.requested_labels, after.requested_labels)])
    words |= before.is_asked != after.is_asked
    if before.avoided != after.avoided:
        none = [frozenset()] * len(after)
        words |= [a != b for a, b in zip(before.avoided or none, after.avoided or none)]
    moving = np.minimum(1.0, new.speed)
    turns = _compute_slot_turn(new.direction, slot) - _compute_slot_turn(old.direction, slot)
    turn = np.abs(quaternion.wrap_angle(turns)) * moving
    facing = np.abs(quaternion.wrap_angle(compute_heading_offset(new) - compute_heading_offset(old))) * moving
    facing = np.maximum(facing, _measure_heading_change(old, new))
    return words | (np.abs(new.speed - old.speed) > SPEED_CHANGE) | (turn > TURN_CHANGE) | (facing > FACING_CHANGE)


def _measure_heading_change(old: SampledTrack, new: SampledTrack) -> np.ndarray:
    """Measure the change (T,) rad of the planned heading, at any speed; 0 without a plan."""
    if old.heading is None or new.heading is None:
        return np.zeros(len(new))
    return np.abs(quaternion.wrap_angle(new.heading - old.heading))


def list_unchanged_keys(edit: EditList, before: SearchRequest, after: SearchRequest) -> tuple[PlacedKey, ...]:
    """List placed keys whose key moment is requested as before, under its number in the new request."""
    number = _match_keys(before, after)
    return tuple(PlacedKey(number[key.number], key.key) for key in edit.keys if key.number in number)


def _match_keys(before: SearchRequest, after: SearchRequest) -> dict[int, int]:
    """Match the key moments that are requested as before; of those requested twice, the first matches the first.

    Returns:
        Number in the old request -> number in the new one.
    """
    found: dict[int, int] = {}
    for number, key in enumerate(after.keys):
        at = int(np.clip(round(key.frame), 0, len(after) - 1))
        ball = np.linalg.norm(before.track.ball[at] - after.track.ball[at])
        same = (n for n, other in enumerate(before.keys) if n not in found and _is_same_key(other, key))
        old = next(same, None)
        if old is not None and not ball > BALL_CHANGE:  # NaN where there is none
            found[old] = number
    return found


def _is_same_key(one: RequestedKey, other: RequestedKey) -> bool:
    """Return whether two key moments are equal, except for the requested second where both are at a solved touch."""
    if one.requested.solved is not None and one.requested.solved == other.requested.solved:
        other = replace(other, requested=replace(other.requested, time=one.requested.time))
    return one == other


def find_stretches_to_search(library: Library, edit: EditList, before: SearchRequest, after: SearchRequest,
                             slot: int) -> list[Stretch]:
    """Find the stretches that have to be searched again.

    Args:
        library: the clips.
        edit: the old edit list.
        before: the old request.
        after: the new request.
        slot: frames of a slot.
    Returns:
        (first, end) of each, in order of time, not overlapping.
    """
    affected = find_changed_frames(before, after, slot)
    same = _match_keys(before, after)
    for placed in edit.keys:
        if placed.number not in same:
            affected[slice(*_list_clip_frames(library, before.keys[placed.number], placed))] = True
    for number, key in enumerate(after.keys):
        if key.choices and number not in same.values():
            affected[slice(*_mean_clip_frames(library, key, len(after)))] = True
    same_keys = list_unchanged_keys(edit, before, after)
    stays = [_list_clip_frames(library, after.keys[key.number], key) for key in same_keys]
    run_up = int(round(RUN_UP * library.fps))
    found = [_extend_stretch(core, run_up, stays, edit) for core in list_stretches(affected, run_up)]
    return merge_stretches(found, run_up)


def find_variant_stretch(library: Library, edit: EditList, after: SearchRequest, first: int, end: int) -> Stretch:
    """Find the stretch that has to be searched for another solution of some frames.

    It is long enough to leave and come back, and ends neither within a key moment nor just beside a transition.

    Returns:
        (first, end).
    """
    missing = max(0, int(round(MIN_STRETCH * library.fps)) - (end - first))
    first, end = max(0, first - missing // 2), min(len(edit), end + missing - missing // 2)
    same = list_unchanged_keys(edit, after, after)
    stays = [_list_clip_frames(library, after.keys[key.number], key) for key in same]
    return _extend_stretch((first, end), 0, stays, edit)


def list_stretches(affected: np.ndarray, gap: int) -> list[Stretch]:
    """List (first, end) of the runs in which `affected` (T,) is true, merged where less than `gap` frames apart."""
    return merge_stretches(find_runs(affected), gap)


def merge_stretches(found: list[Stretch], gap: int) -> list[Stretch]:
    """Sort stretches by time and merge those less than `gap` frames apart."""
    out: list[Stretch] = []
    for first, end in sorted(found):
        if out and first - out[-1][1] < gap:
            out[-1] = (out[-1][0], max(out[-1][1], end))
        else:
            out.append((first, end))
    return out


def _list_clip_frames(library: Library, key: RequestedKey, placed: PlacedKey) -> Stretch:
    """Return the frames that the clip of a placed key needs."""
    entry, leave = compute_needed_frames(library, placed.key)
    return max(0, int(np.floor(key.frame - entry))), int(np.ceil(key.frame + leave)) + 1


def _mean_clip_frames(library: Library, key: RequestedKey, count: int) -> Stretch:
    """Return the frames that the clips which may serve a key moment need on average."""
    entry, leave = np.mean([compute_needed_frames(library, choice) for choice in key.choices], axis=0)
    return max(0, int(np.floor(key.frame - entry))), min(count, int(np.ceil(key.frame + leave)) + 1)


def _extend_stretch(core: Stretch, run_up: int, stays: list[Stretch], edit: EditList) -> Stretch:
    """Extend a stretch by its run-up; it ends neither within a key moment that stays nor just beside a transition."""
    first, end = max(0, core[0] - run_up), min(len(edit), core[1] + run_up)
    # end at a transition that is near, since a cut is there already
    first = max((s for s in edit.transitions if first - TRANSITION_MARGIN < s <= first), default=first)
    end = min((s for s in edit.transitions if end <= s < end + TRANSITION_MARGIN), default=end)
    # include a key moment that overlaps the core, keep out of the others
    for low, high in sorted(stays, reverse=True):
        if low < first < high:
            first = high if high <= core[0] else low
    for low, high in sorted(stays):
        if low < end < high:
            end = low if low >= core[1] else high
    return (0 if first < TRANSITION_MARGIN else max(first, 0)), (len(edit) if len(edit) - end < TRANSITION_MARGIN
                                                                 else end)


def _compute_slot_turn(direction: np.ndarray, slot: int) -> np.ndarray:
    """Compute the change of direction over `slot` frames centred on each frame."""
    padded = np.pad(direction, slot // 2, mode="edge")
    return padded[2 * (slot // 2) :] - padded[: len(direction)]
