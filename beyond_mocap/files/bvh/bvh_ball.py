"""A ball in a BVH file: a joint named as one, below the file's root or the body, which is no part of the body."""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from ...motion.ball_names import choose_ball, is_ball_name
from ...motion.humanoid import Humanoid
from ...motion.retargeting.structure import list_ancestors, list_descendants
from .bvh_channels import BvhChannels
from .bvh_text import BvhText


def find_ball_joints(text: BvhText, body: Humanoid | None) -> list[int]:
    """Find the joints named as a ball, without joints below them; a foot's own ball is none.

    Args:
        text: the file's content.
        body: its humanoid joints, None for other skeletons.
    """
    feet = set() if body is None else {body.left.foot, body.right.foot}
    return [joint for joint, name in enumerate(text.names)
            if joint and is_ball_name(name) and joint not in text.parents
            and not feet & set(list_ancestors(text.parents, joint))]  # fmt: skip


def list_body_joints(text: BvhText, hips: int, body: Humanoid | None) -> list[int]:
    """List the joints from the hips down, without balls."""
    balls = find_ball_joints(text, body)
    return [joint for joint in list_descendants(text.parents, hips) if joint not in balls]


def read_ball_joint(channels: BvhChannels, root: np.ndarray,
                    body: Humanoid | None) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Read the ball of a file.

    Args:
        channels: the file's numbers.
        root: (T, 3) m of the hips, world.
        body: the humanoid joints, None for other skeletons.
    Returns:
        The ball (T, 3) m, world, None without one; and notes.
    """
    joints = find_ball_joints(channels.text, body)
    if not joints:
        return None, ()
    names, paths = [channels.text.names[joint] for joint in joints], [_trace(channels, joint) for joint in joints]
    chosen, notes = choose_ball(names, paths, root)
    return paths[chosen], (*notes, f"{names[chosen]} is read as the recording's ball, not as a part of the body")


def _trace(channels: BvhChannels, joint: int) -> np.ndarray:
    """Trace a joint's position (T, 3) m in the world."""
    position = np.broadcast_to(channels.compute_position(joint), (len(channels.text.values), 3))
    parent = channels.text.parents[joint]
    while parent >= 0:
        turned = quaternion.rotate(channels.compute_rotation(parent).T, position)
        position, parent = turned + channels.compute_position(parent), channels.text.parents[parent]
    return np.array(position)
