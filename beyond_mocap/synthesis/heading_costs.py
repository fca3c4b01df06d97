"""What every heading of a player costs at every decision: how far it is from ball and travel, and what is asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation import LOCOMOTION, Span
from ..annotation.gaits import STANDING
from ..annotation.vocabulary import DIRECTIONS, SIDES
from ..base.easing import smoothstep
from ..base.time_series import find_runs, interpolate_columns, measure_time_to_nearest, time_derivative
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.track import SampledTrack, smooth_zero_phase_hann
from .heading_path import BIN_ANGLE, BINS
from .heading_request import GivenHeadings, HeadingKey, HeadingRequest, Play

# Costs per second, of angles in radians. They were chosen on 167 minutes of a tracked match, for few turns and
# headings near ball and travel: no snap turns, 0.02 spins a minute, 13 degrees from the ball below 1 m/s (median).
DEAD_ZONE = np.radians(20.0)  # within which the body does not follow the ball
BALL_COST = 1.0  # per radian beyond it, half of that from 3 m/s on
PULL_COST = 0.02  # per radian to the ball, also within: where all cost alike, an edit far away would choose more often
TRAVEL_COST = 6.0  # per radian beyond TRAVEL_LIMITS
FORWARD_COST = 0.3  # per radian to travel and m/s above 0.6: forward is cheaper
ALONE_COST = 1.0  # the same up to 1.6 m/s with no ball to watch, or only one at the feet: people turn, not back away
SIDEWAYS_COST, SIDEWAYS_WIDTH = 2.5, np.radians(45.0)  # at a right angle to travel, and the width of that bell
TURN_COST, TURN_RATE_COST, TURN_ANGLE_COST = 0.12, 0.08, 0.7  # per second of turning, per (pi / s)^2, per radian
GIVEN_COST = 40.0  # per radian and second: given headings hold against all others
DIRECTION_COST = 12.0  # per radian beyond the dead zone from the heading that a label asks for: above TRAVEL_COST
OTHER_WAY_COST = 8.0  # per radian that is turned against a label: the long way round is cheaper
GAZE_COST, GAZE_REACH = 6.0, np.radians(45.0)  # per radian beyond what hips and shoulders turn towards a pinned gaze
KEEPER_BALL_COST, KEEPER_SIDEWAYS = 3.0, 0.5  # of a goalkeeper, at any speed up to 3 m/s; share of SIDEWAYS_COST

ASKED_SECONDS = 3.0
"""Seconds before and after what is asked in which it may change the plan; elsewhere it does not."""

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
_GAZE_SECONDS = 0.3  # s before and after a pin of the gaze in which it counts

_DECISION_SECONDS = 1.0 / 6.0
_VELOCITY_SECONDS = 1.0  # s, of the travel and the ball that are faced
_TURNING = "turning"


@dataclass(frozen=True, eq=False)
class WeighedHeadings:
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


def weigh_headings(track: SampledTrack, request: HeadingRequest) -> WeighedHeadings:
    """Weigh all headings at all decisions of a track.

    Args:
        track: the player's track with the ball, T frames; its positions are where the body will be.
        request: what is asked.
    """
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
    return WeighedHeadings(times=bearings.times, plain=plain, plain_steps=plain_steps, costs=costs, steps=steps,
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
        ball: (D,) rad, bearing of the ball or of the play; NaN where there is neither, or the ball is never far enough
            to have a bearing.
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
    alone = np.isnan(bearings.ball)[:, None]
    cost += alone * ALONE_COST * np.clip(v - 0.6, 0.0, 1.0) * from_travel
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
    given = GivenHeadings(keys)
    key = given.find_keys(bearings.times + 0.5 * _DECISION_SECONDS)
    heading = given.compute_heading(key, bearings.positions)
    is_held = bearings.times <= given.ends[key] + 0.5 * _DECISION_SECONDS
    is_held &= bearings.times >= given.starts[key] - 0.5 * _DECISION_SECONDS
    return GIVEN_COST * _measure_angles(np.where(is_held, heading, np.nan))


def _measure_angles(bearing: np.ndarray) -> np.ndarray:
    """Measure the angle (D, BINS) rad of every heading from a bearing (D,), 0 where that is NaN."""
    return np.nan_to_num(np.abs(quaternion.wrap_angle(BIN_ANGLE * np.arange(BINS) - bearing[:, None])))


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
    away = measure_time_to_nearest(bearings.times, bearings.times[is_asked])
    is_fast = (np.abs(_STEPS) > _CALM_TURN) & (away <= _APPROACH)[:, None]
    step_costs = np.where(is_fast, np.inf, step_costs)
    for span in request.spans:
        against = np.maximum(-(_find_turning_side(span) or 0) * _STEPS, 0)
        step_costs = step_costs + _find_inside(bearings, span)[:, None] * OTHER_WAY_COST * BIN_ANGLE * against
    return step_costs
