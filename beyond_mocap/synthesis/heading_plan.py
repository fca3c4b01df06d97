"""The planned heading of a player: where the body faces at every moment, decided before any clip is chosen.

Above 3 m/s the body faces its travel, between 1 and 3 m/s it faces between travel and ball and walks backward or
sideways where they differ, and below 1 m/s, where the direction of a creeping track is noise, it faces the ball. It
turns the short way at limited speed, rests within a dead zone, and does not go sideways for long. All of these weigh
against each other, and the ball comes back; so the plan is the cheapest path through all headings of all moments
(dynamic programming), not a filter, which cannot look ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from ..base.time_series import interpolate_columns
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.track import SampledTrack, smooth_zero_phase_hann
from ..motion.track.resting_place import LEAST_LEEWAY, relax_track

# Costs per second, of angles in radians. They were chosen on 167 minutes of a tracked match, for few turns and
# headings near ball and travel: no snap turns, 0.02 spins a minute, 13 degrees from the ball below 1 m/s (median).
DEAD_ZONE = np.radians(20.0)  # within which the body does not follow the ball
BALL_COST = 1.0  # per radian beyond it, half of that from 3 m/s on
TRAVEL_COST = 6.0  # per radian beyond TRAVEL_LIMITS
FORWARD_COST = 0.3  # per radian to travel and m/s above 0.6: forward is cheaper
SIDEWAYS_COST, SIDEWAYS_WIDTH = 2.5, np.radians(45.0)  # at a right angle to travel, and the width of that bell
TURN_COST, TURN_RATE_COST, TURN_ANGLE_COST = 0.12, 0.08, 0.7  # per second of turning, per (pi / s)^2, per radian
GIVEN_COST = 40.0  # per radian and second: given headings hold against all others

_TRAVEL_SPEEDS = np.array([1.6, 2.2, 3.0, 4.5])  # m/s, with the largest angle between heading and travel at each
_TRAVEL_LIMITS = np.radians([180.0, 60.0, 35.0, 25.0])
_STANDING_TURN, _RUNNING_TURN, _RUNNING_SPEED = 3, 4, 2.2  # bins per decision (180 and 240 degrees/s); m/s
_NEAR_BALL = 2.0  # m; a nearer ball has no bearing, the last one holds

_BINS = 36
_DECISION_SECONDS = 1.0 / 6.0
_SMOOTHING_SECONDS = 0.7  # s, of the headings between decisions
_VELOCITY_SECONDS = 1.0  # s, of the travel and the ball that are faced
_UNIT = 1e-6  # cost of one integer unit: whole numbers add up alike whatever comes before them, so edits stay local


@dataclass(frozen=True)
class HeadingKey:
    """A heading that is given for some time.

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
        if not np.isfinite(values).all() or self.hold < 0.0:
            raise InputError("heading key", f"{values}", "finite values, and a hold of at least 0 s")


def plan_track(track: SampledTrack, keys: Sequence[HeadingKey] = (), rests: bool = True) -> SampledTrack:
    """Plan where the body of a track rests and where it faces.

    Args:
        track: the player's track with the ball, T frames.
        keys: headings that are given.
        rests: whether the body may rest where the track hardly moves; False: it is on the track.
    Returns:
        The same with the places and headings of the body.
    """
    relaxed = relax_track(track) if rests else replace(track, leeway=np.full(len(track), LEAST_LEEWAY))
    return replace(relaxed, heading=plan_heading(relaxed, keys))


def plan_heading(track: SampledTrack, keys: Sequence[HeadingKey] = ()) -> np.ndarray:
    """Plan the heading of a player.

    Args:
        track: the player's track with the ball, T frames; its positions are where the body will be.
        keys: headings that are given.
    Returns:
        (T,) rad from +x, unwrapped.
    Source: Reconstructed from the rules of ../shared/metrics.md, *Heading plan*.
    """
    count = len(track)
    at = np.arange(0, count, max(int(round(_DECISION_SECONDS * track.fps)), 1))
    if at[-1] != count - 1:
        at = np.append(at, count - 1)
    bearings = _compute_bearings(track)
    costs = _compute_heading_costs(bearings, keys, track, at)
    speed = bearings.speed[at]
    found = _find_cheapest_path(costs, speed, np.diff(track.times[at], append=track.times[at[-1]] + _DECISION_SECONDS))
    heading = np.interp(np.arange(count), at, np.unwrap(2.0 * np.pi / _BINS * found))
    return smooth_zero_phase_hann(heading[:, None], track.fps, _SMOOTHING_SECONDS)[:, 0]


@dataclass(frozen=True, eq=False)
class _Bearings:
    """What a heading is weighed against at each of T frames.

    Attributes:
        speed: (T,) m/s.
        travel: (T,) rad, direction of travel.
        ball: (T,) rad, bearing of the ball, NaN where there is none.
    """

    speed: np.ndarray
    travel: np.ndarray
    ball: np.ndarray


def _compute_bearings(track: SampledTrack) -> _Bearings:
    """Compute smoothed speed, travel and bearing of the ball."""
    velocity = smooth_zero_phase_hann(track.velocity, track.fps, _VELOCITY_SECONDS)
    known = np.isfinite(track.ball[:, :2]).all(axis=1)
    bearing = np.full(len(track), np.nan)
    if known.any():
        ball = smooth_zero_phase_hann(interpolate_columns(track.times, track.times[known], track.ball[known, :2]),
                                      track.fps, _VELOCITY_SECONDS)
        offset = ball - track.positions
        far = np.flatnonzero(np.linalg.norm(offset, axis=1) >= _NEAR_BALL)
        if len(far):
            # the last far ball's bearing holds; before the first one, that one's
            last = far[np.maximum(np.searchsorted(far, np.arange(len(track)), side="right") - 1, 0)]
            bearing = arctan2(offset[last, 1], offset[last, 0])
    return _Bearings(np.linalg.norm(velocity, axis=1), arctan2(velocity[:, 1], velocity[:, 0]), bearing)


def _compute_heading_costs(bearings: _Bearings, keys: Sequence[HeadingKey], track: SampledTrack,
                           at: np.ndarray) -> np.ndarray:
    """Compute the cost per second (D, bins) of every heading at the decisions `at` (D,)."""
    angle = 2.0 * np.pi / _BINS * np.arange(_BINS)
    v = bearings.speed[at, None]
    from_ball = np.nan_to_num(np.abs(quaternion.wrap_angle(angle - bearings.ball[at, None])))
    from_travel = np.abs(quaternion.wrap_angle(angle - bearings.travel[at, None]))
    cost = BALL_COST * np.maximum(from_ball - DEAD_ZONE, 0.0) * (1.0 - 0.5 * np.clip((v - 1.0) / 2.0, 0.0, 1.0))
    cost += TRAVEL_COST * np.maximum(from_travel - np.interp(v, _TRAVEL_SPEEDS, _TRAVEL_LIMITS), 0.0)
    cost += FORWARD_COST * np.clip(v - 0.6, 0.0, 3.0) * from_travel
    bell = np.exp(-(((from_travel - np.pi / 2.0) / SIDEWAYS_WIDTH) ** 2))
    cost += SIDEWAYS_COST * bell * np.clip((v - 0.5) / 0.7, 0.0, 1.0)
    for key in keys:
        given = _compute_given_heading(key, track, at)
        cost += GIVEN_COST * np.nan_to_num(np.abs(quaternion.wrap_angle(angle - given[:, None])))
    return cost


def _compute_given_heading(key: HeadingKey, track: SampledTrack, at: np.ndarray) -> np.ndarray:
    """Compute the heading (D,) rad that a key gives at the decisions `at`, NaN where it does not hold."""
    times, reach = track.times[at], 0.5 * _DECISION_SECONDS
    holds = (times >= key.time - reach) & (times <= key.time + key.hold + reach)
    if key.target is None:
        heading = np.full(len(at), key.heading)
    else:
        offset = np.asarray(key.target) - track.positions[at]
        heading = arctan2(offset[:, 1], offset[:, 0])
    return np.where(holds, heading, np.nan)


def _find_cheapest_path(costs: np.ndarray, speed: np.ndarray, seconds: np.ndarray) -> np.ndarray:
    """Find the cheapest sequence of headings.

    Args:
        costs: (D, bins) per second.
        speed: (D,) m/s.
        seconds: (D,) from each decision to the next.
    Returns:
        (D,) bins.
    """
    units = np.rint(costs * seconds[:, None] / _UNIT).astype(np.int64)
    most = max(_STANDING_TURN, _RUNNING_TURN)
    steps = np.arange(-most, most + 1)
    bins = np.arange(_BINS)
    came_from = (bins[None, :] - steps[:, None]) % _BINS
    angle = 2.0 * np.pi / _BINS * np.abs(steps)
    total, back = units[0], np.zeros((len(units), _BINS), dtype=int)
    for k in range(1, len(units)):
        duration = seconds[k - 1]
        rate = angle / max(duration, 1e-9) / np.pi
        turning = (TURN_COST + TURN_RATE_COST * rate**2) * duration * (steps != 0) + TURN_ANGLE_COST * angle
        limit = _RUNNING_TURN if speed[k] > _RUNNING_SPEED else _STANDING_TURN
        turning = np.where(np.abs(steps) <= limit, turning, 1e6)
        reached = total[came_from] + np.rint(turning / _UNIT).astype(np.int64)[:, None]
        best = reached.argmin(axis=0)
        back[k] = came_from[best, bins]
        total = reached[best, bins] + units[k]
    path = np.empty(len(units), dtype=int)
    path[-1] = int(total.argmin())
    for k in range(len(units) - 1, 0, -1):
        path[k - 1] = back[k, path[k]]
    return path
