"""Turn the body at a touch: the striking part points at the ball, and a kick goes where the ball goes.

The place of the ball comes first. Within what the ball's noise and the limb make up for, a kick turns as far as it can
towards the direction in which its ball leaves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...annotation.ball_contact import SENDING, build_surfaces, find_contact_window
from ...annotation.striking import Surface, trace_fastest_surface
from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.motion import compute_pose
from ...motion.skeleton import Skeleton
from ..requested_actions import LEAVING_SECONDS
from ..search.key_fit import FAST_BALL, FAST_PART, TURN_REACH, compute_free_angle, compute_free_turn
from .ball_touch.touch_frames import Touch
from .step_to_ball import measure_level_speed

MAX_TURN_TO_BALL = np.radians(60.0)
_FULL_TURN_SPEED = 3.0  # m/s up to which a body turns by MAX_TURN_TO_BALL: a faster one would drag its plant foot
_BALL_TURN_SECONDS = 0.5  # s before and after the key frame over which the turn grows and fades
_NEAR, _CLEAR = 0.1, 0.35  # m from the hips: below the first a direction has no weight, above the second all
_TURNING = frozenset({"foot", "hand"})


def compute_turn_to_ball(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, ball: np.ndarray, touches: Sequence[Touch], fps: float
) -> np.ndarray:
    """Compute the turn of the body about its root that points the striking part at the ball, and a kick to its exit.

    Feet and hands turn the body; in a dive the flight has its direction. Of two feet that may strike, the place of the
    faster one counts, of two hands the middle between both.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local, the constructed motion.
        ball: (T, 3) m, world, NaN where it is unknown.
        touches: where the body may meet the ball.
        fps: frames per second.
    Returns:
        (T,) rad, at most MAX_TURN_TO_BALL at any touch.
    """
    turn, at = np.zeros(len(root)), np.arange(len(root))
    for touch in touches:
        offset = _turn_at_touch(skeleton, root, rotations, ball=ball, touch=touch, fps=fps)
        bump = np.clip(1.0 - np.abs(at - touch.frame) / (_BALL_TURN_SECONDS * fps), 0.0, 1.0)
        # quintic ease; where two touches overlap the larger turn wins
        grown = offset * bump**3 * (10.0 - 15.0 * bump + 6.0 * bump**2)
        turn = np.where(np.abs(grown) > np.abs(turn), grown, turn)
    return turn


def _turn_at_touch(skeleton: Skeleton, root, rotations, *, ball, touch: Touch, fps: float) -> float:
    """Compute the turn, rad, at one touch; 0 without a part that turns the body, or a known ball."""
    frame = int(np.clip(round(touch.frame), 1, len(root) - 2)) if len(root) > 2 else 0
    found = [] if find_contact_window(touch.words) else [surface for surface in build_surfaces(skeleton, touch.words)
                                                         if surface.part in _TURNING]
    if len(root) < 3 or not found or not np.isfinite(ball[frame]).all():
        return 0.0
    places, world = compute_pose(skeleton, root[frame - 1 : frame + 2], rotations[frame - 1 : frame + 2])
    trace = _trace_part(found, places, world)[:, :2]
    part, goal = trace[1] - root[frame, :2], ball[frame, :2] - root[frame, :2]
    clear = np.clip((min(np.linalg.norm(part), np.linalg.norm(goal)) - _NEAR) / (_CLEAR - _NEAR), 0.0, 1.0)
    exit_turn, speed = 0.0, measure_level_speed(root, frame, fps)
    if SENDING.intersection(touch.words):
        exit_turn = _turn_to_exit(0.5 * fps * (trace[2] - trace[0]), _measure_exit_velocity(ball, frame, fps))
        exit_turn = np.clip(exit_turn, -compute_free_turn(speed), compute_free_turn(speed))
    turn = exit_turn + clear * (_limit_to_reach(exit_turn, part, goal) - exit_turn)
    most = MAX_TURN_TO_BALL * min(1.0, _FULL_TURN_SPEED / max(speed, _FULL_TURN_SPEED))
    return float(np.clip(turn, -most, most))


def _trace_part(surfaces: Sequence[Surface], places: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Trace (T, 3) m the place that points at the ball: between both hands, or the middle of the faster foot."""
    if surfaces[0].part != "hand":
        return trace_fastest_surface(surfaces, places, world)
    return np.mean([line for surface in surfaces for line in surface.compute_line(places, world)], axis=0)


def _measure_exit_velocity(ball: np.ndarray, frame: int, fps: float) -> np.ndarray:
    """Measure the level velocity (2,) m/s with which the ball leaves; 0 where it is unknown."""
    first, last = (min(frame + int(round(second * fps)), len(ball) - 1) for second in LEAVING_SECONDS)
    return np.nan_to_num(ball[last, :2] - ball[first, :2]) * fps / max(last - first, 1)


def _turn_to_exit(swing: np.ndarray, leaving: np.ndarray) -> float:
    """Compute the turn, rad, from a foot's velocity (2,) m/s to the ball's; 0 where either is slow."""
    if np.linalg.norm(swing) < FAST_PART or np.linalg.norm(leaving) < FAST_BALL:
        return 0.0
    return float(quaternion.wrap_angle(arctan2(leaving[1], leaving[0]) - arctan2(swing[1], swing[0])))


def _limit_to_reach(turn: float, part: np.ndarray, goal: np.ndarray) -> float:
    """Compute the turn nearest to `turn` that brings a part (2,) within TURN_REACH of its goal (2,) m."""
    apart = np.arctan2(part[0] * goal[1] - part[1] * goal[0], part @ goal)
    free = compute_free_angle(np.linalg.norm(part), np.linalg.norm(goal), TURN_REACH)
    return float(np.clip(turn, apart - free, apart + free))
