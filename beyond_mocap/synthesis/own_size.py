"""Players who are not as tall as the library's skeleton: all is chosen and laid out in its size, and then scaled.

Track and ball are divided by the size in the plan (`resolve_plan`), and skeleton and root are multiplied by it in the
end: angles, feet that stand and times stay as they are.
The ball keeps its own size; `lay_out.met` meets it in the player's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..motion.motion import Motion
from ..motion.track import BALL_RADIUS
from ..motion.track.ball_path import BallPath
from .plan import Plan
from .take import Take

_EVEN = 1e-9


def taken_in_library_size(take: Take, size: float) -> Take:
    """A take of `in_own_size`, without its pins and with the ball as it was met, in the library's size again."""
    motion, contacts = take.unpinned or (take.motion, take.contacts)
    ball = take.met_ball or take.ball
    take = replace(
        take, motion=motion, contacts=contacts, ball=ball, pins=(), unpinned=None, met_ball=None, dribbled=()
    )
    if size == 1.0:
        return take
    return _scaled(take, 1.0 / size, take.plan, lambda ball: ball / size)


def in_own_size(take: Take, size: float, plan: Plan, before: Take | None = None) -> Take:
    """A take out of the library's size in the player's. before: an earlier take of the same size; frames that are as in
    it come back bit for bit."""
    if size == 1.0:
        return replace(take, plan=plan)
    grown = _scaled(take, size, plan, lambda ball: real_ball(ball, size))
    if before is None or len(before.motion) != len(take.motion):
        return grown
    old, _ = before.unpinned or (before.motion, before.contacts)
    same = np.all(take.motion.root_positions == old.root_positions * (1.0 / size), axis=1)[:, None]
    motion = replace(
        grown.motion, skeleton=old.skeleton,
        root_positions=np.where(same, old.root_positions, grown.motion.root_positions),
    )
    return replace(grown, motion=motion)


def real_ball(ball: np.ndarray, size: float) -> np.ndarray:
    """The ball (..., 3) m out of the library's size: where it rests on the ground it does so with its own radius."""
    out = ball * size
    out[..., 2] = np.where(ball[..., 2] <= BALL_RADIUS + _EVEN, BALL_RADIUS, np.maximum(out[..., 2], BALL_RADIUS))
    return out


def _scaled(take: Take, size: float, plan: Plan, ball_scaled) -> Take:
    motion, ball = take.motion, take.ball
    motion = Motion(motion.skeleton.scaled(size), motion.root_positions * size, motion.rotations, motion.fps)
    ball = None if ball is None else BallPath(ball.times, ball_scaled(ball.positions), ball.measured)
    moved = [None if values is None else values * size for values in (take.correction, take.ik_miss)]
    return replace(take, motion=motion, ball=ball, correction=moved[0], ik_miss=moved[1], plan=plan)
