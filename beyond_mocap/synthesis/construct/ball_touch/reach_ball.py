"""Reach for the ball: parts move to it within what a body can do, and the pelvis steps where they do not get there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....motion.humanoid import identify_joints
from ..calm_foot import calm_foot
from ..move_body_part import (
    MAX_SWING,
    Body,
    LimbReference,
    bend_spine,
    compute_swing_shift,
    hold_foot,
    limb_chain,
    limit_to_ground,
    move_limb,
    swing_thigh,
)
from ..step_to_ball import step_to_ball
from .part_reach import limit_shift, solve_part_swing
from .touch_problem import STOPPING, TouchProblem, is_in_contact

OUT_OF_REACH = 0.15
"""Metres of remaining gap above which the body does not reach at all, and plays as recorded."""

_MISSED = 0.002  # m of remaining gap from which on the pelvis steps towards the ball
_ROUNDS, _CLOSE = 4, 5e-4  # most rounds of an iteration, and m of change at which it ends


def reach_ball(scene: TouchProblem, body: Body) -> tuple[Body, float]:
    """Bring the parts of a body to the ball, within their reach.

    Where the limb alone does not reach, the pelvis steps towards the ball.

    Args:
        scene: the touch.
        body: the body over its frames.
    Returns:
        The body, and how far its parts were moved, m.
    """
    own = scene.compute_surface_lines(body, scene.moment.frame)
    if np.linalg.norm(scene.solve_ball(own, scene.moment.frame)[1]) < _CLOSE:
        return body, 0.0
    reached, lines, missing = _swing_to_ball(scene, body)
    if np.linalg.norm(missing, axis=1).max() > _MISSED:
        side = scene.parts[0].side if scene.parts[0].part in ("foot", "thigh") else ""
        stepped = step_to_ball(body, side, scene.at, missing.mean(axis=0), share=scene.shares[0], fps=scene.fps)
        again = _swing_to_ball(scene, stepped)
        if np.linalg.norm(again[2]) < np.linalg.norm(missing):
            reached, lines, missing = again
    if np.linalg.norm(missing, axis=1).min() > OUT_OF_REACH:
        return body, 0.0
    return reached, float(np.linalg.norm(np.mean(lines, axis=1) - np.mean(own, axis=1), axis=1).max())


def _swing_to_ball(scene: TouchProblem, body: Body) -> tuple[Body, np.ndarray, np.ndarray]:
    """Move the parts of a body towards the ball; also return their lines and what they lack (P, 3) m there.

    Requested shifts and what the body can do are solved alternately, since a nearly straight limb yields softly and a
    spine moves on an arc.
    """
    lines = scene.compute_surface_lines(body, scene.moment.frame)
    limbs = [LimbReference.from_body(body, limb_chain(body.skeleton, part)) for part in scene.parts
             if part.part in MAX_SWING]
    shifts, moved_body = np.zeros((len(scene.parts), 3)), body
    for _ in range(_ROUNDS):
        requested = _solve_shifts(scene, body, lines, shifts)
        if np.linalg.norm(requested - shifts) < _CLOSE:
            break
        moved_body, shifts = _move_parts(scene, body, limbs, requested), requested
        lines = scene.compute_surface_lines(moved_body, scene.moment.frame)
    if not np.array_equal(moved_body.root, body.root):  # the pelvis has sunk, the foot that does not strike stays
        human = identify_joints(body.skeleton)
        other = human.right if scene.parts[0].side == "left" else human.left
        moved_body = Body.from_pose(body.skeleton, moved_body.root,
                                    hold_foot(body, other, moved_body.root, moved_body.rotations))
    return moved_body, lines, scene.solve_ball(lines, scene.moment.frame)[1]


def calm_taking_foot(scene: TouchProblem, body: Body, contacts: np.ndarray, fps: float) -> Body:
    """Slow down the foot that takes a ball.

    Args:
        scene: the touch.
        body: the body over its W frames.
        contacts: (W, 2) bool, left and right foot in contact.
        fps: frames per second.
    Returns:
        The body.
    """
    part, (first, last) = scene.parts[0], scene.moment.held
    if part.part != "foot" or not STOPPING & scene.moment.words:
        return body
    return calm_foot(body, part, (first - scene.origin, last - scene.origin), is_in_contact(contacts, part), fps)


def _solve_shifts(scene: TouchProblem, body: Body, lines: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """Compute the shifts that bring parts to the ball, within what a body can do.

    Args:
        lines: (P, 2, 3) m, the parts' lines with the shifts below.
        shifts: (P, 3) m.
    Returns:
        (P, 3) m.
    """
    requested = shifts
    for _ in range(_ROUNDS):
        _, needs = scene.solve_ball(lines + (requested - shifts)[:, None], scene.moment.frame)
        if np.linalg.norm(needs) < _CLOSE:
            break
        pairs, before = zip(scene.parts, requested, needs), requested
        requested = np.array([limit_shift(body, part, scene.at, shift + need) for part, shift, need in pairs])
        if np.linalg.norm(requested - before) < _CLOSE:
            break
    return requested


def _move_parts(scene: TouchProblem, body: Body, limbs: Sequence[LimbReference], shifts: np.ndarray) -> Body:
    """Move each part of the body by its shift (3,) m, weighted by its share."""
    root, rotations = body.root, body.rotations
    if scene.parts[0].part == "thigh":
        rotations = swing_thigh(body, scene.parts[0], scene.at, shifts[0], scene.shares[0])
    elif not limbs:
        rotations = bend_spine(body, scene.parts[0], scene.at, shifts[0], scene.shares[0])
    for part, limb, shift, share in zip(scene.parts, limbs, shifts, scene.shares):
        swing = solve_part_swing(body, part, scene.at, shift)
        moves = compute_swing_shift(body, limb.chain, swing, share)
        moves = limit_to_ground(body, part, slice(None), moves) if part.part == "foot" else moves
        root = root - share[:, None] * [0.0, 0.0, swing.lowered]
        rotations = move_limb(body, limb, moves, root, rotations)
    return Body.from_pose(body.skeleton, root, rotations)
