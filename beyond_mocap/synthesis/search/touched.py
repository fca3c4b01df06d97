"""What an edit touches: where the new order differs from the old one, and what of it has to be searched anew.

Touched is what is asked otherwise: other words, also such that must not be, another speed (by more than 5 cm/s),
turning (by more than 0.05 rad over a slot) or facing (by more than 0.3 rad), and key moments that moved, changed their
words, came, went, or whose ball has moved (by more than 15 cm), with the entry and exit of their clips. Around it a
run-up of a second is searched too, so that the new motion finds into the old one; key moments that stay are gone round
where they do not lie within. Where only the track or the ball lies elsewhere (by more than a millimetre), what is shown
stays and is laid out anew.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...annotation.gaits import wanted_offset
from ...base.time_series import runs
from ...library.library import Library
from ...motion import quaternion
from .edit_list import EditList, PlacedKey
from .wanted import Wanted, WantedKey, needed

RUN_UP = 1.0
SHORTEST = 0.8  # s
SPEED, TURN, FACING, PLACE, BALL = 0.05, 0.05, 0.3, 0.001, 0.15
NEAR = 6

Stretch = tuple[int, int]


def lies_elsewhere(before: Wanted, after: Wanted) -> np.ndarray:
    """(T,) bool: frames at which the track, its direction or the ball is not where it was."""
    old, new = before.track, after.track
    off = np.linalg.norm(old.positions - new.positions, axis=1) > PLACE
    off |= np.linalg.norm(old.raw - new.raw, axis=1) > PLACE
    off |= np.abs(quaternion.wrapped(new.direction - old.direction)) * np.minimum(1.0, new.speed) > TURN
    ball = ~np.isclose(old.ball, new.ball, rtol=0.0, atol=PLACE, equal_nan=True).all(axis=1)
    return off | ball | (old.ball_measured != new.ball_measured)


def asked_otherwise(before: Wanted, after: Wanted, slot: int) -> np.ndarray:
    """(T,) bool: frames of which other words, another speed or another turning over `slot` frames is asked."""
    old, new = before.track, after.track
    words = np.array([a != b for a, b in zip(before.asked, after.asked)])
    if before.avoided != after.avoided:
        none = [frozenset()] * len(after)
        words |= [a != b for a, b in zip(before.avoided or none, after.avoided or none)]
    moving = np.minimum(1.0, new.speed)
    turn = np.abs(quaternion.wrapped(_turn(new.direction, slot) - _turn(old.direction, slot))) * moving
    facing = np.abs(quaternion.wrapped(wanted_offset(new) - wanted_offset(old))) * moving
    return words | (np.abs(new.speed - old.speed) > SPEED) | (turn > TURN) | (facing > FACING)


def kept_keys(edit: EditList, before: Wanted, after: Wanted) -> tuple[PlacedKey, ...]:
    """Placed keys whose key moment is asked as it was, under its number in the new order."""
    number = _same_keys(before, after)
    return tuple(PlacedKey(number[key.wanted], key.key) for key in edit.keys if key.wanted in number)


def _same_keys(before: Wanted, after: Wanted) -> dict[int, int]:
    """Number in the old order -> number in the new one of the key moments that are asked as they were; of those asked
    twice, the first answers to the first."""
    found: dict[int, int] = {}
    for number, key in enumerate(after.keys):
        at = int(np.clip(round(key.frame), 0, len(after) - 1))
        ball = np.linalg.norm(before.track.ball[at] - after.track.ball[at])
        same = (n for n, other in enumerate(before.keys) if n not in found and _played_alike(other, key))
        old = next(same, None)
        if old is not None and not ball > BALL:  # NaN where there is none
            found[old] = number
    return found


def _played_alike(one: WantedKey, other: WantedKey) -> bool:
    """Whether two key moments are the same but for the second at which they were asked for, where both are at a solved
    one."""
    if one.asked.solved is not None and one.asked.solved == other.asked.solved:
        other = replace(other, asked=replace(other.asked, time=one.asked.time))
    return one == other


def to_search(library: Library, edit: EditList, before: Wanted, after: Wanted, slot: int) -> list[Stretch]:
    """Stretches (first, end) that have to be searched anew, in the order of time, apart from each other."""
    touched = asked_otherwise(before, after, slot)
    same = _same_keys(before, after)
    for placed in edit.keys:
        if placed.wanted not in same:
            touched[slice(*_played(library, before.keys[placed.wanted], placed))] = True
    for number, key in enumerate(after.keys):
        if key.choices and number not in same.values():
            touched[slice(*_asked_for(library, key, len(after)))] = True
    stays = [_played(library, after.keys[key.wanted], key) for key in kept_keys(edit, before, after)]
    run_up = int(round(RUN_UP * library.fps))
    found = [_widened(core, run_up, stays, edit) for core in stretches(touched, run_up)]
    return joined(found, run_up)


def asked_anew(library: Library, edit: EditList, after: Wanted, first: int, end: int) -> Stretch:
    """The stretch (first, end) that has to be searched where just these frames are to be another solution: no shorter
    than it takes to leave and come back, ending neither within a key moment nor just beside a seam."""
    missing = max(0, int(round(SHORTEST * library.fps)) - (end - first))
    first, end = max(0, first - missing // 2), min(len(edit), end + missing - missing // 2)
    same = kept_keys(edit, after, after)
    return _widened((first, end), 0, [_played(library, after.keys[key.wanted], key) for key in same], edit)


def stretches(touched: np.ndarray, gap: int) -> list[Stretch]:
    """(first, end) of the stretches in which `touched` (T,) is true, those less than `gap` frames apart taken
    together."""
    return joined(runs(touched), gap)


def joined(found: list[Stretch], gap: int) -> list[Stretch]:
    """Stretches in the order of time, those less than `gap` frames apart taken together."""
    out: list[Stretch] = []
    for first, end in sorted(found):
        if out and first - out[-1][1] < gap:
            out[-1] = (out[-1][0], max(out[-1][1], end))
        else:
            out.append((first, end))
    return out


def _played(library: Library, key: WantedKey, placed: PlacedKey) -> Stretch:
    """Frames that the clip of a placed key needs."""
    entry, leave = needed(library, placed.key)
    return max(0, int(np.floor(key.frame - entry))), int(np.ceil(key.frame + leave)) + 1


def _asked_for(library: Library, key: WantedKey, count: int) -> Stretch:
    """Frames that the clips which may serve a key moment need on the average."""
    entry, leave = np.mean([needed(library, choice) for choice in key.choices], axis=0)
    return max(0, int(np.floor(key.frame - entry))), min(count, int(np.ceil(key.frame + leave)) + 1)


def _widened(core: Stretch, run_up: int, stays: list[Stretch], edit: EditList) -> Stretch:
    """A stretch with its run-up, which ends neither within a key moment that stays nor just beside a seam."""
    first, end = max(0, core[0] - run_up), min(len(edit), core[1] + run_up)
    first = max((s for s in edit.seams if first - NEAR < s <= first), default=first)
    end = min((s for s in edit.seams if end <= s < end + NEAR), default=end)
    for low, high in sorted(stays, reverse=True):
        if low < first < high:
            first = high if high <= core[0] else low
    for low, high in sorted(stays):
        if low < end < high:
            end = low if low >= core[1] else high
    return (0 if first < NEAR else max(first, 0)), (len(edit) if len(edit) - end < NEAR else end)


def _turn(direction: np.ndarray, slot: int) -> np.ndarray:
    padded = np.pad(direction, slot // 2, mode="edge")
    return padded[2 * (slot // 2) :] - padded[: len(direction)]
