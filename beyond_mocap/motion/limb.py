"""Limbs of two bones that reach: where the middle joint goes when the end joint is asked to be somewhere, and two-bone
inverse kinematics on a skeleton, over all frames at once, without stretching a bone.

Tolani, Goswami and Badler 2000 ("Real-time inverse kinematics techniques for anthropomorphic limbs"): the triangle of
upper bone, lower bone and the line to the target leaves one freedom, the direction in which the middle joint points
(the pole). The knee keeps the plane in which it bends in the pose that is given; where the limb is so straight that it
shows none, the plane comes from the frames where it is bent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.vectors import cross, unit_vectors
from . import quaternion
from .motion import pose_kinematics
from .retargeting.structure import list_between, path
from .skeleton import Skeleton

# below this distance from the line hip-ankle (share of the limb's length) a knee's direction is taken from other frames
CLEAR_BEND = 0.06


def soft_distance(distance: np.ndarray, longest: np.ndarray, soft: float | np.ndarray, xp=np) -> np.ndarray:
    """The reach that is played for an asked one, metres: exact up to `soft` below the limb's length, then nearing it.

    distance (...,) asked, longest (...,) upper plus lower bone, soft one or (...,); C1, so that a knee does not snap
    straight. xp: array module, numpy or jax.numpy."""
    start = longest - soft
    beyond = xp.maximum(distance - start, 0.0)
    return xp.where(distance > start, longest - soft * xp.exp(-beyond / soft), distance)


def inner_angle(upper, lower, length) -> np.ndarray:
    """The angle between two bones at the joint between them, by the law of cosines.

    Args:
        upper, lower: (...,), lengths of the bones, m.
        length: (...,), distance between their far ends, m.
    Returns:
        (...,), rad, from 0 folded to pi straight.
    """
    return np.arccos(np.clip((upper**2 + lower**2 - length**2) / (2.0 * upper * lower), -1.0, 1.0))


def bend(
    top: np.ndarray, target: np.ndarray, upper: np.ndarray, lower: np.ndarray, pole: np.ndarray,
    soft: float | np.ndarray = 0.01,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle joint (..., 3), end joint (..., 3) and hinge axis (..., 3) of a limb that reaches for `target`.

    top, target (..., 3) metres, world. upper, lower (...,) bone lengths, metres. pole (..., 3): roughly where the
    middle joint points. soft: metres of soft reach. The hinge is the unit axis about which the middle joint bends:
    direction of the limb x pole. A target out of reach is neared along its line; one too near is kept away by the
    difference of the bones."""
    line = target - top
    asked = np.linalg.norm(line, axis=-1)
    direction = unit_vectors(line, np.array([0.0, 0.0, -1.0]))
    nearest = np.abs(upper - lower) + 0.02 * (upper + lower)
    reach = np.maximum(soft_distance(asked, upper + lower, soft), nearest)
    across = pole - np.sum(pole * direction, axis=-1, keepdims=True) * direction
    across = _unit_across(across, direction)
    along = (upper**2 - lower**2 + reach**2) / (2.0 * reach)
    height = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    middle = top + along[..., None] * direction + height[..., None] * across
    return middle, top + reach[..., None] * direction, cross(direction, across)


def bone_frame(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """Rotations (..., 4) that turn -Z onto `direction` (..., 3) and +Y onto the part of -`hinge` that is square to it.

    A leg that hangs straight down with its knee pointing along +X has direction -Z and hinge -Y: the identity."""
    left = -(hinge - np.sum(hinge * direction, axis=-1, keepdims=True) * direction)
    left = _unit_across(left, direction)
    forward = cross(left, -direction)
    return quaternion.from_matrix(np.stack([forward, left, -direction], axis=-1))


@dataclass(frozen=True, eq=False)
class Reached:
    """What came of it. rotations (T, J, 4) local, miss (T,) metres between the end joint and its target."""

    rotations: np.ndarray
    miss: np.ndarray


def two_bone(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, *,
    end_rotation: np.ndarray | None = None, keep_end_rotation: bool = True, pole: np.ndarray | None = None,
    soft: float | np.ndarray = 0.01,
) -> Reached:
    """Local rotations with which a limb's end joint is at `target`.

    root (T, 3) metres, world; rotations (T, J, 4) local; joints: upper, middle and end joint (hip, knee, ankle or
    shoulder, elbow, wrist), each below the one before, further joints between allowed; target (T, 3) metres, world.
    end_rotation (T, 4): world rotation that the end joint gets; without it the end joint keeps its own, or (with
    keep_end_rotation false) turns rigidly with the lower bone. pole (T, 3): world direction in which the middle joint
    points; without it the pose's own. soft, one or (T,): metres below full extension from where the limb eases, see
    `soft_distance`: the miss is at most soft / e = 0.37 soft where the target is in reach.

    Bones are never stretched; a target out of reach is neared along the line from the upper joint.
    Raises InputError where a joint does not hang below the one before. Source: Tolani, Goswami and Badler 2000."""
    _check_chain(skeleton, joints)
    places, world = pose_kinematics(skeleton, root, rotations)
    end: dict[str, Any] = {"end_rotation": end_rotation, "keep_end_rotation": keep_end_rotation}
    found, miss = bent_limb(skeleton, places, world, joints, target, pole=pole, soft=soft, **end)
    out = np.array(rotations, dtype=float)
    for joint, local in found.items():
        out[:, joint] = local
    return Reached(quaternion.continuous(out), miss)


def bent_limb(
    skeleton: Skeleton, places: np.ndarray, world: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, *,
    end_rotation: np.ndarray | None = None, keep_end_rotation: bool = True, pole: np.ndarray | None = None,
    soft: float | np.ndarray = 0.01, clear: float | np.ndarray = CLEAR_BEND,
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
    new_knee, new_ankle, new_hinge = bend(top, target, *lengths, new_pole, soft)
    old_hinge = cross(unit_vectors(ankle - top, np.array([0.0, 0.0, -1.0])), old_pole)
    turns = [
        quaternion.multiply(_frame_bone(b - a, new_hinge), quaternion.inverse(_frame_bone(d - c, old_hinge)))
        for a, b, c, d in ((top, new_knee, top, knee), (new_knee, new_ankle, knee, ankle))
    ]
    new_world = world.copy()
    _turn_chain(skeleton, new_world, upper, middle, turns[0])
    _turn_chain(skeleton, new_world, middle, end, turns[1])
    if end_rotation is not None:
        new_world[:, end] = end_rotation
    elif not keep_end_rotation:
        new_world[:, end] = quaternion.multiply(turns[1], world[:, end])
    changed = [upper, *list_between(skeleton.parents, upper, end), end]
    local = {joint: _compute_local(skeleton, new_world, joint) for joint in changed}
    return local, np.linalg.norm(new_ankle - target, axis=-1)


def _unit_across(v: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) at length one; any square to `direction` (..., 3) where they have none."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / length if np.all(length > 1e-9) else unit_vectors(v, _any_normal(direction))


def _any_normal(direction: np.ndarray) -> np.ndarray:
    other = np.where(np.abs(direction[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    normal = other - np.sum(other * direction, axis=-1, keepdims=True) * direction
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _check_chain(skeleton: Skeleton, joints: tuple[int, int, int]) -> None:
    upper, middle, end = joints
    for high, low in ((upper, middle), (middle, end)):
        if high == low or high not in path(skeleton.parents, low):
            raise InputError("limb", f"{skeleton.names[low]} does not hang below {skeleton.names[high]}", "a chain")


def _turn_chain(skeleton: Skeleton, world: np.ndarray, high: int, low: int, turn: np.ndarray) -> None:
    """Turns all joints from `high` (included) down to `low` (not included) in `world` (T, J, 4)."""
    for joint in (high, *list_between(skeleton.parents, high, low)):
        world[:, joint] = quaternion.multiply(turn, world[:, joint])


def _compute_local(skeleton: Skeleton, world: np.ndarray, joint: int) -> np.ndarray:
    parent = skeleton.parents[joint]
    return world[:, joint] if parent < 0 else quaternion.multiply(quaternion.inverse(world[:, parent]), world[:, joint])


def _frame_bone(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    return bone_frame(unit_vectors(direction, np.array([0.0, 0.0, -1.0])), hinge)


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
