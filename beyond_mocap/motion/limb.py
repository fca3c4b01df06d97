"""Two-bone inverse kinematics: limbs reach for targets over all frames at once, without stretching a bone.

The triangle of upper bone, lower bone and the line to the target leaves one degree of freedom: the direction in which
the middle joint points (the pole). The knee keeps the plane in which it bends in the given pose. Where the limb is too
straight to show a plane, the plane comes from the frames in which it is bent.

Source: Tolani, Goswami and Badler 2000, "Real-time inverse kinematics techniques for anthropomorphic limbs".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.vectors import cross_product, dot_products, measure_lengths, unit_vectors
from . import quaternion
from .motion import compute_pose
from .retargeting.structure import list_ancestors, list_between
from .skeleton import Skeleton

# below this distance of the knee from the line hip-ankle (share of the limb's length) its direction comes from other
# frames
MIN_BEND = 0.06


def soften_distance(distance: np.ndarray, longest: np.ndarray, soft: float | np.ndarray, xp=np) -> np.ndarray:
    """Soften a limb's reach near full extension, so that a knee does not snap straight.

    The result equals the requested distance up to `soft` below the limb's length and then approaches that length (C1).

    Args:
        distance: (...,) requested distance from the limb's first to its last joint, metres.
        longest: (...,) length of upper plus lower bone, metres.
        soft: one value or (...,), metres below full length at which softening starts.
        xp: array module, numpy or jax.numpy.
    Returns:
        (...,) the distance to use, metres.
    """
    start = longest - soft
    beyond = xp.maximum(distance - start, 0.0)
    return xp.where(distance > start, longest - soft * xp.exp(-beyond / soft), distance)


def compute_inner_angle(upper, lower, length) -> np.ndarray:
    """Compute the angle between two bones at the joint between them, by the law of cosines.

    Args:
        upper, lower: (...,) lengths of the bones, metres.
        length: (...,) distance between their far ends, metres.
    Returns:
        (...,) radians, from 0 folded to pi straight.
    """
    return np.arccos(np.clip((upper**2 + lower**2 - length**2) / (2.0 * upper * lower), -1.0, 1.0))


def solve_limb_bend(
    top: np.ndarray, target: np.ndarray, upper: np.ndarray, lower: np.ndarray, pole: np.ndarray,
    soft: float | np.ndarray = 0.01,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve the middle and end joint of a limb that reaches for a target.

    A target out of reach is approached along its line; one that is too near is kept away by the difference of the
    bones.

    Args:
        top: (..., 3) the limb's first joint, metres, world.
        target: (..., 3) where the end joint should be, metres, world.
        upper, lower: (...,) bone lengths, metres.
        pole: (..., 3) direction in which the middle joint roughly points, world.
        soft: metres of soft reach, see `soften_distance`.
    Returns:
        Middle joint (..., 3), end joint (..., 3), and hinge (..., 3): the unit axis about which the middle joint bends,
        direction of the limb x pole.
    """
    line = target - top
    target_distance = measure_lengths(line)
    direction = unit_vectors(line, np.array([0.0, 0.0, -1.0]))
    nearest = np.abs(upper - lower) + 0.02 * (upper + lower)
    reach = np.maximum(soften_distance(target_distance, upper + lower, soft), nearest)
    across = pole - dot_products(pole, direction)[..., None] * direction
    across = _normalize_across(across, direction)
    # position of the middle joint along the line and its height off it, from the triangle's three sides
    along = (upper**2 - lower**2 + reach**2) / (2.0 * reach)
    height = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    middle = top + along[..., None] * direction + height[..., None] * across
    return middle, top + reach[..., None] * direction, cross_product(direction, across)


def build_bone_frame(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """Build the rotations (..., 4) that turn -Z onto a bone and +Y onto the part of -hinge that is square to it.

    A leg that hangs straight down with its knee pointing along +X has direction -Z and hinge -Y: the identity.

    Args:
        direction: (..., 3) unit direction of the bone, world.
        hinge: (..., 3) axis about which the joint bends, world.
    Returns:
        (..., 4) unit quaternions.
    """
    left = -(hinge - dot_products(hinge, direction)[..., None] * direction)
    left = _normalize_across(left, direction)
    up = -direction
    return quaternion.from_axes(*(np.asarray(axis, order="F") for axis in (cross_product(left, up), left, up)))


@dataclass(frozen=True, eq=False)
class LimbSolution:
    """The result of two-bone inverse kinematics.

    Attributes:
        rotations: (T, J, 4) local rotations.
        miss: (T,) metres between the end joint and its target.
    """

    rotations: np.ndarray
    miss: np.ndarray


def solve_two_bone(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, *,
    end_rotation: np.ndarray | None = None, keep_end_rotation: bool = True, pole: np.ndarray | None = None,
    soft: float | np.ndarray = 0.01,
) -> LimbSolution:
    """Solve the local rotations with which a limb's end joint is at a target.

    Bones are never stretched; a target out of reach is approached along the line from the upper joint.

    Args:
        skeleton: J joints.
        root: (T, 3) root positions, metres, world.
        rotations: (T, J, 4) local rotations.
        joints: upper, middle and end joint (hip, knee, ankle or shoulder, elbow, wrist), each below the one before;
            further joints may lie between them.
        target: (T, 3) metres, world.
        end_rotation: (T, 4) world rotation that the end joint gets; None keeps its own.
        keep_end_rotation: without `end_rotation`, False rotates the end joint rigidly with the lower bone.
        pole: (T, 3) world direction in which the middle joint points; None keeps the pose's own.
        soft: one value or (T,), metres below full extension from where the limb eases, see `soften_distance`. Where the
            target is in reach the miss is at most soft / e = 0.37 soft.
    Returns:
        The rotations and the remaining distances.
    Raises:
        InputError: if a joint does not hang below the one before.
    Source: Tolani, Goswami and Badler 2000.
    """
    _check_chain(skeleton, joints)
    places, world = compute_pose(skeleton, root, rotations, list_ancestors(skeleton.parents, joints[2]))
    end: dict[str, Any] = {"end_rotation": end_rotation, "keep_end_rotation": keep_end_rotation}
    found, miss = solve_posed_limb(skeleton, places, world, joints, target, pole=pole, soft=soft, **end)
    out = np.array(rotations, dtype=float)
    for joint, local in found.items():
        out[:, joint] = local
    return LimbSolution(quaternion.unify_signs(out), miss)


def solve_posed_limb(
    skeleton: Skeleton, places: np.ndarray, world: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, *,
    end_rotation: np.ndarray | None = None, keep_end_rotation: bool = True, pole: np.ndarray | None = None,
    soft: float | np.ndarray = 0.01, min_bend: float | np.ndarray = MIN_BEND,
) -> tuple[dict[int, np.ndarray], np.ndarray]:
    """Solve a limb as `solve_two_bone` does, for a body whose joint positions and world rotations are known.

    Args:
        skeleton: J joints.
        places: (T, J, 3) joint positions, metres, world; those of the limb at least.
        world: (T, J, 4) world rotations; those of the limb at least.
        joints, target, end_rotation, keep_end_rotation, pole, soft: as for `solve_two_bone`.
        min_bend: one value or (T,), share of the limb's length by which a knee has to be off the line hip-ankle for its
            direction to be trusted.
    Returns:
        The new local rotations (T, 4) by joint, and the miss (T,) in metres.
    """
    bend = _bend_limb(places, world, joints, target, pole=pole, soft=soft, min_bend=min_bend)
    # how much each bone rotates: its new frame (direction, hinge) times the inverse of its old one
    bone_rotations = [
        quaternion.multiply(_build_frame_for_bone(new, bend.hinge),
                            quaternion.inverse(_build_frame_for_bone(old, bend.old_hinge)))
        for new, old in zip((bend.middle - places[:, joints[0]], bend.end - bend.middle), bend.old_bones)
    ]
    new_world = {joint: quaternion.multiply(rotation, world[:, joint])
                 for rotation, high, low in zip(bone_rotations, joints, joints[1:])
                 for joint in (high, *list_between(skeleton.parents, high, low))}
    end = joints[2]
    if end_rotation is not None:
        new_world[end] = end_rotation
    else:
        new_world[end] = world[:, end] if keep_end_rotation else quaternion.multiply(bone_rotations[1], world[:, end])
    local = {joint: _compute_local_rotation(skeleton, new_world, world, joint) for joint in new_world}
    return local, measure_lengths(bend.end - target)


def place_limb(
    places: np.ndarray, world: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, *,
    soft: float | np.ndarray = 0.01,
) -> tuple[np.ndarray, np.ndarray]:
    """Compute where `solve_posed_limb` brings the middle and the end joint, for half of its time.

    Args:
        places, world, joints, target, soft: as for `solve_posed_limb`.
    Returns:
        Positions of the middle and of the end joint, (T, 3) m each, world.
    """
    bend = _bend_limb(places, world, joints, target, pole=None, soft=soft, min_bend=MIN_BEND)
    return bend.middle, bend.end


@dataclass(frozen=True, eq=False)
class _Bend:
    """How a limb bends to reach a target.

    Attributes:
        middle, end: (T, 3) m, positions of the joints, world.
        hinge: (T, 3) unit axis about which the middle joint bends.
        old_bones: (T, 3) m, upper and lower bone before.
        old_hinge: (T, 3) unit axis before.
    """

    middle: np.ndarray
    end: np.ndarray
    hinge: np.ndarray
    old_bones: tuple[np.ndarray, np.ndarray]
    old_hinge: np.ndarray


def _bend_limb(places: np.ndarray, world: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, *, pole, soft,
               min_bend) -> _Bend:
    """Bend a limb so that its end reaches a target; arguments as for `solve_posed_limb`."""
    # vectors lie in memory by component, as those of a pose do: rows of three take twice as long
    target = np.asarray(target, dtype=float, order="F")
    top, knee, ankle = (places[:, joint] for joint in joints)
    bones = knee - top, ankle - knee
    lengths = (measure_lengths(bones[0]), measure_lengths(bones[1]))
    line = unit_vectors(ankle - top, np.array([0.0, 0.0, -1.0]))
    old_pole = _estimate_pole(line, bones[0], lengths[0] + lengths[1], world[:, joints[0]], min_bend)
    swing = quaternion.rotation_between(ankle - top, target - top)
    new_pole = np.asarray(quaternion.rotate(swing, old_pole) if pole is None else pole, dtype=float, order="F")
    middle, end, hinge = solve_limb_bend(top, target, *lengths, new_pole, soft)
    return _Bend(middle, end, np.asarray(hinge, order="F"), bones,
                 np.asarray(cross_product(line, old_pole), order="F"))


def _normalize_across(v: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Normalize vectors (..., 3); where they have no length take any unit vector square to `direction` (..., 3)."""
    length = measure_lengths(v)[..., None]
    return v / length if np.all(length > 1e-9) else unit_vectors(v, _find_normal(direction))


def _find_normal(direction: np.ndarray) -> np.ndarray:
    other = np.where(np.abs(direction[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    normal = other - dot_products(other, direction)[..., None] * direction
    return normal / measure_lengths(normal)[..., None]


def _check_chain(skeleton: Skeleton, joints: tuple[int, int, int]) -> None:
    """Check that each of the joints hangs below the one before (InputError)."""
    upper, middle, end = joints
    for high, low in ((upper, middle), (middle, end)):
        if high == low or high not in list_ancestors(skeleton.parents, low):
            raise InputError("limb", f"{skeleton.names[low]} does not hang below {skeleton.names[high]}", "a chain")


def _compute_local_rotation(skeleton: Skeleton, new_world: Mapping[int, np.ndarray], world: np.ndarray,
                            joint: int) -> np.ndarray:
    """Compute the local rotation (T, 4) of a joint from new world rotations (T, 4) of some, and `world` (T, J, 4) of
    the others.
    """
    parent = skeleton.parents[joint]
    if parent < 0:
        return new_world[joint]
    above = new_world[parent] if parent in new_world else world[:, parent]
    return quaternion.multiply(quaternion.inverse(above), new_world[joint])


def _build_frame_for_bone(direction: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """Build the frame of a bone of any length (..., 3)."""
    return build_bone_frame(unit_vectors(direction, np.array([0.0, 0.0, -1.0])), hinge)


def _estimate_pole(
    line: np.ndarray, bone: np.ndarray, length: np.ndarray, upper_world: np.ndarray, min_bend: float | np.ndarray
) -> np.ndarray:
    """Estimate the direction (T, 3) in which the middle joint points in the given pose, unit, square to the line from
    the first to the last joint, which are (T, 3) unit vectors; bone: (T, 3) m, the upper one; length: (T,) m of both.

    A nearly straight limb shows little. There the direction is mixed with the mean one of all frames, carried by the
    upper bone (a knee is a hinge), weighted by how clearly each frame shows it.
    """
    off = bone - dot_products(bone, line)[..., None] * line
    bent = (measure_lengths(off) / np.maximum(length, 1e-9))[:, None]
    in_bone = quaternion.rotate(quaternion.inverse(upper_world), off)
    mean = np.sum(in_bone * bent, axis=0)
    if np.linalg.norm(mean) < 1e-9:
        across = unit_vectors(np.array([1.0, 0.0, 0.0]) - line[..., :1] * line, np.array([0.0, 0.0, 1.0]))
        return unit_vectors(off, across)
    steady = np.asarray(quaternion.rotate(upper_world, mean / np.linalg.norm(mean)), order="F")
    steady = unit_vectors(steady - dot_products(steady, line)[..., None] * line, off)
    # a frame that bends the other way, as blended poses may, gets no weight: its knee would flip
    shown = unit_vectors(off, steady)
    agreement = dot_products(shown, steady)[..., None]
    weight = np.clip(bent / np.reshape(min_bend, (-1, 1)), 0.0, 1.0) ** 2 * np.clip(2.0 * agreement, 0.0, 1.0)
    mixed = weight * shown + (1.0 - weight) * steady
    return unit_vectors(mixed, steady)
