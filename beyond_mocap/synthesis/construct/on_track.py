"""A motion laid on a track: which way the body faces, where its root goes and how it leans, at every frame.

The body's own sway about its path is kept: the root is the track plus the sway, turned with the body. Facing is not the
direction of travel; what is kept is the angle between the two that the recording had. At a touch the body turns so that
what strikes points at the ball (players turn into their kicks), it leans into curves as far as the recording does not,
and it yields a little where its feet would slide.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...annotation.ball_contact import surfaces
from ...annotation.striking import faster_middle
from ...base.banded_least_squares import BandedLeastSquares
from ...base.time_series import runs
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.foot_plant import firmness
from ...motion.humanoid import identify
from ...motion.motion import pose_kinematics, world_rotation
from ...motion.skeleton import Skeleton
from ...motion.track import zero_phase_hann
from .strike import Touch

TURN_WEIGHT = 12.0  # of the recording's own turning per frame, against the direction of travel
OFF_THE_FEET = 40.0  # times firmer, where the body flies, lies or kneels and so cannot turn at will
_FLIGHT_SECONDS = 0.3  # without a foot on the ground; the flights of running are shorter
_LOW = 0.6  # of the usual height of the hips
STANDS = 0.3  # m/s; below it a direction of travel says nothing about facing

FAINT, AIM = 1e-4, 0.004
"""Weights of the pull to where a standing body would turn: at any speed, and at rest (half way within 1.3 s)."""

HOLD = 1e6  # weight of a facing that is given: so much more than all else that it stays
ROOT_WINDOW = 1.5  # s, the window within which the root keeps to the track

MOST_TURN_TO_BALL = np.radians(60.0)
_REACHED = 0.25  # m between ball and part that the ball's noise and the limb make up for (`strike`)
_BALL_TURN_SECONDS = 0.5  # before and after the key frame over which the turn grows and fades
_NEAR, _CLEAR = 0.1, 0.35  # m from the hips: below the first a direction says nothing, above the second all

GRAVITY = 9.81
LEGS_LEAN, TRUNK_LEAN = 0.5, 0.2
"""Share of a / g by which legs and trunk lean; recorded legs lean by 0.7 to 0.8 of it and the trunk by a quarter."""

MOST_LEAN = 0.2  # rad that are added at most
UPRIGHT_SPEED = (1.5, 3.0)  # m/s below which a body does not lean, and from which on all of it counts
_LEAN_SECONDS = 0.6

_FOOT_WEIGHT = 0.1  # weight of a standing foot's movement: with more, the pelvis surges and stops with every step
_STIFF, _STAY = (2.0, 0.2), (0.02, 5e-4)
"""Weights of the third difference and of the whole, for metres of the root and for radians of facing."""

_ROOT_X, _ROOT_Y, _TURN, _UNKNOWNS = 0, 1, 2, 3


def facing(
    direction: np.ndarray, speed: np.ndarray, velocity: np.ndarray, turn: np.ndarray, kept: np.ndarray | None = None,
    firm: np.ndarray | float = 1.0, aim: np.ndarray | None = None,
) -> np.ndarray:
    """(T,) facing in radians, unwrapped: the least squares compromise between travel and the recording's own turning.

    direction (T,) of travel on the track and speed (T,) m/s there; velocity (T, 2) m/s of the recording in its facing
    frame; turn (T,) radians the recording turned since the frame before. At speed the body keeps the recording's angle
    to the direction of travel; where either stands still there is no such angle and the recording's turning decides,
    with a little of `aim`. Every term is quadratic, so the whole is one tridiagonal system. kept: (T,) radians that the
    facing has to be, NaN where it is free: what lies around a stretch that is constructed again. firm (T,): how many
    times firmer than usual the recording's own turning is followed (`turning_firmness`). aim: (T,) radians that a body
    which stands slowly turns to."""
    goal = direction - arctan2(velocity[:, 1], velocity[:, 0])
    trust = _moving(speed) ** 2 * _moving(np.linalg.norm(velocity, axis=1)) ** 2
    goal, trust = _with_aim(goal, trust, speed, aim, turn)
    if kept is not None:
        goal, trust = np.where(np.isnan(kept), goal, kept), np.where(np.isnan(kept), trust, HOLD)
    return follow_turning(_unwrapped(goal, turn), trust, turn, firm)


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
    squares.add({1: 1.0, 0: -1.0}, TURN_WEIGHT * np.broadcast_to(firm, len(goal))[1:], turn[1:])
    return squares.solve()[:, 0]


def turning_firmness(standing: np.ndarray, height: np.ndarray, fps: float) -> np.ndarray:
    """(T,) `firm` of `facing`: OFF_THE_FEET where no foot stands for a while or the hips are low, else 1; standing
    (T, 2, 2) bool of heels and toes, height (T,) m of the root."""
    off = ~standing.any(axis=(1, 2))
    out = np.where(height < _LOW * np.median(height), OFF_THE_FEET, 1.0)
    for first, last in runs(off):
        if last - first >= _FLIGHT_SECONDS * fps:
            out[first:last] = OFF_THE_FEET
    return out


def _moving(speed: np.ndarray) -> np.ndarray:
    """(T,) 0 for bodies that stand, 1 from 1 m/s on: how much a velocity says about where its body goes."""
    return np.clip((speed - STANDS) / (1.0 - STANDS), 0.0, 1.0)


def _with_aim(goal: np.ndarray, trust: np.ndarray, speed: np.ndarray, aim: np.ndarray | None, turn: np.ndarray):
    """Goals (T,) and their weights with the pull towards `aim`, felt only where little else is known."""
    if aim is None:
        return goal, trust + FAINT
    pull = FAINT + AIM * np.clip(1.0 - speed, 0.0, 1.0) ** 2
    goal, aim = _unwrapped(goal, turn), _unwrapped(aim, turn)
    aim = aim + 2.0 * np.pi * np.round((goal - aim) / (2.0 * np.pi))
    return (trust * goal + pull * aim) / (trust + pull), trust + pull


def _unwrapped(goal: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Angles without jumps of a full turn relative to what the recording's own turning leads one to expect."""
    expected = np.cumsum(turn)
    return np.unwrap(goal - expected) + expected


def root_with_sway(place: np.ndarray, sway: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(T, 2) root on the ground: `place` (T, 2) plus sway (T, 2, in the facing frame) turned by facing `angle` (T,)."""
    return place + quaternion.turned_level(sway, angle)


def pulled_to_track(
    root: np.ndarray, track: np.ndarray, fps: float, window: float = ROOT_WINDOW, rounds: int = 4
) -> np.ndarray:
    """(T, 2) root without what drifts slowly from the track (T, 2): the difference of the two, both seen through a
    Hann window of `window` seconds (../shared/metrics.md, root error), is removed `rounds` times; once would leave a
    third of it, since the window is not sharp."""
    smooth = zero_phase_hann(track, fps, window)
    for _ in range(rounds):
        root = root - (zero_phase_hann(root, fps, window) - smooth)
    return root


def turn_to_ball(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, ball: np.ndarray, touches: Sequence[Touch], fps: float
) -> np.ndarray:
    """(T,) radians to turn the body by, about its root, at most MOST_TURN_TO_BALL at any touch.

    root (T, 3) m and rotations (T, J, 4) local: the motion laid out; ball (T, 3) m, NaN where there is none. Of two
    parts that may strike, the faster one's place counts."""
    turn, at = np.zeros(len(root)), np.arange(len(root))
    for touch in touches:
        offset = _turn_at_touch(skeleton, root, rotations, ball, touch)
        bump = np.clip(1.0 - np.abs(at - touch.frame) / (_BALL_TURN_SECONDS * fps), 0.0, 1.0)
        grown = offset * bump**3 * (10.0 - 15.0 * bump + 6.0 * bump**2)
        turn = np.where(np.abs(grown) > np.abs(turn), grown, turn)
    return turn


def _turn_at_touch(skeleton: Skeleton, root, rotations, ball, touch: Touch) -> float:
    frame = int(np.clip(round(touch.frame), 1, len(root) - 2)) if len(root) > 2 else 0
    found = [surface for surface in surfaces(skeleton, touch.words) if surface.part == "foot"]
    if len(root) < 3 or not found or not np.isfinite(ball[frame]).all():
        return 0.0
    places, world = pose_kinematics(skeleton, root[frame - 1 : frame + 2], rotations[frame - 1 : frame + 2])
    part, goal = faster_middle(found, places, world)[1, :2] - root[frame, :2], ball[frame, :2] - root[frame, :2]
    clear = np.clip((min(np.linalg.norm(part), np.linalg.norm(goal)) - _NEAR) / (_CLEAR - _NEAR), 0.0, 1.0)
    apart = np.arctan2(part[0] * goal[1] - part[1] * goal[0], part @ goal)
    return float(clear * np.clip(_least_turn(part, goal, apart), -MOST_TURN_TO_BALL, MOST_TURN_TO_BALL))


def _least_turn(part: np.ndarray, goal: np.ndarray, apart: float) -> float:
    """As much of the angle `apart` as brings a part (2,) within _REACHED of its goal (2,), all where none does."""
    p, g = float(np.linalg.norm(part)), float(np.linalg.norm(goal))
    free = np.arccos(np.clip((p * p + g * g - _REACHED**2) / max(2.0 * p * g, 1e-9), 0.0, 1.0))
    return float(np.sign(apart) * max(0.0, abs(apart) - free))


def missing_lean(
    speed: np.ndarray, direction: np.ndarray, velocity: np.ndarray, turn: np.ndarray, seams: np.ndarray, fps: float,
    slow: tuple[float, float] = UPRIGHT_SPEED,
) -> np.ndarray:
    """(T,) a / g, to the left, that the track asks for beyond what the recording had; softly limited so that legs get
    at most MOST_LEAN, and nothing below UPRIGHT_SPEED.

    speed (T,) m/s and direction (T,) in radians of travel on the track; velocity (T, 2) m/s of the recording in its
    facing frame and turn (T,) radians since the frame before; seams (S,): frames across which a recording's direction
    says nothing; slow: as UPRIGHT_SPEED."""
    own_speed = np.linalg.norm(velocity, axis=1)
    own_turn = turn + np.diff(arctan2(velocity[:, 1], velocity[:, 0]), prepend=arctan2(*velocity[:1, ::-1].T))
    own_turn[seams] = own_turn[np.minimum(seams + 1, len(turn) - 1)]
    asked = speed * quaternion.wrapped(np.diff(direction, prepend=direction[:1]))
    fast = np.clip((np.minimum(speed, own_speed) - slow[0]) / (slow[1] - slow[0]), 0.0, 1.0)
    turns = asked - own_speed * quaternion.wrapped(own_turn)
    lean = zero_phase_hann((fast * np.clip(turns * fps / GRAVITY, -1.0, 1.0))[:, None], fps, _LEAN_SECONDS)[:, 0]
    most = MOST_LEAN / LEGS_LEAN
    return most * np.tanh(lean / most)


def bend_forward(skeleton: Skeleton, rotations: np.ndarray, direction: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Local rotations (T, J, 4) of a body whose trunk leans forward, in its direction of travel (T,), by angle (T,)."""
    out, left = rotations.copy(), np.column_stack([-np.sin(direction), np.cos(direction), np.zeros(len(direction))])
    _turn_trunk(skeleton, rotations, left, angle, out)
    return out


def lean_into_curves(skeleton: Skeleton, rotations: np.ndarray, direction: np.ndarray, lean: np.ndarray) -> np.ndarray:
    """Local rotations (T, J, 4) of a body that leans to the left of its direction of travel (T,) by lean (T,) as a / g.

    The body turns about its root, legs and all, and the trunk turns back a part of the way above the hips."""
    out, axis = rotations.copy(), np.column_stack([np.cos(direction), np.sin(direction), np.zeros(len(direction))])
    out[:, 0] = quaternion.multiply(quaternion.about_axis(axis, -LEGS_LEAN * lean), rotations[:, 0])
    _turn_trunk(skeleton, rotations, axis, (LEGS_LEAN - TRUNK_LEAN) * lean, out)
    return out


def _turn_trunk(skeleton: Skeleton, rotations: np.ndarray, axis: np.ndarray, angle: np.ndarray, out: np.ndarray):
    """Into `out`: the first joint of the spine turned about axes (T, 3) in the world by angle (T,)."""
    spine = identify(skeleton).spine
    if spine:
        above = world_rotation(skeleton, rotations, skeleton.parents[spine[0]])
        turn = quaternion.about_axis(quaternion.rotate(quaternion.inverse(above), axis), angle)
        out[:, spine[0]] = quaternion.multiply(turn, rotations[:, spine[0]])



def absorb_foot_slide(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, standing: np.ndarray, fps: float
) -> tuple[np.ndarray, np.ndarray]:
    """Metres (T, 2) by which the root moves on the ground, and radians (T,) by which the body turns about it.

    root (T, 3) m and rotations (T, J, 4) local: the motion laid out; standing (T, 2, 2) bool: heels and toes. With f a
    point that stands, a its arm from the root and J a quarter turn, minimizes sum _FOOT_WEIGHT w |r' + t' J a + f'|^2
    + _STIFF |r''', t'''|^2 + _STAY |r, t|^2, differences per frame at 30 frames per second: one banded system. The legs
    make up for the rest (`foot_plant`); what drifts away from the track is taken back by `pulled_to_track`."""
    body = identify(skeleton)
    places, _ = pose_kinematics(skeleton, root, rotations)
    count, scale = len(root), 30.0 / fps
    squares = BandedLeastSquares(count, _UNKNOWNS)
    for side, limb in enumerate((body.left, body.right)):
        firm = firmness(standing[:, side])
        for point, joint in enumerate((limb.foot, limb.toe_or_foot)):
            place = places[:, joint, :2]
            arm, moves = (place - root[:, :2])[:-1], np.diff(place, axis=0)
            weight = _FOOT_WEIGHT * np.minimum(firm[1:, point], firm[:-1, point])
            one = np.ones(len(weight))
            for axis, swing in ((_ROOT_X, -arm[:, 1]), (_ROOT_Y, arm[:, 0])):
                stencil = {axis: -one, _TURN: -swing, axis + _UNKNOWNS: one, _TURN + _UNKNOWNS: swing}
                squares.add(stencil, weight, -moves[:, axis])
    for axis, kind in ((_ROOT_X, 0), (_ROOT_Y, 0), (_TURN, 1)):
        squares.add_difference(3, _STIFF[kind] / scale**4, axis)
        squares.add_value(_STAY[kind] * scale**2, axis)
    found = squares.solve()
    return found[:, :2], found[:, _TURN]
