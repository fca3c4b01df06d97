"""Hands that hold a ball: as far apart as it needs, on any skeleton."""

from __future__ import annotations

import numpy as np

from ...base.vectors import unit_vectors
from ...motion.humanoid import identify_joints
from ...motion.limb import solve_two_bone
from ...motion.motion import Motion, compute_pose
from ...motion.retargeting.neutral import NeutralStance
from ...motion.skeleton import Skeleton

_ROUNDS = 2


def hold_ball(motion: Motion, rows: np.ndarray, neutral: NeutralStance) -> Motion:
    """Bring both hands toward or away from the middle between them, so that a ball fits in.

    Args:
        motion: T frames.
        rows: (T, 2): share by which the hands are moved, and m between their joints.
        neutral: neutral stance of the body.
    Returns:
        The motion; bodies without hands stay as they are.
    """
    body = identify_joints(neutral.skeleton)
    arms = [(arm.upper_arm, arm.lower_arm, arm.hand) for arm in (body.left, body.right)]
    if any(None in arm for arm in arms):
        return motion
    share, apart = rows[:, :1], rows[:, 1:]
    rotations = motion.rotations
    for _ in range(_ROUNDS):
        places, _ = compute_pose(motion.skeleton, motion.root_positions, rotations)
        left, right = places[:, arms[0][2]], places[:, arms[1][2]]
        middle, across = 0.5 * (left + right), unit_vectors(left - right, np.array([0.0, 1.0, 0.0]))
        for joints, sign in zip(arms, (1.0, -1.0)):
            now = places[:, joints[2]]
            goal = now + share * (middle + sign * 0.5 * apart * across - now)
            rotations = _move_hand(motion.skeleton, motion.root_positions, rotations, joints, goal)
    return Motion(motion.skeleton, motion.root_positions, rotations, motion.fps)


def _move_hand(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, joints: tuple[int, int, int],
               goal: np.ndarray) -> np.ndarray:
    return solve_two_bone(skeleton, root, rotations, joints, goal, keep_end_rotation=False, soft=0.005).rotations
