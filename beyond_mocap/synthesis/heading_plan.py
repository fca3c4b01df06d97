"""The planned heading of a player: where the body faces at every moment, decided before any clip is chosen.

Above 3 m/s the body faces its travel, between 1 and 3 m/s it faces between travel and ball and walks backward or
sideways where they differ, and below 1 m/s, where the direction of a creeping track is noise, it faces the ball, or
where the ball goes if that is far. It turns the short way at limited speed, rests within a dead zone, and does not go
sideways for long. What is asked takes part: given headings, pins of the gaze, labels with a direction. All of these
weigh against each other, and the ball comes back; so the plan is the cheapest path through all headings of all moments
(dynamic programming, `heading_path`), not a filter, which cannot look ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..annotation import LOCOMOTION, Span
from ..annotation.gaits import STANDING
from ..annotation.vocabulary import DIRECTIONS, SIDES
from ..base.easing import smoothstep
from ..base.errors import InputError
from ..base.time_series import find_runs, interpolate_columns, time_derivative
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.skeleton import freeze_array
from ..motion.track import SampledTrack, smooth_zero_phase_hann
from ..motion.track.resting_place import LEAST_LEEWAY, relax_track
from .heading_path import BIN_ANGLE, BINS, HeadingPath, find_cheapest_path, replace_part

FPS = 30.0  # at which headings are planned, whatever the rate of the take

# Costs per second, of angles in radians. They were chosen on 167 minutes of a tracked match, for few turns and
# headings near ball and travel: no snap turns, 0.02 spins a minute, 13 degrees from the ball below 1 m/s (median).
DEAD_ZONE = np.radians(20.0)  # within which the body does not follow the ball
BALL_COST = 1.0  # per radian beyond it, half of that from 3 m/s on
PULL_COST = 0.02  # per radian to the ball, also within: where all cost alike, an edit far away would choose more often
TRAVEL_COST = 6.0  # per radian beyond TRAVEL_LIMITS
FORWARD_COST = 0.3  # per radian to travel and m/s above 0.6: forward is cheaper
SIDEWAYS_COST, SIDEWAYS_WIDTH = 2.5, np.radians(45.0)  # at a right angle to travel, and the width of that bell
TURN_COST, TURN_RATE_COST, TURN_ANGLE_COST = 0.12, 0.08, 0.7  # per second of turning, per (pi / s)^2, per radian
GIVEN_COST = 40.0  # per radian and second: given headings hold against all others
DIRECTION_COST = 12.0  # per radian beyond the dead zone from the heading that a label asks for: above TRAVEL_COST
OTHER_WAY_COST = 8.0  # per radian that is turned against a label: the long way round is cheaper
GAZE_COST, GAZE_REACH = 6.0, np.radians(45.0)  # per radian beyond what hips and shoulders turn towards a pinned gaze
KEEPER_BALL_COST, KEEPER_SIDEWAYS = 3.0, 0.5  # of a goalkeeper, at any speed up to 3 m/s; share of SIDEWAYS_COST

_UPDATE_SECONDS = 1.5  # before and after a change in which an update plans again: half a turn takes one second
_NOTICED_COST = 1e-3  # by which a heading's cost at a decision differs where an update plans it again
ASKED_SECONDS = 3.0
"""Seconds before and after what is asked in which it may change the plan; elsewhere it does not."""

HOLD_FADE = 0.7
"""Seconds before and after a heading key over which the body comes to hold it."""

_TRAVEL_SPEEDS = np.array([1.6, 2.2, 3.0, 4.5])  # m/s, with the largest angle between heading and travel at each
_KEEPER_SPEEDS = np.array([3.0, 3.6, 4.4, 5.5])
_TRAVEL_LIMITS = np.radians([180.0, 60.0, 35.0, 25.0])
_STANDING_TURN, _RUNNING_TURN, _RUNNING_SPEED = 3, 4, 2.2  # bins per decision (180 and 240 degrees/s); m/s
_CALM_TURN = 2  # the same towards what is asked (120 degrees/s): a body that is held to a faster turn snaps
_APPROACH = 1.5  # s in which a body turns by 180 degrees that calmly, before and after
_STEPS = np.arange(-_RUNNING_TURN, _RUNNING_TURN + 1)  # bins from one decision to the next
_NEAR_BALL = 2.0  # m; a nearer ball has no bearing, the last one holds
_FAR_BALL = (25.0, 30.0)  # m between which the way of the ball takes its place
_BALL_LEAD = 1.0  # s that the way of a far ball is ahead of it
_BALL_GAP = 2.0  # s; the ball is not known in longer gaps
_DIRECTION_SPEED = 0.3  # m/s from which on a track has a direction that a label can mean
_FAR_MISS = np.radians([45.0, 135.0])  # between which a given heading counts as one that the body cannot reach in time
_GAZE_SECONDS = 0.3  # s before and after a pin of the gaze in which it counts

_DECISION_SECONDS = 1.0 / 6.0
_VELOCITY_SECONDS = 1.0  # s, of the travel and the ball that are faced
_TURNING = "turning"


@dataclass(frozen=True)
class HeadingKey:
    """A heading that is given for some time, at most until the next one.

    Attributes:
        time: s on the track's clock from which on it holds.
        heading: rad from +x, world; None: towards `target`.
        target: (x, y) m, world, that the body faces; None: `heading` holds.
        hold: s for which it holds.
    Raises:
        InputError: for neither or both, and for values that are not finite.
    """

    time: float
    heading: float | None = None
    target: tuple[float, float] | None = None
    hold: float = 0.0

    def __post_init__(self):
        values = [self.time, self.hold, *(() if self.heading is None else (self.heading,)), *(self.target or ())]
        if (self.heading is None) == (self.target is None):
            raise InputError("heading key", f"{self.time:g} s: heading {self.heading}, target {self.target}",
                             "a heading or a target", "give one of the two")
        if not np.isfinite(values).all():
            raise InputError("heading key", "a value that is not finite", "finite numbers", "correct the key")
        if self.hold < 0.0:
            raise InputError("heading key", f"a hold of {self.hold:g} s", "0 s or more", "correct the key")

    @property
    def end(self) -> float:
        """Seconds until which it holds."""
        return self.time + self.hold

    def is_within(self, start: float, end: float) -> bool:
        """Whether it holds at any time from `start` to `end` s."""
        return self.time <= end and self.end >= start


@dataclass(frozen=True, eq=False)
class Play:
    """What a player of a match faces beside the ball.

    Attributes:
        times: (M,) s on the track's clock, ascending.
        places: (M, 2) m that the body faces while the ball is not known, NaN where there is nothing to face.
        is_keeper: whether this is a goalkeeper, who faces the ball also when moving.
        keys: headings that the feed has measured, in order of time.
    """

    times: np.ndarray
    places: np.ndarray
    is_keeper: bool = False
    keys: tuple[HeadingKey, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "times", freeze_array(self.times))
        object.__setattr__(self, "places", freeze_array(self.places))


@dataclass(frozen=True, kw_only=True)
class HeadingRequest:
    """What is asked of the heading of a player.

    Attributes:
        keys: headings that are given; each ends where the next one begins.
        gazes: pins of the gaze: objects with `time`, `hold` and `end` s and `position` m (`plan.Pin`).
        spans: labels that the user asks for; a gait with a direction and turning with a side count.
        play: what a player of a match faces beside the ball, None where that is not known.
    """

    keys: tuple[HeadingKey, ...] = ()
    gazes: tuple[Any, ...] = ()
    spans: tuple[Span, ...] = ()
    play: Play | None = None

    @property
    def is_keeper(self) -> bool:
        """Whether it is a goalkeeper's."""
        return self.play is not None and self.play.is_keeper

    @property
    def measured_keys(self) -> tuple[HeadingKey, ...]:
        """Headings that the feed has measured, which the body turns to as fast as bodies do."""
        return () if self.play is None else self.play.keys


def plan_track(track: SampledTrack, keys: Sequence[HeadingKey] = (), rests: bool = True) -> SampledTrack:
    """Plan where the body of a track rests and where it faces.

    Args:
        track: the player's track with the ball, T frames.
        keys: headings that are given.
        rests: whether the body may rest where the track hardly moves; False: it is on the track.
    Returns:
        The same with the places and headings of the body.
    """
    relaxed = rest_track(track, rests)
    return replace(relaxed, heading=plan_heading(relaxed, keys))


def rest_track(track: SampledTrack, rests: bool = True) -> SampledTrack:
    """Let the body of a track rest where the track hardly moves; with `rests` False it is on the track."""
    return relax_track(track) if rests else replace(track, leeway=np.full(len(track), LEAST_LEEWAY))


def plan_heading(track: SampledTrack, keys: Sequence[HeadingKey] = ()) -> np.ndarray:
    """Plan the heading of a player: (T,) rad from +x, unwrapped, for the arguments of `plan_heading_path`."""
    return sample_heading(plan_heading_path(track, HeadingRequest(keys=tuple(keys))), keys, track)[0]


def plan_heading_path(track: SampledTrack, request: HeadingRequest) -> HeadingPath:
    """Plan the heading of a player.

    Args:
        track: the player's track with the ball, T frames; its positions are where the body will be.
        request: what is asked.
    Returns:
        The planned heading.
    Source: Reconstructed from the rules of ../shared/metrics.md, *Heading plan*.
    """
    weighed = _weigh_headings(track, request)
    bins = find_cheapest_path(weighed.plain, weighed.plain_steps)
    for first, end in find_runs(weighed.is_asked):
        bins = replace_part(bins, first, end, weighed.costs, weighed.steps)
    return HeadingPath(weighed.times, bins)


def update_heading_path(path: HeadingPath, track: SampledTrack, request: HeadingRequest, old_track: SampledTrack,
                        old_request: HeadingRequest) -> HeadingPath:
    """Update a planned heading after its track, ball or what is asked has changed: far from it every heading stays.

    Within its dead zone a plan may rest at one of several headings that cost almost the same. Planned from scratch,
    it could rest at another one for minutes because something moved elsewhere.

    Args:
        path: the heading planned before.
        track, request: as for `plan_heading_path`.
        old_track, old_request: those of the path.
    Returns:
        The planned heading; a whole new one where the times differ.
    """
    weighed, old = _weigh_headings(track, request), _weigh_headings(old_track, old_request)
    if not np.array_equal(weighed.times, old.times) or not np.array_equal(path.times, old.times):
        return plan_heading_path(track, request)
    differs = np.abs(weighed.costs - old.costs).max(axis=1) > _NOTICED_COST
    differs |= np.any(np.isfinite(weighed.steps) != np.isfinite(old.steps), axis=1)
    changed = weighed.times[differs]
    reach = np.searchsorted(changed, weighed.times[:, None] + [-_UPDATE_SECONDS, _UPDATE_SECONDS])
    bins = path.bins
    for first, end in find_runs(reach[:, 1] > reach[:, 0]):
        bins = replace_part(bins, first, end, weighed.costs, weighed.steps)
    return HeadingPath(path.times, bins)


@dataclass(frozen=True, eq=False)
class _WeighedHeadings:
    """What every heading costs at each of D decisions.

    Attributes:
        times: (D,) s.
        plain, plain_steps: costs where nothing is asked, as for `find_cheapest_path`.
        costs, steps: the same with what is asked.
        is_asked: (D,) bool, decisions that what is asked changes.
    """

    times: np.ndarray
    plain: np.ndarray
    plain_steps: np.ndarray
    costs: np.ndarray
    steps: np.ndarray
    is_asked: np.ndarray


def _weigh_headings(track: SampledTrack, request: HeadingRequest) -> _WeighedHeadings:
    """Weigh all headings at all decisions of a track."""
    count = len(track)
    at = np.arange(0, count, max(int(round(_DECISION_SECONDS * track.fps)), 1))
    if at[-1] != count - 1:
        at = np.append(at, count - 1)
    bearings = _compute_bearings(track, request.play, at)
    plain, plain_steps = _compute_heading_costs(bearings, request.is_keeper), _compute_step_costs(bearings)
    costs, steps, is_asked = plain, plain_steps, _find_asked(bearings, request)
    if is_asked.any():
        asked_costs = _compute_asked_costs(bearings, request)
        costs = costs + asked_costs + _measure_key_costs(bearings, request.measured_keys) * bearings.seconds[:, None]
        steps = _limit_turns(bearings, request, steps, asked_costs)
    return _WeighedHeadings(times=bearings.times, plain=plain, plain_steps=plain_steps, costs=costs, steps=steps,
                            is_asked=is_asked)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Bearings:
    """What a heading is weighed against at each of D decisions.

    Attributes:
        times: (D,) s.
        seconds: (D,) from each decision to the next.
        positions: (D, 2) m.
        speed: (D,) m/s.
        travel: (D,) rad, direction of travel.
        ball: (D,) rad, bearing of the ball or of the play, NaN where there is neither.
    """

    times: np.ndarray
    seconds: np.ndarray
    positions: np.ndarray
    speed: np.ndarray
    travel: np.ndarray
    ball: np.ndarray


def _compute_bearings(track: SampledTrack, play: Play | None, at: np.ndarray) -> _Bearings:
    """Compute smoothed speed, travel and bearing of the ball at the frames `at` (D,)."""
    velocity = smooth_zero_phase_hann(track.velocity, track.fps, _VELOCITY_SECONDS)[at]
    bearing, offset = np.full(len(track), np.nan), _compute_faced_place(track, play) - track.positions
    far = np.flatnonzero(np.linalg.norm(offset, axis=1) >= _NEAR_BALL)
    if len(far):
        # the last far ball's bearing holds; before the first one, that one's
        last = far[np.maximum(np.searchsorted(far, np.arange(len(track)), side="right") - 1, 0)]
        bearing = arctan2(offset[last, 1], offset[last, 0])
    times = np.round(track.times[at], 6)
    seconds = np.diff(times, append=times[-1] + _DECISION_SECONDS)
    return _Bearings(times=times, seconds=seconds, positions=track.positions[at], ball=bearing[at],
                     speed=np.linalg.norm(velocity, axis=1), travel=arctan2(velocity[:, 1], velocity[:, 0]))


def _compute_faced_place(track: SampledTrack, play: Play | None) -> np.ndarray:
    """Compute the place (T, 2) m that a slow body faces: the ball, where a far one goes, or the play without a ball.

    NaN where there is none of these: a ball that is lost for long is not between where it was and where it will be.
    """
    known = np.isfinite(track.ball[:, :2]).all(axis=1)
    place, lost = np.full((len(track), 2), np.nan), np.ones(len(track), bool)
    if known.any():
        ball = smooth_zero_phase_hann(interpolate_columns(track.times, track.times[known], track.ball[known, :2]),
                                      track.fps, _VELOCITY_SECONDS)
        distance = np.linalg.norm(ball - track.positions, axis=1)
        ahead = _BALL_LEAD * smoothstep(distance, *_FAR_BALL)[:, None]
        place = ball + ahead * time_derivative(ball, track.fps)
        lost[:] = False
        for first, end in find_runs(~(known & track.ball_measured)):
            lost[first:end] = end - first > _BALL_GAP * track.fps
    if play is None:
        return np.where(lost[:, None], np.nan, place)
    place = np.where(lost[:, None], interpolate_columns(track.times, play.times, play.places), place)
    return smooth_zero_phase_hann(place, track.fps, _VELOCITY_SECONDS) if lost.any() else place


def _compute_heading_costs(bearings: _Bearings, is_keeper: bool) -> np.ndarray:
    """Compute the cost (D, BINS) of every heading at every decision where nothing is asked."""
    v = bearings.speed[:, None]
    from_ball, from_travel = _measure_angles(bearings.ball), _measure_angles(bearings.travel)
    ball_cost = KEEPER_BALL_COST if is_keeper else BALL_COST * 0.5 * (1.0 + _compute_slowness(v))
    cost = ball_cost * np.maximum(from_ball - DEAD_ZONE, 0.0) + PULL_COST * from_ball
    limits = np.interp(v, _KEEPER_SPEEDS if is_keeper else _TRAVEL_SPEEDS, _TRAVEL_LIMITS)
    cost += TRAVEL_COST * np.maximum(from_travel - limits, 0.0)
    cost += FORWARD_COST * np.clip(v - 0.6, 0.0, 3.0) * from_travel
    bell = np.exp(-(((from_travel - np.pi / 2.0) / SIDEWAYS_WIDTH) ** 2))
    sideways = SIDEWAYS_COST * (KEEPER_SIDEWAYS if is_keeper else 1.0)
    cost += sideways * bell * np.clip((v - 0.5) / 0.7, 0.0, 1.0)
    return cost * bearings.seconds[:, None]


def _compute_slowness(speed: np.ndarray) -> np.ndarray:
    """Compute how slow a body is: 1 up to 1 m/s, 0 from 3 m/s on."""
    return 1.0 - np.clip((speed - 1.0) / 2.0, 0.0, 1.0)


def _find_asked(bearings: _Bearings, request: HeadingRequest) -> np.ndarray:
    """Find the decisions (D,) bool that what is asked changes; all others stay as they are without it."""
    spans = [span for span in request.spans if _find_quarter(span) is not None or _find_turning_side(span) is not None]
    held = [(pin.time, pin.end) for pin in (*request.keys, *request.measured_keys, *request.gazes)]
    starts, ends = np.array([*held, *((span.start, span.end) for span in spans)]).reshape(-1, 2).T
    begun = np.searchsorted(np.sort(starts - ASKED_SECONDS), bearings.times, side="right")
    return begun > np.searchsorted(np.sort(ends + ASKED_SECONDS), bearings.times, side="left")


def _compute_asked_costs(bearings: _Bearings, request: HeadingRequest) -> np.ndarray:
    """Compute the cost (D, BINS) that what is asked adds to every heading at every decision."""
    cost, slow = np.zeros((len(bearings.times), BINS)), _compute_slowness(bearings.speed)[:, None]
    for pin in request.gazes:
        at = np.flatnonzero((bearings.times >= pin.time - _GAZE_SECONDS) & (bearings.times <= pin.end + _GAZE_SECONDS))
        offset = np.asarray(pin.position[:2]) - bearings.positions[at]
        gaze = arctan2(offset[:, 1], offset[:, 0])
        cost[at] += GAZE_COST * slow[at] * np.maximum(_measure_angles(gaze) - GAZE_REACH, 0.0)
    asked = _compute_asked_heading(bearings, request.spans)
    cost += DIRECTION_COST * np.maximum(_measure_angles(asked) - DEAD_ZONE, 0.0)
    return (cost + _measure_key_costs(bearings, request.keys)) * bearings.seconds[:, None]


def _measure_key_costs(bearings: _Bearings, keys: Sequence[HeadingKey]) -> np.ndarray:
    """Measure the cost per second (D, BINS) that given headings add to every heading at every decision."""
    if not keys:
        return np.zeros((len(bearings.times), BINS))
    given = _Given(keys)
    key = given.find_keys(bearings.times + 0.5 * _DECISION_SECONDS)
    heading = given.compute_heading(key, bearings.positions)
    is_held = bearings.times <= given.ends[key] + 0.5 * _DECISION_SECONDS
    is_held &= bearings.times >= given.starts[key] - 0.5 * _DECISION_SECONDS
    return GIVEN_COST * _measure_angles(np.where(is_held, heading, np.nan))


def _measure_angles(bearing: np.ndarray) -> np.ndarray:
    """Measure the angle (D, BINS) rad of every heading from a bearing (D,), 0 where that is NaN."""
    return np.nan_to_num(np.abs(quaternion.wrap_angle(BIN_ANGLE * np.arange(BINS) - bearing[:, None])))


class _Given:
    """The headings that K keys give, in order of time; each key ends where the next one begins.

    Attributes:
        starts, ends: (K,) s.
        gaps: (K + 1,) s before each key and after the last one in which none holds; inf at both ends.
    """

    def __init__(self, keys: Sequence[HeadingKey]):
        keys = sorted(keys, key=lambda key: key.time)
        self.starts = np.array([key.time for key in keys])
        self.ends = np.minimum([key.end for key in keys], np.append(self.starts[1:], np.inf))
        self.gaps = np.concatenate([[np.inf], self.starts[1:] - self.ends[:-1], [np.inf]])
        self._headings = np.array([np.nan if key.heading is None else key.heading for key in keys])
        self._targets = np.array([key.target or (0.0, 0.0) for key in keys])

    def find_keys(self, times: np.ndarray) -> np.ndarray:
        """Find the last key (T,) that has begun at `times` (T,) s, before the first one that one."""
        return np.maximum(np.searchsorted(self.starts, times, side="right") - 1, 0)

    def compute_heading(self, rows: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Compute the heading (T,) rad that the keys `rows` (T,) give at positions (T, 2) m."""
        offset, headings = self._targets[rows] - positions, self._headings[rows]
        return np.where(np.isnan(headings), arctan2(offset[:, 1], offset[:, 0]), headings)


def sample_heading(path: HeadingPath, keys: Sequence[HeadingKey],
                   track: SampledTrack) -> tuple[np.ndarray, np.ndarray | None]:
    """Sample a planned heading, which where keys hold is exactly the one that they give.

    The plan comes near it, in steps of ten degrees and smoothed; what it misses is added back where a key holds, and
    fades out within HOLD_FADE s or until the next key. Much more than that is a heading that the body has not the time
    to reach, and stays.

    Args:
        path: the planned heading.
        keys: headings that are given.
        track: where the body is, T frames.
    Returns:
        The heading (T,) rad from +x, unwrapped, and how far it is given (T,) from 0 to 1, None without keys.
    """
    heading = path.sample(track.times)
    if not keys:
        return heading, None
    given, times = _Given(keys), track.times
    key = given.find_keys(times)
    after = np.minimum(key + (times >= given.starts[0]), len(given.starts) - 1)  # the next key, at the ends the nearest
    since = np.where(times < given.starts[0], np.inf, np.maximum(times - given.ends[key], 0.0))
    until = np.where(times >= given.starts[-1], np.inf, given.starts[after] - times)
    reach = np.clip(given.gaps, 1e-6, HOLD_FADE)
    misses = [_shrink_far_misses(given.compute_heading(rows, track.positions) - heading) for rows in (key, after)]
    heading = heading + misses[0] * _fade(since / reach[key + 1]) + misses[1] * _fade(until / reach[after])
    return heading, _fade(np.minimum(since, until) / HOLD_FADE)


def _shrink_far_misses(angle: np.ndarray) -> np.ndarray:
    """Shrink angles (T,) rad, wrapped, towards 0 the farther they are."""
    angle = quaternion.wrap_angle(angle)
    return angle * (1.0 - smoothstep(np.abs(angle), *_FAR_MISS))


def _fade(share: np.ndarray) -> np.ndarray:
    """Fade from 1 where a share (T,) is 0 to 0 where it is 1."""
    return 1.0 - smoothstep(share)


def _compute_asked_heading(bearings: _Bearings, spans: Sequence[Span]) -> np.ndarray:
    """Compute the heading (D,) rad that labels such as "walking back" mean, NaN without one.

    A label's direction is that of the motion seen from the body, so the heading lies at the opposite angle from travel.
    """
    out = np.full(len(bearings.times), np.nan)
    for span in spans:
        quarter = _find_quarter(span)
        if quarter is not None:
            inside = _find_inside(bearings, span) & (bearings.speed > _DIRECTION_SPEED)
            out = np.where(inside, bearings.travel - 0.5 * np.pi * quarter, out)
    return out


def _find_quarter(span: Span) -> int | None:
    """Find the quarter turn from heading to travel that a gait's labels ask for; None without one."""
    found = [number for number, word in enumerate(DIRECTIONS) if word in span.words]
    is_gait = set(span.words) <= {*LOCOMOTION, *DIRECTIONS} - {STANDING}
    return found[0] if len(found) == 1 and is_gait else None


def _find_turning_side(span: Span) -> int | None:
    """Find the side to which labels ask to turn, 1 left and -1 right; None without one."""
    found = [sign for side, sign in zip(SIDES, (1, -1)) if side in span.words]
    return found[0] if _TURNING in span.words and len(found) == 1 else None


def _find_inside(bearings: _Bearings, span: Span) -> np.ndarray:
    """Find the decisions (D,) bool within a span."""
    return (bearings.times >= span.start) & (bearings.times <= span.end)


def _compute_step_costs(bearings: _Bearings) -> np.ndarray:
    """Compute the cost (D, 2 N + 1) of coming to a decision by -N .. N bins; inf where legs cannot turn so fast."""
    duration, angle = np.roll(bearings.seconds, 1)[:, None], BIN_ANGLE * np.abs(_STEPS)
    rate = angle / np.maximum(duration, 1e-9) / np.pi
    cost = (TURN_COST + TURN_RATE_COST * rate**2) * duration * (_STEPS != 0) + TURN_ANGLE_COST * angle
    limit = np.where(bearings.speed > _RUNNING_SPEED, _RUNNING_TURN, _STANDING_TURN)[:, None]
    return np.where(np.abs(_STEPS) <= limit, cost, np.inf)


def _limit_turns(bearings: _Bearings, request: HeadingRequest, step_costs: np.ndarray,
                 asked_costs: np.ndarray) -> np.ndarray:
    """Limit the turns (D, 2 N + 1) to what is asked to a calm speed, and to the side that a label asks for.

    That is where what is asked costs (D, BINS), on the way there and from there; other turns are as fast as without it.
    """
    is_asked = asked_costs.any(axis=1)
    for span in request.spans:
        is_asked |= _find_inside(bearings, span) & (_find_turning_side(span) is not None)
    moments = np.concatenate([[-np.inf], bearings.times[is_asked], [np.inf]])
    number = np.searchsorted(moments, bearings.times)
    away = np.minimum(moments[number] - bearings.times, bearings.times - moments[number - 1])
    is_fast = (np.abs(_STEPS) > _CALM_TURN) & (away <= _APPROACH)[:, None]
    step_costs = np.where(is_fast, np.inf, step_costs)
    for span in request.spans:
        against = np.maximum(-(_find_turning_side(span) or 0) * _STEPS, 0)
        step_costs = step_costs + _find_inside(bearings, span)[:, None] * OTHER_WAY_COST * BIN_ANGLE * against
    return step_costs
