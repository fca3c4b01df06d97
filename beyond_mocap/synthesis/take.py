"""What came out: the motion on the pitch, where each of its frames came from, the ball, and the filled timeline."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..annotation import KeyMoment, Timeline
from ..annotation.ball_contact import meeting_words
from ..motion.motion import Motion
from ..motion.track.ball_path import BallPath
from .plan import Pin, Plan, SolvedCourse
from .search.edit_list import EditList


@dataclass(frozen=True, kw_only=True)
class KeyResult:
    """How one key moment was served.

    asked: the line of the timeline. frame: output frame (fractional) where the clip's key frame is played. clip
    (path below the library), clip_frame (in the clip's own rate), mirrored. words: what the clip carries there, sides
    after mirroring. used_instead: the words used where the asked ones were not to be had, else None."""

    asked: KeyMoment
    frame: float
    clip: str
    clip_frame: float
    mirrored: bool
    words: tuple[str, ...]
    used_instead: tuple[str, ...] | None = None

    @property
    def touching(self) -> tuple[str, ...]:
        """The words that say which part meets the ball (`ball_contact.meeting_words`)."""
        return meeting_words(self.words, self.asked.words)


@dataclass(frozen=True)
class PinResult:
    """How one pin was met: miss, m by which a hand or foot falls short of it,
    or radians that the gaze looks past it."""

    pin: Pin
    miss: float


@dataclass(frozen=True)
class DribbleTouch:
    """One touch of a dribble: output frames first .. last in which the ball is at the foot of that side."""

    first: int
    last: int
    side: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Take:
    """A synthesized player.

    motion: T frames at the output's rate on the pitch (metres, Z up); frame 0 is at `start_time` seconds on the track's
    clock. clips: table of clip paths below the library; clip (T,) index into it, clip_frame (T,) fractional frame in
    that clip's own rate, mirrored (T,) bool. words: per frame the source frame's words, sides after mirroring. contacts
    (T, 2) bool, left and right, carried from the source. seams: output frames that start a new piece of clip.
    correction: (T, 2) metres by which polish moved each foot (left, right) from where the clip laid out had it.
    ik_miss: (T, 2) metres that each leg was short of where its foot should stand. stepped: (T, 2) bool, left and right,
    extra steps of feet that stand in the source (no contacts). plan, edit: what was asked and what the search chose
    at the library's rate, for `resynthesize`. cut_short: whether part of it was searched in a hurry. pins: how they
    were met; unpinned: motion and contacts without them, None where there are none. solved: the ball's course where it
    was solved; met_ball: the ball as it was met, before it was led along that course, None where it was not; dribbled:
    the touches of dribbles."""

    motion: Motion
    start_time: float
    clips: tuple[str, ...]
    clip: np.ndarray
    clip_frame: np.ndarray
    mirrored: np.ndarray
    words: tuple[tuple[str, ...], ...]
    contacts: np.ndarray
    seams: np.ndarray
    timeline: Timeline
    keys: tuple[KeyResult, ...]
    ball: BallPath | None
    method: str
    seed: int
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    correction: np.ndarray | None = None
    ik_miss: np.ndarray | None = None
    stepped: np.ndarray | None = None
    plan: Plan | None = None
    edit: EditList | None = None
    pins: tuple[PinResult, ...] = ()
    cut_short: bool = False
    unpinned: tuple[Motion, np.ndarray] | None = None
    solved: SolvedCourse | None = None
    met_ball: BallPath | None = None
    dribbled: tuple[DribbleTouch, ...] = ()
