"""Toes that stay on the ground while the heel rises: a boot rolls over its ball and does not dig its tip in.

Recordings seldom bend the toe joint (many suits and markers do not see it), and a heel that rises about the toe joint
takes a stiff tip down with it, by up to 6 cm. Here the toe bends up by what is missing, in every frame alone: nothing
hangs on a toe, so nothing else moves. Without a toe joint the whole foot turns up about its ankle, by a little.
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import unit_vectors
from . import quaternion
from .humanoid import Limb, identify_joints, pose_legs
from .retargeting.neutral import NeutralStance

DEEPEST = 0.005  # m below the ground that a tip may be: grass gives, and floors of recordings are uneven by as much
MOST_BEND = np.radians(60.0)  # of a toe joint; running shoes bend by 30 to 50 degrees at toe-off
MOST_FOOT_TURN = np.radians(20.0)  # of a foot without a toe joint: its ankle has its own part in the step
_TIP_THICKNESS = 0.008  # share of the leg's length, of the sole at the tip below its middle


def roll_toes(neutral: NeutralStance, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Bend the toes up where the tips of the feet would be below the ground, z = 0.

    Args:
        neutral: the skeleton in its neutral stance, which shows how a flat foot lies.
        root: (T, 3) m, world.
        rotations: (T, J, 4) local rotations.
    Returns:
        (T, J, 4) local rotations; those that need no bend are unchanged.
    """
    places, world = pose_legs(neutral.skeleton, root, rotations)
    body, out = identify_joints(neutral.skeleton), rotations
    for limb in (body.left, body.right):
        joint = limb.toe_or_foot
        bends = measure_toe_bends(neutral, limb, places[:, joint], world[:, joint])
        out = bend_toe(neutral, limb, bends, rotations=out, world=world)
    return out


def bend_toe(neutral: NeutralStance, limb: Limb, bends: np.ndarray, *, rotations: np.ndarray,
             world: np.ndarray) -> np.ndarray:
    """Bend one toe up, or the foot without a toe joint.

    Args:
        neutral: the skeleton in its neutral stance.
        limb: the side.
        bends: (T,) rad.
        rotations: (T, J, 4) local rotations.
        world: (T, J, 4) world rotations, of the legs at least.
    Returns:
        (T, J, 4) local rotations; those with a bend of 0 are unchanged.
    """
    joint, below, out = limb.toe_or_foot, np.flatnonzero(bends > 0.0), rotations.copy()
    if len(below):
        ahead = _point_ahead(neutral, joint, world[below, joint])
        left = unit_vectors(np.cross(np.array([0.0, 0.0, 1.0]), ahead), np.array([0.0, 1.0, 0.0]))
        turned = quaternion.multiply(quaternion.from_axis_angle(left, -bends[below]), world[below, joint])
        parent = world[below, neutral.skeleton.parents[joint]]
        local = quaternion.multiply(quaternion.inverse(parent), turned)
        out[below, joint] = quaternion.match_signs(local, rotations[below, joint])
    return out


def measure_toe_bends(neutral: NeutralStance, limb: Limb, place: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Measure how far a tip has to turn up so that it is not below the ground, z = 0.

    Args:
        neutral: the skeleton in its neutral stance.
        limb: the side.
        place: (T, 3) m, of the toe joint, or of the foot without one.
        world: (T, 4) its world rotation.
    Returns:
        (T,) rad.
    """
    joint = limb.toe_or_foot
    length = neutral.tip if limb.toe is not None else neutral.ball[0, 0] + neutral.tip
    sole = neutral.positions[joint, 2] - _TIP_THICKNESS * neutral.leg
    most = MOST_BEND if limb.toe is not None else MOST_FOOT_TURN
    slope = np.arcsin(np.clip(_point_ahead(neutral, joint, world)[:, 2], -1.0, 1.0))
    # the tip lies `length` ahead of the joint and `sole` below it: its height is length sin(a) - sole cos(a)
    reach, phase = np.hypot(length, sole), np.arctan2(sole, length)
    least = np.arcsin(np.clip((-DEEPEST - place[:, 2]) / reach, -1.0, 0.0)) + phase
    return np.clip(least - slope, 0.0, most)


def _point_ahead(neutral: NeutralStance, joint: int, world: np.ndarray) -> np.ndarray:
    """Compute where a foot points (T, 3) that points along X in the neutral stance; world (T, 4) of its joint."""
    turn = quaternion.multiply(world, quaternion.inverse(neutral.rotations[joint]))
    return quaternion.rotate(turn, np.array([1.0, 0.0, 0.0]))
