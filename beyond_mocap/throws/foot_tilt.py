"""Point the foot of a kick: a toe that goes down under the ball makes it rise, as people lift a ball.

A foot that strikes level through the middle of a ball lifts it only if the ankle goes down by many centimetres, nearly
into the ground; by pointing, its toe gets below the middle while the ankle stays. The tip, ahead of the toe joint,
would then be in the ground, so the toes bend up by what is missing: the ball meets the foot behind them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.vectors import unit_vector
from ..motion import quaternion
from ..motion.humanoid import identify_joints, pose_legs
from ..motion.motion import Motion, compute_pose, sample_frames_cubic
from ..motion.retargeting.neutral import build_neutral_stance
from ..motion.toe_roll import DEEPEST, bend_toe, measure_toe_bends
from .ball_release import AtFoot, sample_points
from .limb_shift import LimitRotations

TILTS = tuple(np.radians([15.0, 30.0, 40.0]))
"""Radians by which a foot is pointed, the smallest with which the ankle is moved little."""
_HALF_SECONDS = 0.2  # before and after the contact, within which the foot points and returns
_FINE = 8  # places between two frames at which a foot is compared with the ground: it moves by half a metre from one to
# the next


def point_foot(
    motion: Motion, part: AtFoot, frame: float, tilt: float, limit_rotations: LimitRotations | None = None
) -> Motion:
    """Point the toe of a striking foot down around a moment; the ankle stays where it is.

    Args:
        motion: the motion.
        part: the foot.
        frame: fractional frame of the contact.
        tilt: rad at that frame.
        limit_rotations: limits the rotations of the limb.
    """
    joints, rotations = list(part.list_joints(motion)), motion.rotations.copy()
    share = _compute_shares(motion, part, frame)
    turn = quaternion.from_rotation_vector(tilt * share[:, None] * _find_axis(motion, part, frame))
    rotations[:, joints[-1]] = quaternion.multiply(rotations[:, joints[-1]], turn)
    if limit_rotations is not None:
        moved = np.ix_(np.flatnonzero(share > 0.0), np.array(joints))
        rotations[moved] = limit_rotations(rotations[moved], motion.rotations[moved])
    return replace(motion, rotations=rotations)


def is_above_ground(motion: Motion, part: AtFoot, frame: float) -> bool:
    """Whether a striking foot, up to its toe joint or its end, stays above the ground in its swing."""
    return bool(sample_points(motion, part, _list_fine_frames(motion, part, frame))[..., 2].min() > -DEEPEST)


def lift_toe_tip(motion: Motion, part: AtFoot, frame: float) -> Motion:
    """Bend the toes of a striking foot up where their tip would be below the ground in its swing.

    Args:
        motion: the motion.
        part: the foot.
        frame: fractional frame of the contact.
    Returns:
        The motion; as it was for a foot without a toe joint, which ends where it meets the ball.
    """
    skeleton, limb = motion.skeleton, getattr(identify_joints(motion.skeleton), part.side)
    if limb.toe is None:
        return motion
    neutral, fine = build_neutral_stance(skeleton, motion), _list_fine_frames(motion, part, frame)
    places, world = pose_legs(skeleton, *sample_frames_cubic(motion, fine))
    missing = measure_toe_bends(neutral, limb, places[:, limb.toe], world[:, limb.toe])
    is_near = np.abs(fine - np.arange(len(motion))[:, None]) < 1.0  # a frame's toe is seen up to the frames beside it
    bends = np.max(np.where(is_near, missing, 0.0), axis=1)
    world = pose_legs(skeleton, motion.root_positions, motion.rotations)[1]
    return replace(motion, rotations=bend_toe(neutral, limb, bends, rotations=motion.rotations, world=world))


def _list_fine_frames(motion: Motion, part: AtFoot, frame: float) -> np.ndarray:
    """List the fractional frames of a foot's swing at which it is compared with the ground."""
    first, last = part.find_frame_range(motion, frame)
    return np.arange(_FINE * first, _FINE * last + 1) / _FINE


def _compute_shares(motion: Motion, part: AtFoot, frame: float) -> np.ndarray:
    """Compute the share (T,) of the tilt in each frame: 1 at the contact, 0 outside the foot's swing."""
    first, last = part.find_frame_range(motion, frame)
    seconds = (np.arange(len(motion)) - frame) / motion.fps
    half = np.where(seconds < 0.0, frame - first + 1.0, last - frame + 1.0) / motion.fps
    return 0.5 + 0.5 * np.cos(np.pi * np.clip(seconds / np.minimum(half, _HALF_SECONDS), -1.0, 1.0))


def _find_axis(motion: Motion, part: AtFoot, frame: float) -> np.ndarray:
    """Find the axis (3,), in the foot's own axes, about which its toe goes straight down; zero for a vertical foot."""
    places, turns = compute_pose(motion.skeleton, *sample_frames_cubic(motion, np.array([frame])))
    ankle_end, toe_end = part.compute_points(motion, places, turns)[0]
    across = unit_vector(np.cross(toe_end - ankle_end, [0.0, 0.0, -1.0]))
    return quaternion.rotate(quaternion.inverse(turns[0, part.list_joints(motion)[-1]]), across)
