"""Body-size scaling: players who are not as tall as the library's skeleton.

Everything is searched and constructed in the library's size, and scaled afterwards. Track and ball are divided by the
size in the plan (`resolve_plan`), skeleton and root are multiplied by it in the end; angles, contacts and times stay as
they are. The ball keeps its own size; `Construction.solve_ball_contact` solves in the player's size.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..motion.motion import Motion
from ..motion.track import BALL_RADIUS
from ..motion.track.ball_path import BallPath
from .plan import Plan
from .take import Take

_ROUNDING = 1e-9  # m, rounding in the height of a ball on the ground


def to_library_size(take: Take, size: float) -> Take:
    """Convert a take back to the library's size, without its pins and with the ball as it was met."""
    motion, contacts = take.unpinned or (take.motion, take.contacts)
    ball = take.contact_ball or take.ball
    take = replace(
        take, motion=motion, contacts=contacts, ball=ball, pins=(), unpinned=None, contact_ball=None, dribble_touches=()
    )
    if size == 1.0:
        return take
    return _scale_take(take, 1.0 / size, take.plan, lambda ball: ball / size)


def to_player_size(take: Take, size: float, plan: Plan, before: Take | None = None) -> Take:
    """Scale a take from the library's size to the player's.

    Args:
        take: the take, in the library's size.
        size: times as tall as the library's skeleton.
        plan: the plan as requested.
        before: an earlier take of the same size; frames that did not change come back bit for bit.
    """
    if size == 1.0:
        return replace(take, plan=plan)
    grown = _scale_take(take, size, plan, lambda ball: scale_ball(ball, size))
    if before is None or len(before.motion) != len(take.motion):
        return grown
    old, _ = before.unpinned or (before.motion, before.contacts)
    same = np.all(take.motion.root_positions == old.root_positions * (1.0 / size), axis=1)[:, None]
    motion = replace(
        grown.motion, skeleton=old.skeleton,
        root_positions=np.where(same, old.root_positions, grown.motion.root_positions),
    )
    return replace(grown, motion=motion)


def scale_ball(ball: np.ndarray, size: float) -> np.ndarray:
    """Scale ball positions (..., 3) m from the library's size; a ball on the ground rests on its own radius."""
    out = ball * size
    out[..., 2] = np.where(ball[..., 2] <= BALL_RADIUS + _ROUNDING, BALL_RADIUS, np.maximum(out[..., 2], BALL_RADIUS))
    return out


def _scale_take(take: Take, size: float, plan: Plan, ball_scaled) -> Take:
    """Scale motion, ball and measures in metres."""
    motion, ball = take.motion, take.ball
    motion = Motion(motion.skeleton.scale(size), motion.root_positions * size, motion.rotations, motion.fps)
    ball = None if ball is None else BallPath(ball.times, ball_scaled(ball.positions), ball.measured)
    moved = [None if values is None else values * size for values in (take.correction, take.ik_miss)]
    return replace(take, motion=motion, ball=ball, correction=moved[0], ik_miss=moved[1], plan=plan)
