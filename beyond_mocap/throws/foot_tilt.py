"""Point the foot of a kick: a toe that goes down under the ball makes it rise, as people lift a ball.

A foot that strikes level through the middle of a ball lifts it only if the ankle goes down by many centimetres, nearly
into the ground; by pointing, its toe gets below the middle while the ankle stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.vectors import unit_vector
from ..motion import quaternion
from ..motion.motion import Motion, compute_pose, sample_frames_cubic
from .ball_release import AtFoot
from .limb_shift import LimitRotations

TILTS = tuple(np.radians([15.0, 30.0, 40.0]))
"""Radians by which a foot is pointed, the smallest with which the ankle is moved little."""
_HALF_SECONDS = 0.2  # before and after the contact, within which the foot points and returns


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
