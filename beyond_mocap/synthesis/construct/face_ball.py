"""The body turned so that what strikes points at the ball.

A clip strikes somewhere beside or before the body, the tracked ball lies elsewhere, and neither the root leaves its
track nor the ball its noise for that (../shared/metrics.md, contact gap). What is free is the body's heading: players
turn into their kicks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...annotation.ball_contact import surfaces
from ...annotation.striking import faster_middle
from ...motion.motion import pose_kinematics
from ...motion.skeleton import Skeleton
from .strike import Touch

MOST = np.radians(60.0)
ALMOST = 0.25
"""Metres between ball and part that the ball's noise and the limb make up for (`synthesis.construct.strike`)."""

SECONDS = 0.5
"""Before and after the key frame over which the turn grows and fades."""

_NEAR, _CLEAR = 0.1, 0.35  # m from the hips: below the first a direction says nothing, above the second all


def turned_to_ball(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, ball: np.ndarray, touches: Sequence[Touch], fps: float
) -> np.ndarray:
    """(T,) radians to turn the body by, about its root, at most MOST at any touch.

    root (T, 3) m and rotations (T, J, 4) local: the motion laid out; ball (T, 3) m, NaN where there is none. Of two
    parts that may strike, the faster one's place counts.
    """
    turn = np.zeros(len(root))
    at = np.arange(len(root))
    for touch in touches:
        offset = _offset(skeleton, root, rotations, ball, touch)
        bump = np.clip(1.0 - np.abs(at - touch.frame) / (SECONDS * fps), 0.0, 1.0)
        grown = offset * bump**3 * (10.0 - 15.0 * bump + 6.0 * bump**2)
        turn = np.where(np.abs(grown) > np.abs(turn), grown, turn)
    return turn


def _offset(skeleton: Skeleton, root, rotations, ball, touch: Touch) -> float:
    frame = int(np.clip(round(touch.frame), 1, len(root) - 2)) if len(root) > 2 else 0
    found = [surface for surface in surfaces(skeleton, touch.words) if surface.part == "foot"]
    if len(root) < 3 or not found or not np.isfinite(ball[frame]).all():
        return 0.0
    places, world = pose_kinematics(skeleton, root[frame - 1 : frame + 2], rotations[frame - 1 : frame + 2])
    middle = faster_middle(found, places, world)
    part, goal = middle[1, :2] - root[frame, :2], ball[frame, :2] - root[frame, :2]
    clear = np.clip((min(np.linalg.norm(part), np.linalg.norm(goal)) - _NEAR) / (_CLEAR - _NEAR), 0.0, 1.0)
    apart = np.arctan2(part[0] * goal[1] - part[1] * goal[0], part @ goal)
    return float(clear * np.clip(_least(part, goal, apart), -MOST, MOST))


def _least(part: np.ndarray, goal: np.ndarray, apart: float) -> float:
    """As much of the angle `apart` as brings a part (2,) within ALMOST of its goal (2,), all of it where none does."""
    p, g = float(np.linalg.norm(part)), float(np.linalg.norm(goal))
    free = np.arccos(np.clip((p * p + g * g - ALMOST**2) / max(2.0 * p * g, 1e-9), 0.0, 1.0))
    return float(np.sign(apart) * max(0.0, abs(apart) - free))
