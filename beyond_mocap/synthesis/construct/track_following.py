"""Place a motion on a track: its heading, root and lean, at every frame.

The body's own sway about its path is kept: the root is the track plus the sway, turned with the body. Heading is not
the direction of travel; the angle between the two that the recording had is kept. At a touch the body turns so that
the striking part points at the ball, it leans into curves as far as the recording does not, and it yields a little
where its feet would slide.
"""

from __future__ import annotations

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.easing import smoothstep
from ...base.time_series import find_runs, measure_time_to_nearest
from ...base.vectors import arctan2, measure_lengths
from ...motion import quaternion
from ...motion.foot_plant import compute_contact_weights
from ...motion.humanoid import identify_joints, pose_legs
from ...motion.motion import compute_world_rotation
from ...motion.skeleton import Skeleton
from ...motion.supports import GRAVITY
from ...motion.track import smooth_zero_phase_hann

TURN_WEIGHT = 12.0  # weight of the recording's own turning per frame, against the direction of travel
AIRBORNE_FIRMNESS = 40.0  # factor on it where the body flies, lies or kneels and so cannot turn at will
_FLIGHT_SECONDS = 0.3  # s without a foot on the ground that count as flight; the flights of running are shorter
CUT_FIRMNESS, CUT_REACH = 15.0, (0.15, 0.65)
"""Factor on it near a cut, and seconds from the cut up to which it holds, and from which on it is 1: the angle between
travel and heading jumps there from one recording to the next, and a body that followed the jump would swivel."""

_LOW = 0.6  # share of the usual height of the hips below which a body lies or kneels
IN_PLACE_SPEED = 0.3  # m/s below which a direction of travel says nothing about the heading

MAX_OFF_PLAN = np.radians(25.0)  # of the heading, from the plan: with more a body that turns its back passes as planned
PLAN_SPEEDS, PLAN_WEIGHTS = (0.1, 0.5, 1.1), (1e-5, 0.02, 0.05)
"""Weights of the plan by the track's speed, m/s: a body at rest turns as its recording does, within MAX_OFF_PLAN."""

BEYOND_WEIGHT = 5.0  # of the plan where the heading is farther off: against the firmness of two planted feet
MAX_OFF_HELD, HELD_WEIGHT = np.radians(5.0), 0.5
"""The same where the heading is given, and the weight added to that of the plan there."""

_HELD_ROUNDS = 3  # of holding what is beyond MAX_OFF_PLAN
FAINT_WEIGHT = 1e-4  # weight of that pull at any speed, so that there is one solution
GIVEN_HEADING_WEIGHT = 1e6  # weight of a given heading, so large that it stays
ROOT_WINDOW = 1.5  # s, the window through which the root lies on the track

LEGS_LEAN, TRUNK_LEAN = 0.5, 0.2
"""Share of a / g by which legs and trunk lean; recorded legs lean by 0.7 to 0.8 of it and the trunk by a quarter."""

MAX_LEAN = 0.2  # rad, largest lean that is added to the legs
UPRIGHT_SPEED = (1.5, 3.0)  # m/s: no lean below the first, all of it from the second on
_LEAN_SECONDS = 0.6  # s, window that smooths the lean

_FOOT_WEIGHT = 0.1  # weight of a planted foot's movement; with more, the pelvis surges and stops with every step
_STIFF, _STAY = (2.0, 0.2), (0.02, 5e-4)
"""Weights of the third difference and of the value, for metres of the root and for radians of heading."""

# columns of the unknowns of one frame
_ROOT_X, _ROOT_Y, _TURN, _UNKNOWNS = 0, 1, 2, 3


def fit_heading(
    direction: np.ndarray, speed: np.ndarray, velocity: np.ndarray, turn: np.ndarray, given: np.ndarray | None = None,
    firm: np.ndarray | float = 1.0, plan: np.ndarray | None = None, freedom: np.ndarray | float = 0.0,
    held: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Solve the heading: the least squares compromise between travel and the recording's own turning.

    At speed the body keeps the recording's angle to the direction of travel; where either is in place there is no such
    angle and the recording's turning decides, near the plan where there is one. Every term is quadratic, so the whole
    is one tridiagonal system.

    Args:
        direction: (T,) rad, of travel on the track.
        speed: (T,) m/s on the track.
        velocity: (T, 2) m/s of the recording in its facing frame.
        turn: (T,) rad that the recording turned since the frame before.
        given: (T,) rad that the heading has to be, NaN where it is free.
        firm: (T,) how many times firmer than usual the recording's turning is followed (`compute_turning_firmness`).
        plan: (T,) rad, unwrapped, near which the heading stays; None without a plan.
        freedom: (T,) from 0 to 1, how little the plan counts, as at the ball.
        held: (T,) from 0 to 1, how far the plan is given.
    Returns:
        (T,) rad, unwrapped.
    """
    # the heading that keeps the recorded angle between travel and facing
    goal = direction - arctan2(velocity[:, 1], velocity[:, 0])
    trust = _motion_weight(speed) ** 2 * _motion_weight(measure_lengths(velocity)) ** 2
    if plan is not None:
        return follow_plan(plan, goal, trust, speed=speed, turn=turn, given=given, firm=firm, freedom=freedom,
                           held=held)
    trust = trust + FAINT_WEIGHT
    if given is not None:
        goal, trust = np.where(np.isnan(given), goal, given), np.where(np.isnan(given), trust, GIVEN_HEADING_WEIGHT)
    return follow_turning(_unwrap_to_turn(goal, turn), trust, turn, firm)


def follow_plan(
    plan: np.ndarray, goal: np.ndarray, trust: np.ndarray, *, speed: np.ndarray, turn: np.ndarray,
    given: np.ndarray | None = None, firm: np.ndarray | float = 1.0, freedom: np.ndarray | float = 0.0,
    held: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Solve the heading near a plan: a body at rest turns as its recording does, within the plan's own dead zone.

    Args:
        plan: (T,) rad, the planned heading, unwrapped.
        goal: (T,) rad, the heading that keeps the recorded angle between travel and facing.
        trust: (T,) weight of that goal.
        speed: (T,) m/s on the track.
        turn: (T,) rad that the recording turned since the frame before.
        given: (T,) rad that the heading has to be, NaN where it is free; None for free everywhere.
        firm: (T,) how many times firmer than usual the recording's turning is followed.
        freedom: (T,) from 0 to 1, how far the recording alone decides.
        held: (T,) from 0 to 1, how far the plan is given: there the body faces as planned.
    Returns:
        (T,) rad.
    """
    most = MAX_OFF_PLAN + freedom * (np.pi - MAX_OFF_PLAN) - held * (MAX_OFF_PLAN - MAX_OFF_HELD)
    off = np.clip(quaternion.wrap_angle(goal - plan), -most, most)
    pull = np.interp(speed, PLAN_SPEEDS, PLAN_WEIGHTS)
    pull = pull + freedom * (FAINT_WEIGHT - pull) + held * HELD_WEIGHT
    goal, trust = plan + off * trust / (trust + pull), trust + pull
    if given is not None:
        turns = 2.0 * np.pi * np.round((np.nan_to_num(given) - plan) / (2.0 * np.pi))
        goal = np.where(np.isnan(given), goal, given - turns)
        trust = np.where(np.isnan(given), trust, GIVEN_HEADING_WEIGHT)
    heading = follow_turning(goal, trust, turn, firm)
    for _ in range(_HELD_ROUNDS):
        away = heading - plan
        beyond = (np.abs(away) > most) & (trust < GIVEN_HEADING_WEIGHT)
        goal = np.where(beyond, plan + np.sign(away) * most, goal)
        trust = np.where(beyond, np.maximum(trust, BEYOND_WEIGHT), trust)
        heading = follow_turning(goal, trust, turn, firm)
    return heading


def follow_turning(
    goal: np.ndarray, trust: np.ndarray, turn: np.ndarray, firm: np.ndarray | float = 1.0
) -> np.ndarray:
    """The angles for which sum trust (a - goal)^2 + TURN_WEIGHT firm (a' - turn)^2 is least.

    Args:
        goal: (T,) rad, without jumps of whole turns.
        trust: (T,), weight of the goal.
        turn: (T,) rad, wanted since the frame before.
        firm: (T,) or one number, how many times firmer than usual the turning is followed.
    Returns:
        (T,) rad.
    """
    if len(goal) < 2:
        return goal
    squares = BandedLeastSquares(len(goal), reach=1)
    squares.add_value(trust, goal=goal)
    squares.add_terms({1: 1.0, 0: -1.0}, TURN_WEIGHT * np.broadcast_to(firm, len(goal))[1:], turn[1:])
    return squares.solve()[:, 0]


def compute_turning_firmness(heel_toe_contacts: np.ndarray, height: np.ndarray, transitions: np.ndarray,
                             fps: float) -> np.ndarray:
    """Compute how firmly the recording's turning is followed: AIRBORNE_FIRMNESS in flight or with low hips, else 1.

    Near a cut it is CUT_FIRMNESS times that.

    Args:
        heel_toe_contacts: (T, 2, 2) bool, heel and toe contacts.
        height: (T,) m of the root.
        transitions: (C,) frames at which the clip changes, ascending.
        fps: frames per second.
    Returns:
        (T,) factor.
    """
    off = ~heel_toe_contacts.any(axis=(1, 2))
    out = np.where(height < _LOW * np.median(height), AIRBORNE_FIRMNESS, 1.0)
    for first, last in find_runs(off):
        if last - first >= _FLIGHT_SECONDS * fps:
            out[first:last] = AIRBORNE_FIRMNESS
    away = measure_time_to_nearest(np.arange(len(out)), transitions) / fps
    return out * (1.0 + (CUT_FIRMNESS - 1.0) * (1.0 - smoothstep(away, *CUT_REACH)))


def _motion_weight(speed: np.ndarray) -> np.ndarray:
    """Compute how much a velocity says about where a body moves: (T,) 0 in place, 1 from 1 m/s on."""
    return np.clip((speed - IN_PLACE_SPEED) / (1.0 - IN_PLACE_SPEED), 0.0, 1.0)


def _unwrap_to_turn(goal: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Unwrap angles: remove full turns against what the recording's own turning lets one expect."""
    expected = np.cumsum(turn)
    return np.unwrap(goal - expected) + expected


def add_sway(place: np.ndarray, sway: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Add the sway to a path.

    Args:
        place: (T, 2) m, path on the ground, world.
        sway: (T, 2) m in the facing frame.
        angle: (T,) rad, heading.
    Returns:
        (T, 2) m, root on the ground, world.
    """
    return place + quaternion.rotate_level(sway, angle)


def pull_to_track(
    root: np.ndarray, track: np.ndarray, fps: float, window: float = ROOT_WINDOW, rounds: int = 4
) -> np.ndarray:
    """Remove the slow drift of a root from its track.

    The difference of the two, both seen through a Hann window (docs/explanation/quality.md), is removed `rounds`
    times; once would leave a third of it, since the window has no sharp edge.

    Args:
        root: (T, 2) m, world.
        track: (T, 2) m, world.
        fps: frames per second.
        window: s.
        rounds: how many times.
    Returns:
        (T, 2) m, world.
    """
    smooth = smooth_zero_phase_hann(track, fps, window)
    for _ in range(rounds):
        root = root - (smooth_zero_phase_hann(root, fps, window) - smooth)
    return root


def compute_missing_lean(
    speed: np.ndarray, direction: np.ndarray, velocity: np.ndarray, turn: np.ndarray, transitions: np.ndarray,
    fps: float, upright_speed: tuple[float, float] = UPRIGHT_SPEED,
) -> np.ndarray:
    """Compute the lean that the track needs beyond what the recording has, limited softly.

    Args:
        speed: (T,) m/s on the track.
        direction: (T,) rad, of travel on the track.
        velocity: (T, 2) m/s of the recording in its facing frame.
        turn: (T,) rad that the recording turned since the frame before.
        transitions: (S,) frames of transitions, across which a recording's direction says nothing.
        fps: frames per second.
        upright_speed: m/s, as UPRIGHT_SPEED.
    Returns:
        (T,) lateral acceleration over g, to the left; legs get at most MAX_LEAN, nothing below UPRIGHT_SPEED.
    """
    own_speed = measure_lengths(velocity)
    # turning of the recording's direction of travel, per frame: of the facing plus of the angle between the two
    own_turn = turn + np.diff(arctan2(velocity[:, 1], velocity[:, 0]), prepend=arctan2(*velocity[:1, ::-1].T))
    own_turn[transitions] = own_turn[np.minimum(transitions + 1, len(turn) - 1)]
    track_turn = speed * quaternion.wrap_angle(np.diff(direction, prepend=direction[:1]))
    fast = np.clip((np.minimum(speed, own_speed) - upright_speed[0]) / (upright_speed[1] - upright_speed[0]), 0.0, 1.0)
    # speed times turning per frame is lateral acceleration; what the recording has is taken off
    turns = track_turn - own_speed * quaternion.wrap_angle(own_turn)
    lean = smooth_zero_phase_hann((fast * np.clip(turns * fps / GRAVITY, -1.0, 1.0))[:, None], fps, _LEAN_SECONDS)[:, 0]
    most = MAX_LEAN / LEGS_LEAN
    return most * np.tanh(lean / most)


def bend_forward(skeleton: Skeleton, rotations: np.ndarray, direction: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Bend the trunk forward in the direction of travel.

    Args:
        skeleton: the skeleton.
        rotations: (T, J, 4) local.
        direction: (T,) rad, of travel.
        angle: (T,) rad.
    Returns:
        (T, J, 4) local.
    """
    out, left = rotations.copy(), np.column_stack([-np.sin(direction), np.cos(direction), np.zeros(len(direction))])
    _turn_trunk(skeleton, rotations, left, angle, out)
    return out


def lean_into_curves(skeleton: Skeleton, rotations: np.ndarray, direction: np.ndarray, lean: np.ndarray) -> np.ndarray:
    """Lean a body to the left of its direction of travel.

    The body turns about its root, legs included, and the trunk turns back by a part of that above the hips.

    Args:
        skeleton: the skeleton.
        rotations: (T, J, 4) local.
        direction: (T,) rad, of travel.
        lean: (T,) lateral acceleration over g.
    Returns:
        (T, J, 4) local.
    """
    out, axis = rotations.copy(), np.column_stack([np.cos(direction), np.sin(direction), np.zeros(len(direction))])
    out[:, 0] = quaternion.multiply(quaternion.from_axis_angle(axis, -LEGS_LEAN * lean), rotations[:, 0])
    _turn_trunk(skeleton, rotations, axis, (LEGS_LEAN - TRUNK_LEAN) * lean, out)
    return out


def _turn_trunk(skeleton: Skeleton, rotations: np.ndarray, axis: np.ndarray, angle: np.ndarray, out: np.ndarray):
    """Turn the first joint of the spine about world axes (T, 3) by angle (T,), written into `out`."""
    spine = identify_joints(skeleton).spine
    if spine:
        above = compute_world_rotation(skeleton, rotations, skeleton.parents[spine[0]])
        turn = quaternion.from_axis_angle(quaternion.rotate(quaternion.inverse(above), axis), angle)
        out[:, spine[0]] = quaternion.multiply(turn, rotations[:, spine[0]])



def absorb_foot_slide(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, heel_toe_contacts: np.ndarray, fps: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Move the root and turn the body a little so that planted feet slide less.

    With f a point in contact, a its arm from the root and J a quarter turn, it minimizes
    sum _FOOT_WEIGHT w |r' + t' J a + f'|^2 + _STIFF |r''', t'''|^2 + _STAY |r, t|^2, with differences per frame at 30
    frames per second: one banded system. The legs make up for the rest (`foot_plant`); `pull_to_track` removes what
    drifts away from the track.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local, the constructed motion.
        heel_toe_contacts: (T, 2, 2) bool, heel and toe contacts.
        fps: frames per second.
    Returns:
        (T, 2) m by which the root moves, and (T,) rad by which the body turns about it.
    """
    body = identify_joints(skeleton)
    places, _ = pose_legs(skeleton, root, rotations)
    count, scale = len(root), 30.0 / fps
    squares = BandedLeastSquares(count, _UNKNOWNS)
    for side, limb in enumerate((body.left, body.right)):
        firm = compute_contact_weights(heel_toe_contacts[:, side])
        for point, joint in enumerate((limb.foot, limb.toe_or_foot)):
            place = places[:, joint, :2]
            arm, moves = (place - root[:, :2])[:-1], np.diff(place, axis=0)
            weight = _FOOT_WEIGHT * np.minimum(firm[1:, point], firm[:-1, point])
            ones = np.ones(len(weight))
            for axis, swing in ((_ROOT_X, -arm[:, 1]), (_ROOT_Y, arm[:, 0])):
                # unknown r (axis) and t (_TURN) of frame k with -1, of frame k + 1 (offset _UNKNOWNS) with +1
                stencil = {axis: -ones, _TURN: -swing, axis + _UNKNOWNS: ones, _TURN + _UNKNOWNS: swing}
                squares.add_terms(stencil, weight, -moves[:, axis])
    for axis, kind in ((_ROOT_X, 0), (_ROOT_Y, 0), (_TURN, 1)):
        squares.add_difference(3, _STIFF[kind] / scale**4, axis)
        squares.add_value(_STAY[kind] * scale**2, axis)
    found = squares.solve()
    return found[:, :2], found[:, _TURN]
