"""Completes recordings that end in flight: a synthetic fall, landing and getting up follow.

A dive that is cut where it leaves the ground would stop in the air when it is played to its end. The synthetic part has
its own file name: frames after a clip's recorded ones are attributed to a file with the same frames in the cache's
folder (`LANDING_FOLDER`), which readers of a take's provenance can read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import LOCOMOTION, ClipAnnotation
from ..base.errors import format_count
from ..motion.motion import Motion
from ..synthetic.landing import add_landing, ends_in_flight
from ..synthetic.moves import build_get_up

_UPRIGHT, _MADE_FPS = frozenset(LOCOMOTION[:2]), 60.0
_FEET_DOWN = 0.35  # seconds at the start of getting up in which the body still turns over: no foot is in contact


@dataclass(frozen=True, eq=False)
class GettingUp:
    """A movement from lying to standing.

    Attributes:
        motion: T frames.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact.
        labels: its labels.
        is_synthetic: whether it is synthetic.
    """

    motion: Motion
    heel_toe_contacts: np.ndarray
    labels: tuple[str, ...]
    is_synthetic: bool = False


@dataclass(frozen=True, eq=False)
class CompletedClip:
    """A clip with its synthetic end.

    Attributes:
        motion: all frames.
        rows: its annotations.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact.
        recorded_count: number of recorded frames.
    """

    motion: Motion
    rows: tuple[ClipAnnotation, ...]
    heel_toe_contacts: np.ndarray
    recorded_count: int

    @property
    def seconds(self) -> float:
        """Duration of the synthetic end."""
        return (len(self.motion) - self.recorded_count) / self.motion.fps


def collect_getting_ups(motions: Sequence[Motion], rows: Sequence[tuple[ClipAnnotation, ...]],
                        contacts: Sequence[np.ndarray]) -> list[GettingUp]:
    """Collect every movement of getting up among clips of one skeleton.

    Args:
        motions: taken one at a time, since they may lie in a file.
        rows: annotations of each.
        contacts: of each, (T, 2, 2) bool.
    Returns:
        The movements; a synthetic one where the clips show none.
    """
    found = [
        GettingUp(motion.frames(int(row.start), int(row.end) + 1), standing[int(row.start) : int(row.end) + 1],
                  row.words) for motion, own, standing in zip(motions, rows, contacts) for row in own
        if "getting_up" in row.words and row.end - row.start > motion.fps and not ends_in_flight(motion)
    ]
    return found or [_build_getting_up(motions, rows)]


def _build_getting_up(motions: Sequence[Motion], rows: Sequence[tuple[ClipAnnotation, ...]]) -> GettingUp:
    """Build a synthetic getting up for the skeleton of clips.

    Its upright stance is that of the longest stretch of slow locomotion: waiting goalkeepers, like runners, lean.
    """
    upright = (motion.frames(int(row.start), int(row.end) + 1) for motion, own in zip(motions, rows) for row in own
               if row.key is None and _UPRIGHT & set(row.words))
    example = max(upright, key=lambda motion: motion.duration, default=motions[0])
    gesture = build_get_up(example.skeleton, _MADE_FPS, example=example).motion
    return GettingUp(gesture, np.zeros((len(gesture), 2, 2), bool), ("getting_up", "back"), is_synthetic=True)


def complete_clip(motion: Motion, rows, heel_toe_contacts: np.ndarray,
                  getting_ups: Sequence[GettingUp]) -> CompletedClip:
    """Complete a clip that ends in flight with landing and getting up.

    Args:
        motion: T frames that end in flight.
        rows: its annotations.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact.
        getting_ups: movements of getting up; the best fitting one is used.
    Returns:
        The completed clip.
    """
    landing = add_landing(motion, [getting_up.motion for getting_up in getting_ups])
    getting_up = getting_ups[landing.get_up_index]
    contacts = np.zeros((len(landing.motion), 2, 2), bool)
    contacts[: landing.recorded_count] = heel_toe_contacts[: landing.recorded_count]
    getting_up_contacts = getting_up.heel_toe_contacts[np.rint(landing.get_up_frames).astype(int)]
    getting_up_contacts[: int(_FEET_DOWN * motion.fps)] = False
    contacts[landing.rise_frame : landing.rise_frame + len(getting_up_contacts)] = getting_up_contacts
    last = len(landing.motion) - 1
    synthetic_rows = (
        ClipAnnotation(landing.touch_frame, landing.rise_frame - 1, None, ("ground",)),
        ClipAnnotation(landing.rise_frame, last, None, tuple(getting_up.labels)),
    )
    recorded_rows = tuple(_extend_row(row, landing.recorded_count, last) for row in rows if row.start
                          < landing.recorded_count)
    return CompletedClip(landing.motion, (*recorded_rows, *synthetic_rows), contacts, landing.recorded_count)


def _extend_row(row: ClipAnnotation, recorded: int, last: int) -> ClipAnnotation:
    """Extend the row of a key moment that reaches the recording's end over the synthetic part, which is its exit."""
    if row.end < recorded - 1:
        return row
    key = None if row.key is None else min(row.key, recorded - 1)
    return replace(row, end=recorded - 1 if key is None else last, key=key)


def describe_landings(seconds: Sequence[float], getting_ups: Sequence[GettingUp]) -> list[str]:
    """Describe the completed clips in one line; no line where there are none. seconds: of each synthetic end."""
    if not seconds:
        return []
    by = "synthetic, since no clip shows it" if getting_ups[0].is_synthetic else "from the library's own clips"
    what = f"landing and getting up ({by}) added, {np.median(seconds):.1f} s each"
    return [f"{format_count(len(seconds), 'clip')} ending in flight: {what}"]
