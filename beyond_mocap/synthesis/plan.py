"""The request for one player (`Plan`) and the same resolved for a library (`ResolvedPlan`, built by `resolve_plan`).

A plan holds track, timeline, ball, pins, library and settings; the resolved plan is what search, construction, edits
and explanations work with.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..annotation import Timeline
from ..base.errors import InputError, format_seconds
from ..base.settings import collect_defaults, find_setting, list_settings
from ..base.settings.setting import LATER, LATER_PART, add_fields, check_limits
from ..base.time_series import interpolate_columns
from ..motion.skeleton import freeze_array
from ..motion.track import SampledTrack, Track, sample_track
from .ball_pins import assign_ball_pins, lead_ball_to_pins, list_key_times
from .contact_edit import ContactEdit
from .heading_path import HeadingPath
from .heading_plan import FPS, plan_heading_path, rest_track, sample_heading, update_heading_path
from .heading_request import HeadingKey, HeadingRequest, Play
from .known_body import KnownBody
from .pin import GAZE, PARTS, Pin

FEET = ("", "left", "right")
METHODS = find_setting("synthesis", "method").choice_names
MASSES = find_setting("player", "masses").choice_names
_DEFAULTS = collect_defaults("synthesis", "player")
_HEIGHT = find_setting("player", "height")
_SAME = 1e-5  # s by which the end of a hold and the next key may differ where both are meant to be one time


@dataclass(frozen=True)
class PlayerTouch:
    """A player changed the ball's course.

    Attributes:
        time: s.
        is_own: whether it was this player, None where no tracked player was near.
        part: "foot", "head", "chest", "hand", or "" where that is not known.
        kind: a label such as "kick" or "receive".
    """

    time: float
    is_own: bool | None
    part: str
    kind: str


@dataclass(frozen=True, eq=False)
class SolvedTrajectory:
    """The ball's trajectory, solved from its samples.

    Attributes:
        times: (M,) s, ascending.
        ball: (M, 3) m, its centre, world, NaN where it is not known.
        filled: (M,) bool, where the feed has not measured it.
        touches: the touches of all players, in order of time.
    """

    times: np.ndarray
    ball: np.ndarray
    filled: np.ndarray
    touches: tuple[PlayerTouch, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "times", freeze_array(self.times))
        object.__setattr__(self, "ball", freeze_array(self.ball))
        object.__setattr__(self, "filled", freeze_array(self.filled, bool))

    def interpolate(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Interpolate the trajectory.

        Args:
            times: (T,) s.
        Returns:
            The ball (T, 3) m, NaN where it is not known, and whether the feed has filled it in (T,).
        """
        ball = interpolate_columns(times, self.times, self.ball, fill_value=np.nan)
        near = np.clip(np.searchsorted(self.times, times), 0, len(self.times) - 1)
        return ball, self.filled[near]


@dataclass(frozen=True)
@add_fields(list_settings("synthesis"))
class Plan:
    """The request for one player.

    Fields with a default in the settings table are described there; settings of "synthesis" that do not appear here are
    fields all the same.

    Attributes:
        track: the player's samples, cleaned (`motion.track.clean_track`), with the ball where the feed has it.
        timeline: the requested annotations (`annotation.read_timeline`), not yet filled.
        library: folder of the library.
        pins: where hands, feet, gaze and ball have to be, in order of time.
        heading_keys: where the body has to face, in order of time; the rest is planned (`heading_plan`).
        contact_edits: contacts of the feet that are moved, longer, shorter, left out or added, in order of time.
        gaits: (gait label, clip) pairs; other gaits are found among all clips.
        height: m, of the player; 0 for the library's.
        strong_foot: one of FEET.
        masses: one of MASSES.
        style: labels, or names or patterns of folders and clips ("academy", "lmd/*").
        solved: the ball's trajectory where it is known already, such as from a whole match.
        heading_path: the planned heading where it is known already, such as over a whole match.
        bodies: stretches that are shown as cameras have seen them, in order of time.
    Raises:
        InputError: for a number outside the limits of its setting, and for two pins of one part or two heading keys at
            one time.
    Source: Faustino 2016: catch_up §3.3.2, alpha eq. 13 (for "path" `synthesis.search.path_costs`), delta §3.2.4, omega
        and gaits §3.1.1, seam_window eq. 25 (twice its s; "path" blends over half of it). Others: made in
        `library.synthetic_clips`, track_window in `motion.track.smooth_positions`, solve_touches in
        `resolved_touches`, lag in `match.crowd.variety.choose_lags`; the root error is always measured with a
        root_window of 1.5.
    """

    track: Track
    timeline: Timeline = field(default_factory=Timeline)
    library: str = ""
    method: str = _DEFAULTS["method"]
    catch_up: bool = _DEFAULTS["catch_up"]
    fps: float = _DEFAULTS["fps"]
    alpha: float = _DEFAULTS["alpha"]
    mirror: bool = _DEFAULTS["mirror"]
    nearest: bool = _DEFAULTS["nearest"]
    seed: int = _DEFAULTS["seed"]
    delta: float = _DEFAULTS["delta"]
    omega: float = _DEFAULTS["omega"]
    made: bool = _DEFAULTS["made"]
    seam_window: float = _DEFAULTS["seam_window"]
    track_window: float = _DEFAULTS["track_window"]
    root_window: float = _DEFAULTS["root_window"]
    gaits: tuple[tuple[str, str], ...] = ()
    pins: tuple[Pin, ...] = ()
    heading_keys: tuple[HeadingKey, ...] = field(default=(), metadata=LATER)
    contact_edits: tuple[ContactEdit, ...] = field(default=(), metadata=LATER)
    height: float = 0.0
    strong_foot: str = ""
    style: tuple[str, ...] = ()
    style_weight: float = _DEFAULTS["style_weight"]
    solve_touches: bool = field(default=_DEFAULTS["solve_touches"], metadata={**LATER, "was": False})
    variety: float = field(default=_DEFAULTS["variety"], metadata=LATER)
    lag: float = field(default=_DEFAULTS["lag"], metadata=LATER)
    manner: int = field(default=_DEFAULTS["manner"], metadata=LATER)
    solved: SolvedTrajectory | None = field(default=None, compare=False, repr=False, metadata=LATER)
    heading_path: HeadingPath | None = field(default=None, compare=False, repr=False, metadata=LATER)
    bodies: tuple[KnownBody, ...] = field(default=(), compare=False, repr=False, metadata=LATER_PART)
    watch: float = field(default=_DEFAULTS["watch"], metadata=LATER)
    strength: float = field(default=_DEFAULTS["strength"], metadata=LATER)
    masses: str = field(default=_DEFAULTS["masses"], metadata=LATER)
    fatigue: float = field(default=_DEFAULTS["fatigue"], metadata=LATER)
    exertion: float = field(default=_DEFAULTS["exertion"], metadata=LATER)

    def __post_init__(self):
        object.__setattr__(self, "pins", tuple(sorted(self.pins, key=lambda pin: (pin.time, pin.part))))
        object.__setattr__(self, "contact_edits", tuple(sorted(self.contact_edits,
                                                               key=lambda edit: (edit.time, edit.foot))))
        object.__setattr__(self, "heading_keys", tuple(sorted(self.heading_keys, key=lambda key: key.time)))
        object.__setattr__(self, "style", tuple(dict.fromkeys(self.style)))
        check_limits(self, (*list_settings("synthesis"), *list_settings("player")))
        if 0.0 < self.omega < 1.0:
            raise InputError("omega", f"{self.omega:g}", "1 or more, or 0 for the default thresholds")
        if self.height and not _HEIGHT.least <= self.height <= _HEIGHT.most:
            limits = f"{_HEIGHT.least:g} to {_HEIGHT.most:g} m, or 0 for the height of the library's skeleton"
            raise InputError("height", f"{self.height:g} m", limits)
        if self.strong_foot not in FEET:
            raise InputError("strong foot", repr(self.strong_foot), "left, right, or empty for any")
        if self.masses not in MASSES:
            raise InputError("masses", repr(self.masses), f"one of {', '.join(MASSES)}")
        self._check_pins()
        self._check_heading_keys()

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Settings that do not appear above."""

    def sample_track(self, fps: float) -> SampledTrack:
        """Sample the track, with the solved ball (`sample_with_trajectory`), at `fps` frames per second."""
        return sample_with_trajectory(self.track, self.solved, fps, self.track_window)

    def _check_pins(self):
        """Raise InputError for two pins of one part at one time."""
        for part in PARTS:
            part_pins = [pin for pin in self.pins if pin.part == part]
            for before, after in zip(part_pins, part_pins[1:]):
                if after.time <= before.end:
                    found = f"two pins of {part} at {format_seconds(after.time)} s"
                    raise InputError("pins", found, "one place at a time", "move one, or shorten the earlier hold")

    def _check_heading_keys(self):
        """Raise InputError for two heading keys at one time; one may begin where another ends."""
        for before, after in zip(self.heading_keys, self.heading_keys[1:]):
            if after.time == before.time or after.time < before.end - _SAME:
                found = f"two keys at {format_seconds(after.time)} s"
                raise InputError("heading keys", found, "one heading at a time",
                                 "move one, or shorten the earlier hold")


def _scale_pin(pin: Pin, size: float) -> Pin:
    """Scale a pin to the library's size."""
    x, y, z = pin.position
    return replace(pin, position=(x / size, y / size, z / size))


def sample_with_trajectory(track: Track, trajectory: SolvedTrajectory | None, fps: float,
                           window: float) -> SampledTrack:
    """Sample a track with its solved ball.

    Where the ball is solved, its solved height is used everywhere, and its solved place where the feed has not measured
    it; where the feed has, the ball is met within the noise of the measurement.

    Args:
        track: the track.
        trajectory: the ball's trajectory, None without one.
        fps: frames per second.
        window: s, of the window that removes the feed's jitter.
    """
    sampled = sample_track(track, fps, window)
    if trajectory is None:
        return sampled
    ball, filled = trajectory.interpolate(sampled.times)
    known = np.isfinite(ball).all(axis=1)
    measured = sampled.ball_measured & ~(known & filled)
    return replace(
        sampled, ball=np.where(known[:, None] & (~measured[:, None] | [False, False, True]), ball, sampled.ball),
        ball_measured=measured,
    )  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class ResolvedPlan:
    """A plan with its touches resolved, in the size of the library's skeleton.

    Attributes:
        requested: the plan as requested; its settings hold as they are, its pins are in the player's size.
        timeline: the requested annotations, not yet filled, with key moments at the touches that they mean.
        track: the player's samples, m in the library's size.
        trajectory: the ball's trajectory, m in the player's size; None where it is not solved.
        size: how many times as tall as the library's skeleton the player is.
        known_path: the planned heading of a take that is updated, None for none.
    """

    requested: Plan
    timeline: Timeline
    track: Track
    trajectory: SolvedTrajectory | None
    size: float
    known_path: HeadingPath | None = None
    _sampled: dict[tuple[float, bool], SampledTrack] = field(default_factory=dict, init=False, repr=False)
    _rested: dict[tuple[float, bool], SampledTrack] = field(default_factory=dict, init=False, repr=False)

    @property
    def method(self) -> str:
        """Method of the search, one of `plan.METHODS`."""
        return self.requested.method

    @property
    def fps(self) -> float:
        """Output frames per second."""
        return self.requested.fps

    @cached_property
    def heading_path(self) -> HeadingPath:
        """The planned heading; method "path" only."""
        return self.requested.heading_path or self.known_path or self.plan_heading()

    def plan_heading(self, play: Play | None = None) -> HeadingPath:
        """Plan the heading.

        Args:
            play: what a player of a match faces beside the ball.
        Returns:
            The planned heading, the same whatever frame rate it is read at.
        """
        return plan_heading_path(self._rest_track(FPS), self._build_heading_request(play))

    def update_heading(self, old: ResolvedPlan) -> ResolvedPlan:
        """Return the plan with the planned heading of an old one, changed only where track, ball or keys have."""
        if self.method != "path" or self.requested.heading_path is not None:
            return self
        tracks = [plan._rest_track(FPS) for plan in (self, old)]
        requests = [plan._build_heading_request(None) for plan in (self, old)]
        path = update_heading_path(old.heading_path, tracks[0], requests[0], tracks[1], requests[1])
        return replace(self, known_path=path)

    def _build_heading_request(self, play: Play | None) -> HeadingRequest:
        """Build what is asked of the heading, in the library's size."""
        size = self.size
        gazes = [_scale_pin(pin, size) for pin in self.requested.pins if pin.part == GAZE]
        keys = self._find_heading_keys()
        return HeadingRequest(keys=keys, gazes=tuple(gazes), spans=self.timeline.spans, play=play)

    def _find_heading_keys(self) -> tuple[HeadingKey, ...]:
        """Find the heading keys that hold at any time of the track, or of a whole match's, in the library's size."""
        size, (start, end) = self.size, self.track.times[[0, -1]]
        return tuple(
            key if key.target is None else replace(key, target=(key.target[0] / size, key.target[1] / size))
            for key in self.requested.heading_keys
            if self.requested.heading_path is not None or key.is_within(start, end)
        )

    def sample_track(self, fps: float, rests: bool = True) -> SampledTrack:
        """Sample the track, with the solved ball, in the library's size; each of its forms is computed once.

        With method "path" it has the places and headings of the body.

        Args:
            fps: frames per second.
            rests: whether the body of a slow track may rest (`motion.track.resting_place`); method "path" only.
        """
        if (fps, rests) not in self._sampled:
            if self.method == "path":
                sampled = self._rest_track(fps, rests)
                heading, held = sample_heading(self.heading_path, self._find_heading_keys(), sampled)
                self._sampled[fps, rests] = replace(sampled, heading=heading, held=held)
            else:
                self._sampled[fps, rests] = self._sample_ball_track(fps)
        return self._sampled[fps, rests]

    def _rest_track(self, fps: float, rests: bool = True) -> SampledTrack:
        """Sample the track with the places of the body, once for each rate: headings are planned from it too."""
        if (fps, rests) not in self._rested:
            self._rested[fps, rests] = rest_track(self._sample_ball_track(fps), rests)
        return self._rested[fps, rests]

    def _sample_ball_track(self, fps: float) -> SampledTrack:
        """Sample the track, with the solved ball through its pins, in the library's size, as it was measured."""
        trajectory = self.trajectory
        if trajectory is not None and self.size != 1.0:
            trajectory = replace(trajectory, ball=trajectory.ball / self.size)
        sampled = sample_with_trajectory(self.track, trajectory, fps, self.requested.track_window)
        ball = self.lead_ball(sampled.times, sampled.ball, self.size)
        return sampled if ball is sampled.ball else replace(sampled, ball=ball)

    @cached_property
    def ball_pins(self) -> dict[Pin, Pin]:
        """The requested pins of the ball -> the same when their key moments are played, in the player's size."""
        return assign_ball_pins(self.requested.pins, self.timeline)

    def lead_ball(self, times: np.ndarray, ball: np.ndarray, size: float = 1.0) -> np.ndarray:
        """Lead the ball's trajectory through its pins (`ball_pins.lead_ball_to_pins`).

        Args:
            times: (T,) s, at an even rate.
            ball: (T, 3) m.
            size: times as tall as the library's skeleton that the player is, for a ball in the library's size.
        Returns:
            (T, 3) m; the same array without pins.
        """
        pins = [_scale_pin(pin, size) for pin in self.ball_pins.values()]
        touches = () if self.trajectory is None else self.trajectory.touches
        fixed = [*list_key_times(self.timeline), *(touch.time for touch in touches)]
        return lead_ball_to_pins(times, ball, pins, fixed)
