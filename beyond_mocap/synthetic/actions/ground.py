"""Keep an action's body above the ground: hips of a body on its feet or knees, the whole body where it lies."""

from __future__ import annotations

import numpy as np

from ...motion.humanoid import identify_joints
from ...motion.motion import Motion, compute_pose
from ...motion.retargeting.neutral import NeutralStance
from ...motion.retargeting.posture import Posture, compute_hip_positions, to_motion
from ..gait_legs import measure_leg
from ..lying import compute_lowest_root, iter_surface, raise_arms, smooth_above

_ROUNDS = 3
_LONGEST_REACH = 0.9955  # share of the leg's length, as in walking (`gait`)
_MOST_LOWERED = 0.1  # share of the leg's length


def raise_hips(posture: Posture, neutral: NeutralStance) -> Posture:
    """Raise the hips where trunk, head or a knee would be below the ground; feet stay.

    Args:
        posture: T frames.
        neutral: neutral stance of the body.
    Returns:
        The posture.
    """
    for _ in range(_ROUNDS):
        motion = to_motion(posture, neutral)
        need = np.maximum(-_measure_height(motion), 0.0)
        if not need.any():
            break
        raised = np.zeros_like(posture.hips)
        raised[:, 2] = smooth_above(need, posture.fps)
        posture = posture.replace_arrays(hips=posture.hips + raised)
    return posture


def lower_hips(posture: Posture, is_down: np.ndarray, neutral: NeutralStance) -> Posture:
    """Lower the hips where a leg would not reach its foot on the ground.

    Args:
        posture: T frames.
        is_down: (T, 2) bool, left and right foot on the ground.
        neutral: neutral stance of the body.
    Returns:
        The posture.
    """
    tops, drop = compute_hip_positions(posture, neutral), np.zeros(len(posture))
    for side in (0, 1):
        away = posture.ankles[:, side] - tops[:, side]
        longest = _LONGEST_REACH * sum(measure_leg(neutral, side))
        flat = np.minimum(np.linalg.norm(away[:, :2], axis=1), longest)
        drop = np.maximum(drop, np.where(is_down[:, side], -away[:, 2] - np.sqrt(longest**2 - flat**2), 0.0))
    hips = posture.hips.copy()
    hips[:, 2] -= smooth_above(np.minimum(drop, _MOST_LOWERED * neutral.leg), posture.fps)
    return posture.replace_arrays(hips=hips)


def _measure_height(motion: Motion) -> np.ndarray:
    """Measure the height (T,) m of the lowest part of trunk, head and legs without feet above the ground."""
    body = identify_joints(motion.skeleton)
    trunk = {body.hips, *body.spine, body.neck, body.head, body.left.lower_leg, body.right.lower_leg,
             body.left.upper_leg, body.right.upper_leg}
    places, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    return np.min([place[:, 2] - thick for joint, place, thick in iter_surface(motion.skeleton, places, world)
                   if joint in trunk], axis=0)


def keep_above_ground(motion: Motion, weight: np.ndarray) -> Motion:
    """Raise the arms and then the whole body where parts of it are below the ground.

    Args:
        motion: T frames.
        weight: (T,) share by which each frame is corrected.
    Returns:
        The motion.
    """
    rotations = raise_arms(motion.skeleton, motion.root_positions, motion.rotations, motion.fps)
    below = compute_lowest_root(motion.skeleton, rotations) - motion.root_positions[:, 2]
    root = motion.root_positions.copy()
    root[:, 2] += weight * smooth_above(np.where(weight > 0.0, np.maximum(below, 0.0), 0.0), motion.fps)
    return Motion(motion.skeleton, root, rotations, motion.fps)
