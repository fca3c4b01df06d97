"""The stance in which the body is sculpted and fitted: neutral, with both arms lifted half way to the side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, compute_local_rotations, compute_pose
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance, is_rest_upright
from ..motion.retargeting.structure import list_descendants
from ..motion.skeleton import Skeleton, freeze_array

ARM_TILT = np.radians(45.0)
"""Angle by which the arms are lifted: half way between hanging and level, so neither bends the shoulders far."""


def build_lifted_stance(skeleton: Skeleton, example: Motion | None = None) -> NeutralStance:
    """Build the neutral stance with lifted arms.

    The face looks ahead as in the rest pose if that stands upright.

    Args:
        skeleton, example: as in `neutral.build_neutral_stance`.
    Returns:
        The stance.
    Raises:
        InputError: if the skeleton has no hips or legs.
    """
    neutral = build_neutral_stance(skeleton, example)
    if example is not None and is_rest_upright(skeleton):
        neutral = _level_head(neutral, build_neutral_stance(skeleton))
    body, world = identify_joints(skeleton), np.array(neutral.rotations)
    for limb, side in ((body.left, 1.0), (body.right, -1.0)):
        if limb.upper_arm is not None:
            turn = quaternion.from_axis_angle(np.array([1.0, 0.0, 0.0]), side * ARM_TILT)
            below = list_descendants(skeleton.parents, limb.upper_arm)
            world[below] = quaternion.multiply(turn, world[below])
    root = neutral.positions[:1]
    positions, _ = compute_pose(skeleton, root, compute_local_rotations(skeleton, world)[None])
    return replace(neutral, rotations=freeze_array(world), positions=freeze_array(positions[0]))


def _level_head(neutral: NeutralStance, rest: NeutralStance) -> NeutralStance:
    """Give the stance the head of the rest pose, unless the example's people would then look up.

    A player who kicks or walks looks down at the ground ahead, but some suits have a bowed head in the rest pose.
    """
    carrier = identify_joints(neutral.skeleton).head_or_neck
    ahead = quaternion.multiply(neutral.rotations[carrier], quaternion.inverse(rest.rotations[carrier]))
    if quaternion.rotate(ahead, np.array([1.0, 0.0, 0.0]))[2] > 0.0:
        return neutral
    rotations = np.array(neutral.rotations)
    rotations[carrier] = rest.rotations[carrier]
    return replace(neutral, rotations=rotations)
