"""Bodies as rotation matrices, in numpy and in jax: positions and rotations of joints, and rotations as six numbers.

Networks learn on matrices: a rotation is the first two columns of its matrix (its x and its y axis; Zhang, Starke,
Komura and Saito 2018, Fredriksson section 7.1.1), which has no discontinuities. Every function takes the array
module `xp` (numpy or jax.numpy) last, and writes into no array, so that training and use run the same code.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton

_TINY = 1e-12  # below any relevant square of a length: gradients of a square root stay finite
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


class Pose(NamedTuple):
    """State of a body in one frame, or in many: leading axes are free.

    Attributes:
        root: (..., 3) m, position of the root joint, world.
        local: (..., J, 3, 3), rotation of each joint relative to its parent.
        positions: (..., J, 3) m, world.
        turns: (..., J, 3, 3), rotations, world.
        moved: (..., J, 3) m, displacement of each joint since the previous frame.
    """

    root: np.ndarray
    local: np.ndarray
    positions: np.ndarray
    turns: np.ndarray
    moved: np.ndarray


def compute_world_transforms(offsets, parents, root, local, xp=np):
    """Compute positions and rotations of all joints in the world (forward kinematics).

    Args:
        offsets: (J, 3) m, relative to the parents.
        parents: (J,) with -1 for the root, which comes first.
        root: (..., 3) m, world.
        local: (..., J, 3, 3), relative to the parents.
        xp: numpy or jax.numpy.
    Returns:
        Positions (..., J, 3) m and rotations (..., J, 3, 3).
    """
    positions, turns = [root], [local[..., 0, :, :]]
    for joint in range(1, len(parents)):
        parent = parents[joint]
        turns.append(xp.matmul(turns[parent], local[..., joint, :, :]))
        positions.append(positions[parent] + xp.matmul(turns[parent], offsets[joint]))
    return xp.stack(positions, axis=-2), xp.stack(turns, axis=-3)


def compute_pose_transforms(offsets, parents: tuple[int, ...], root, local) -> tuple[np.ndarray, np.ndarray]:
    """Compute the same for one pose with numpy, several times as fast: root (3,), local (J, 3, 3).

    All joints of one depth are computed at once, rotation and position as one 4 x 4 matrix.
    """
    moves = np.zeros((len(parents), 4, 4))
    moves[:, :3, :3], moves[:, :3, 3], moves[:, 3, 3] = local, offsets, 1.0
    moves[0, :3, 3] = root
    for joints, above in _group_by_depth(tuple(parents)):
        moves[joints] = moves[above] @ moves[joints]
    return moves[:, :3, 3].copy(), moves[:, :3, :3].copy()


@lru_cache(maxsize=32)
def _group_by_depth(parents: tuple[int, ...]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Group the joints by depth below the root, with their parents."""
    depths = []
    for parent in parents:
        depths.append(0 if parent < 0 else depths[parent] + 1)
    depths, above = np.array(depths), np.array(parents)
    every = [np.flatnonzero(depths == depth) for depth in range(1, depths.max() + 1)]
    return [(joints, above[joints]) for joints in every]


def build_pose(skeleton: Skeleton, root, local, xp=np) -> Pose:
    """Build the state of a body without motion from its root (..., 3) m and local rotations (..., J, 3, 3)."""
    positions, turns = compute_world_transforms(skeleton.offsets, skeleton.parents, root, local, xp)
    return Pose(root, local, positions, turns, xp.zeros_like(positions))


def to_six(turns, xp=np):
    """Convert rotations (..., 3, 3) to their x and y axes: (..., 6)."""
    return xp.concatenate([turns[..., :, 0], turns[..., :, 1]], axis=-1)


def from_six(values, xp=np):
    """Convert values (..., 6) to the nearest rotations (..., 3, 3): Gram-Schmidt, the x axis first."""
    first = _normalize(values[..., :3], xp)
    second = values[..., 3:]
    second = _normalize(second - xp.sum(first * second, axis=-1, keepdims=True) * first, xp)
    third = first[..., _NEXT] * second[..., _LAST] - first[..., _LAST] * second[..., _NEXT]
    return xp.stack([first, second, third], axis=-1)


def _normalize(vectors, xp):
    return vectors / xp.sqrt(xp.sum(vectors * vectors, axis=-1, keepdims=True) + _TINY)


def transpose(turns, xp=np):
    """Invert rotations (..., 3, 3)."""
    return xp.swapaxes(turns, -1, -2)


def to_matrices(motion: Motion) -> np.ndarray:
    """Convert a motion's local rotations to matrices (T, J, 3, 3)."""
    return quaternion.to_matrix(motion.rotations)


def to_motion(skeleton: Skeleton, root: np.ndarray, local: np.ndarray, fps: float) -> Motion:
    """Build the motion with root positions (T, 3) m and local rotations (T, J, 3, 3)."""
    return Motion(skeleton, root, quaternion.from_matrix(np.asarray(local, dtype=float)), fps)


def flatten(values, axes: int):
    """Merge the last `axes` axes into one."""
    return values.reshape(*values.shape[:-axes], -1)


def take_joints(values, joints: tuple[int, ...], axis: int, xp=np):
    """Take some joints of values whose joints lie along `axis` (-2 for positions, -3 for rotations)."""
    return xp.take(values, _build_index(joints), axis=axis)


@lru_cache(maxsize=256)
def _build_index(joints: tuple[int, ...]) -> np.ndarray:
    return np.array(joints)


def update_joints(skeleton: Skeleton, pose: Pose, joints: tuple[int, ...], root, local: dict, given: dict,
                  xp=np) -> Pose:
    """Update some joints of a pose with new rotations; all other joints stay as they are.

    Args:
        skeleton: the skeleton.
        pose: the pose.
        joints: indices of the joints to update, parents first.
        root: (..., 3) m, position of the root joint.
        local: joint -> (..., 3, 3), relative to its parent.
        given: joint -> (..., 3, 3), world.
        xp: numpy or jax.numpy.
    """
    places, turns, changed = {}, {}, dict(local)
    for joint in joints:
        parent = skeleton.parents[joint]
        if parent < 0:
            places[joint] = root
            turns[joint] = changed[joint] = given.get(joint, local.get(joint, pose.local[..., joint, :, :]))
            continue
        base = turns[parent] if parent in turns else pose.turns[..., parent, :, :]
        start = places[parent] if parent in places else pose.positions[..., parent, :]
        if joint in given:
            changed[joint] = xp.matmul(transpose(base, xp), given[joint])
        turns[joint] = xp.matmul(base, changed[joint] if joint in changed else pose.local[..., joint, :, :])
        places[joint] = start + xp.matmul(base, skeleton.offsets[joint])
    return pose._replace(
        root=root, local=_replace_joints(pose.local, changed, -3, xp), positions=_replace_joints(pose.positions, places,
                                                                                                 -2, xp),
        turns=_replace_joints(pose.turns, turns, -3, xp),
    )


def _replace_joints(values, replacements: dict, axis: int, xp):
    """Replace the values of some joints, in a new array."""
    if xp is np:
        changed = values.copy()
        for joint, value in replacements.items():
            changed[(..., joint, *(slice(None),) * (-1 - axis))] = value
        return changed
    order = np.arange(values.shape[axis])
    order[list(replacements)] = len(order) + np.arange(len(replacements))
    return xp.take(xp.concatenate([values, xp.stack(list(replacements.values()), axis=axis)], axis=axis), order,
                   axis=axis)
