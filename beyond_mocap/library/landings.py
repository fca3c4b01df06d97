"""Recordings that end in flight are completed on entry: fall, landing and getting up are made behind them.

A dive that is cut where it leaves the ground would be held in the air when it is played to its end. What is made is
kept apart by name: frames behind a clip's recorded ones are told as those of a file of the same frames in the cache's
folder (`LANDING_FOLDER`), which readers of a take's provenance can read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import LOCOMOTION, ClipAnnotation
from ..motion.motion import Motion
from ..synthetic.landing import ends_in_flight, landed
from ..synthetic.moves import getting_up
from .scan import CACHE_FOLDER

LANDING_FOLDER = f"{CACHE_FOLDER}/made-landing/"
_UPRIGHT, _MADE_FPS = frozenset(LOCOMOTION[:2]), 60.0
_FEET_DOWN = 0.35  # seconds of a way up in which the body still turns over: no foot stands


@dataclass(frozen=True, eq=False)
class WayUp:
    """From lying to standing: motion, standing (T, 2, 2) bool of heels and toes, its words, and whether it is made."""

    motion: Motion
    standing: np.ndarray
    words: tuple[str, ...]
    made: bool = False


@dataclass(frozen=True, eq=False)
class Completed:
    """A clip with its end: motion, rows and standing (T, 2, 2) of all its frames, and how many of them are recorded."""

    motion: Motion
    rows: tuple[ClipAnnotation, ...]
    standing: np.ndarray
    recorded: int


def ways_up(clips: Sequence[tuple[Motion, tuple[ClipAnnotation, ...], np.ndarray]]) -> list[WayUp]:
    """Every way of getting up among clips (motion, rows, standing) of one skeleton; a made one where they show none."""
    found = [
        WayUp(motion.frames(int(row.start), int(row.end) + 1), standing[int(row.start) : int(row.end) + 1], row.words)
        for motion, rows, standing in clips for row in rows
        if "getting_up" in row.words and row.end - row.start > motion.fps and not ends_in_flight(motion)
    ]
    return found or [_made_way([(motion, rows) for motion, rows, _ in clips])]


def _made_way(clips) -> WayUp:
    """A made getting up for the skeleton of clips (motion, rows), whose upright stance the longest stretch of slow
    locomotion shows: keepers in wait, like runners, lean."""
    upright = [motion.frames(row.start, row.end + 1) for motion, rows in clips for row in rows
               if row.key is None and _UPRIGHT & set(row.words)]  # fmt: skip
    example = max(upright, key=lambda motion: motion.duration, default=clips[0][0])
    gesture = getting_up(example.skeleton, _MADE_FPS, example=example).motion
    return WayUp(gesture, np.zeros((len(gesture), 2, 2), bool), ("getting_up", "back"), made=True)


def completed(motion: Motion, rows, standing: np.ndarray, ways: Sequence[WayUp]) -> Completed:
    """The clip, which ends in flight, with landing and getting up behind it."""
    whole = landed(motion, [way.motion for way in ways])
    way = ways[whole.way]
    down = np.zeros((len(whole.motion), 2, 2), bool)
    down[: whole.recorded] = standing[: whole.recorded]
    up = way.standing[np.rint(whole.way_frames).astype(int)]
    up[: int(_FEET_DOWN * motion.fps)] = False
    down[whole.rising : whole.rising + len(up)] = up
    last = len(whole.motion) - 1
    made = (
        ClipAnnotation(whole.touched, whole.rising - 1, None, ("ground",)),
        ClipAnnotation(whole.rising, last, None, tuple(way.words)),
    )
    kept = tuple(_longer(row, whole.recorded, last) for row in rows if row.start < whole.recorded)
    return Completed(whole.motion, (*kept, *made), down, whole.recorded)


def _longer(row: ClipAnnotation, recorded: int, last: int) -> ClipAnnotation:
    """A row of a key moment that reaches the recording's end needs what is made behind it as its exit."""
    if row.end < recorded - 1:
        return row
    key = None if row.key is None else min(row.key, recorded - 1)
    return replace(row, end=recorded - 1 if key is None else last, key=key)


def describe_landings(completed_clips: Sequence[Completed], ways: Sequence[WayUp]) -> list[str]:
    """What was done, in one line, where anything was."""
    if not completed_clips:
        return []
    seconds = np.median([(len(one.motion) - one.recorded) / one.motion.fps for one in completed_clips])
    by = "by a made getting up, since no clip shows one" if ways[0].made else "as the library's own clips get up"
    what = f"landing and getting up ({by}) made behind them, {seconds:.1f} s each"
    return [f"{len(completed_clips)} clips end in flight: {what}"]
