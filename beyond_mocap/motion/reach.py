"""Limbs that reach: two-bone inverse kinematics on a skeleton, over all frames at once, without stretching a bone.

Feet are kept on the ground and striking feet brought to the ball with it. The knee keeps the plane in which it bends in
the pose that is given; where the limb is so straight that it shows none, the plane comes from the frames where it is
bent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.vectors import cross, unit_vectors
from . import limb, quaternion
from .motion import pose_kinematics
from .retargeting.structure import path
from .skeleton import Skeleton

# below this distance from the line hip-ankle (share of the limb's length) a knee's direction is taken from other frames
CLEAR_BEND = 0.06


@dataclass(frozen=True, eq=False)
class Reached:
    """What came of it. rotations (T, J, 4) local, miss (T,) metres between the end joint and its target."""

    rotations: np.ndarray
    miss: np.ndarray


def two_bone(
    skeleton: Skeleton,
    root: np.ndarray,
    rotations: np.ndarray,
    joints: tuple[int, int, int],
    target: np.ndarray,
    *,
    end_rotation: np.ndarray | None = None,
    keep_end_rotation: bool = True,
    pole: np.ndarray | None = None,
    soft: float | np.ndarray = 0.01,
) -> Reached:
    """Local rotations with which a limb's end joint is at `target`.

    root (T, 3) metres, world; rotations (T, J, 4) local; joints: upper, middle and end joint (hip, knee, ankle or
    shoulder, elbow, wrist), each below the one before, further joints between allowed; target (T, 3) metres, world.
    end_rotation (T, 4): world rotation that the end joint gets; without it the end joint keeps its own, or (with
    keep_end_rotation false) turns rigidly with the lower bone. pole (T, 3): world direction in which the middle joint
    points; without it the pose's own. soft, one or (T,): metres below full extension from where the limb eases, see
    `limb.soft_distance`: the miss is at most soft / e = 0.37 soft where the target is in reach.

    Bones are never stretched; a target out of reach is neared along the line from the upper joint.
    Raises InputError where a joint does not hang below the one before. Source: `motion.limb`.
    """
    _check_chain(skeleton, joints)
    places, world = pose_kinematics(skeleton, root, rotations)
    end: dict[str, Any] = {"end_rotation": end_rotation, "keep_end_rotation": keep_end_rotation}
    found, miss = bent_limb(skeleton, places, world, joints, target, pole=pole, soft=soft, **end)
    out = np.array(rotations, dtype=float)
    for joint, local in found.items():
        out[:, joint] = local
    return Reached(quaternion.continuous(out), miss)


def bent_limb(
    skeleton: Skeleton,
    places: np.ndarray,
    world: np.ndarray,
    joints: tuple[int, int, int],
    target: np.ndarray,
    *,
    end_rotation: np.ndarray | None = None,
    keep_end_rotation: bool = True,
    pole: np.ndarray | None = None,
    soft: float | np.ndarray = 0.01,
    clear: float | np.ndarray = CLEAR_BEND,
) -> tuple[dict[int, np.ndarray], np.ndarray]:
    """As `two_bone`, of a body whose joints' places (T, J, 3) m and world rotations (T, J, 4) are known, those of the
    limb at least: the new local rotations (T, 4) by joint, and the miss (T,) m. clear, one or (T,): share of the limb's
    length by which a knee has to be off the line hip-ankle for its direction to be believed."""
    upper, middle, end = joints
    target = np.asarray(target, dtype=float)
    top, knee, ankle = places[:, upper], places[:, middle], places[:, end]
    lengths = (np.linalg.norm(knee - top, axis=-1), np.linalg.norm(ankle - knee, axis=-1))
    old_pole = _own_pole(top, knee, ankle, world[:, upper], clear)
    swing = quaternion.between(ankle - top, target - top)
    new_pole = quaternion.rotate(swing, old_pole) if pole is None else np.asarray(pole, dtype=float)
    new_knee, new_ankle, new_hinge = limb.bend(top, target, *lengths, new_pole, soft)
    old_hinge = cross(unit_vectors(ankle - top, np.array([0.0, 0.0, -1.0])), old_pole)
    turns = [
        quaternion.multiply(_frame(b - a, new_hinge), quaternion.inverse(_frame(d - c, old_hinge)))
        for a, b, c, d in ((top, new_knee, top, knee), (new_knee, new_ankle, knee, ankle))
    ]
    new_world = world.copy()
    _turn_chain(skeleton, new_world, upper, middle, turns[0])
    _turn_chain(skeleton, new_world, middle, end, turns[1])
    if end_rotation is not None:
        new_world[:, end] = end_rotation
    elif not keep_end_rotation:
        new_world[:, end] = quaternion.multiply(turns[1], world[:, end])
    changed = [*_between(skeleton, upper, end), end]
    return {joint: _local(skeleton, new_world, joint) for joint in changed}, np.linalg.norm(new_ankle - target, axis=-1)


def _check_chain(skeleton: Skeleton, joints: tuple[int, int, int]) -> None:
    upper, middle, end = joints
    for high, low in ((upper, middle), (middle, end)):
        if high == low or high not in path(skeleton.parents, low):
            raise InputError("limb", f"{skeleton.names[low]} does not hang below {skeleton.names[high]}", "a chain")


def _between(skeleton: Skeleton, high: int, low: int) -> list[int]:
    """Joints from `high` (included) down to `low` (not included)."""
    chain = path(skeleton.parents, low)
    return chain[1 : chain.index(high) + 1][::-1]


def _turn_chain(skeleton: Skeleton, world: np.ndarray, high: int, low: int, turn: np.ndarray) -> None:
    for joint in _between(skeleton, high, low):
        world[:, joint] = quaternion.multiply(turn, world[:, joint])


def _local(skeleton: Skeleton, world: np.ndarray, joint: int) -> np.ndarray:
    parent = skeleton.parents[joint]
    return world[:, joint] if parent < 0 else quaternion.multiply(quaternion.inverse(world[:, parent]), world[:, joint])


def _frame(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    return limb.bone_frame(unit_vectors(direction, np.array([0.0, 0.0, -1.0])), hinge)


def _own_pole(
    top: np.ndarray, knee: np.ndarray, ankle: np.ndarray, upper_world: np.ndarray, clear: float | np.ndarray
) -> np.ndarray:
    """Direction (T, 3) in which the middle joint points in the given pose, unit, square to the line top-ankle.

    A nearly straight limb says little: there the direction is mixed with the mean one of all frames, carried by the
    upper bone (a knee is a hinge), weighted by how clearly each frame shows it."""
    line = unit_vectors(ankle - top, np.array([0.0, 0.0, -1.0]))
    off = knee - top - np.sum((knee - top) * line, axis=-1, keepdims=True) * line
    length = np.linalg.norm(knee - top, axis=-1) + np.linalg.norm(ankle - knee, axis=-1)
    bent = (np.linalg.norm(off, axis=-1) / np.maximum(length, 1e-9))[:, None]
    in_bone = quaternion.rotate(quaternion.inverse(upper_world), off)
    mean = np.sum(in_bone * bent, axis=0)
    if np.linalg.norm(mean) < 1e-9:
        across = unit_vectors(np.array([1.0, 0.0, 0.0]) - line[..., :1] * line, np.array([0.0, 0.0, 1.0]))
        return unit_vectors(off, across)
    steady = quaternion.rotate(upper_world, mean / np.linalg.norm(mean))
    steady = unit_vectors(steady - np.sum(steady * line, axis=-1, keepdims=True) * line, off)
    # a frame that bends the other way, as blended poses may, is not believed: its knee would flip
    right_way = np.sum(unit_vectors(off, steady) * steady, axis=-1, keepdims=True)
    weight = np.clip(bent / np.reshape(clear, (-1, 1)), 0.0, 1.0) ** 2 * np.clip(2.0 * right_way, 0.0, 1.0)
    mixed = weight * unit_vectors(off, steady) + (1.0 - weight) * steady
    return unit_vectors(mixed, steady)
