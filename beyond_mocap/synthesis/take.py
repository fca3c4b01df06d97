"""The result of a synthesis: motion, source of every frame, ball, filled timeline and what was reported."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..annotation import KeyMoment, Timeline
from ..annotation.ball_contact import list_contact_labels
from ..motion.motion import Motion
from ..motion.track.ball_path import BallPath
from .heading_path import HeadingPath
from .pin import Pin
from .plan import Plan, SolvedTrajectory
from .search.edit_list import EditList


@dataclass(frozen=True, kw_only=True)
class KeyResult:
    """How one key moment was served.

    Attributes:
        requested: the key moment of the timeline.
        frame: output frame, fractional, where the clip's key frame is played.
        clip: path below the library.
        clip_frame: key frame in the clip's own rate.
        mirrored: whether the clip is mirrored.
        words: labels that the clip carries there, sides after mirroring.
        used_instead: the labels used where the library lacks the requested ones, else None.
    """

    requested: KeyMoment
    frame: float
    clip: str
    clip_frame: float
    mirrored: bool
    words: tuple[str, ...]
    used_instead: tuple[str, ...] | None = None

    @property
    def contact_labels(self) -> tuple[str, ...]:
        """Labels that define the part that meets the ball (`ball_contact.list_contact_labels`)."""
        return list_contact_labels(self.words, self.requested)


@dataclass(frozen=True)
class PinResult:
    """How one pin was met.

    Attributes:
        pin: the pin.
        miss: m by which a hand, a foot or the ball falls short of it, or rad that the gaze looks past it.
    """

    pin: Pin
    miss: float


@dataclass(frozen=True)
class DribbleTouch:
    """One touch of a dribble.

    Attributes:
        first: first output frame in which the ball is at the foot.
        last: last one.
        side: "left" or "right".
    """

    first: int
    last: int
    side: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Take:
    """A synthesized player.

    Attributes:
        motion: T frames at the output's rate on the pitch (metres, Z up).
        start_time: s on the track's clock of frame 0.
        clips: table of clip paths below the library.
        clip: (T,) index into it.
        clip_frame: (T,) fractional frame in that clip's own rate.
        mirrored: (T,) bool.
        words: T tuples, the source frame's labels, sides after mirroring.
        contacts: (T, 2) bool, left and right foot, carried from the source.
        seams: (S,) output frames that begin a new piece of clip.
        timeline: the filled timeline.
        keys: the results of the key moments.
        ball: the ball's path, None without a ball.
        method: of the search.
        seed: of the search.
        seconds: stage -> s that it took.
        warnings: what did not turn out as requested.
        correction: (T, 2) m by which foot correction moved each foot (left, right) from where the placed clip had it.
        ik_miss: (T, 2) m that each leg was short of where its foot should be.
        stepped: (T, 2) bool, extra steps of feet that are in contact in the source (no contacts).
        plan: the request.
        edit: what the search chose, at the library's rate, for `resynthesize`.
        pins: how the pins were met.
        is_cut_short: whether part of it was searched in a hurry.
        unpinned: motion and contacts without pins, None where there are none.
        solved: the ball's trajectory where it was solved.
        contact_ball: the ball as it was met, before it was led along that trajectory, None where it was not.
        dribble_touches: the touches of dribbles.
        planned_heading: (T,) rad from +x that was planned, None without a plan (`heading_plan`).
        heading_path: the same as it was decided, for updates.
    """

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
    is_cut_short: bool = False
    unpinned: tuple[Motion, np.ndarray] | None = None
    solved: SolvedTrajectory | None = None
    contact_ball: BallPath | None = None
    dribble_touches: tuple[DribbleTouch, ...] = ()
    planned_heading: np.ndarray | None = None
    heading_path: HeadingPath | None = None
