"""Mirroring: left becomes right, so that each recording serves twice (Faustino §3.1.2).

Faustino mirrors joint by joint in the world: a bone points where the mirrored child lies (its X axis, eq. in A), and a
second axis takes the mirrored direction of the body's facing (the Y or Z axis, B). That fits one skeleton whose X axes
all point along the bones. The axes of CMU, LAFAN1 and Bandai-Namco differ from joint to joint and from left to right.
This module uses the same idea without axes: a body segment is rigid, and its mirror image is the partner's segment.

Let M = diag(1, -1, 1) mirror the world, R_p the world rotation of joint j's partner p (itself on the centre line), and
C_j the orthogonal matrix of determinant -1 that takes a point of segment j, in j's axes, to the matching point of
segment p, in p's. Then the mirrored body has, for every joint,

    R'_j = M R_p C_j,     root' = M root,

two improper matrices and a rotation, hence a rotation. C_j follows from the skeleton: it takes the bones that start in
j to those that start in p (orthogonal Procrustes; left and right may differ in length and, by some degrees, in
direction; lengths stay those of the skeleton). One bone leaves the rotation about itself open, so C_j is pulled
slightly towards a preferred matrix D_j. Where the rest pose is its own mirror image (nearly all rigs), D is that mirror
for all joints. Where it is not (Bandai-Namco's limbs have mirrored axes, left bones along +X, right ones along -X), D_j
is a mirror along an axis or the inversion -1: the candidate that carries bones to bones and makes the joint's mean
rotation relative to its parent come out alike left and right. The candidates differ by half turns, far more than left
and right do in any movement.

C_p is the inverse of C_j, so mirroring twice gives back the motion, on any skeleton, to rounding.
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import unit_vector
from . import quaternion
from .humanoid import Humanoid, identify_joints
from .motion import Motion, compute_local_rotations, compute_pose
from .skeleton import Skeleton

_FLIPS = np.stack([np.diag(signs) for signs in ((-1.0, 1, 1), (1.0, -1, 1), (1.0, 1, -1), (-1.0, -1, -1))])
_WORLD_MIRROR = _FLIPS[1]
# weight of D_j against the bones: decides what bones leave open, and moves them by less than 0.01 degrees
_PULL_WEIGHT = 1e-3
_SYMMETRIC = 0.1  # squared misfit of the rest pose with its mirror image, over its bones' squared lengths
_GEOMETRY_WEIGHT = 4.0
_CHANGE_COST = 3.0  # lower cost that another D than the parent's needs to be chosen
_SAMPLED_FRAMES = 256  # frames of a motion that are looked at


def mirror(motion: Motion) -> Motion:
    """Mirror a motion at the plane y = 0: the skeleton does with its left what it did with its right.

    Bones keep their lengths. Where left and right bones differ, feet and hands are off the exact mirror image by that
    difference.

    Args:
        motion: the motion to mirror, world frame, Z up.
    Returns:
        The mirrored motion on the same skeleton at the same rate: X and heights stay, Y changes its sign.
    Raises:
        InputError: if the skeleton has no legs.
    Source: Faustino 2016, section 3.1.2.
    """
    body = identify_joints(motion.skeleton)
    corrections = quaternion.from_matrix(_WORLD_MIRROR @ _solve_correspondence(motion, body))
    _, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    # quaternion form (w, x, y, z) of M R M:
    # M R M keeps the angle; its axis, a pseudovector, keeps its y and turns the others
    mirrored = world[:, list(body.mirror)] * (1.0, -1.0, 1.0, -1.0)
    world = quaternion.multiply(mirrored, corrections)
    local = compute_local_rotations(motion.skeleton, world)
    return Motion(motion.skeleton, motion.root_positions * np.diag(_WORLD_MIRROR), local, motion.fps)


def _solve_correspondence(motion: Motion, body: Humanoid) -> np.ndarray:
    """Solve C_j for all joints: (J, 3, 3), orthogonal, determinant -1."""
    pairs = [_collect_bone_pairs(motion.skeleton, body, joint) for joint in range(len(motion.skeleton))]
    rest = _compute_rest_mirror(motion.skeleton, body)
    bones, images = (np.concatenate(side) for side in zip(*pairs))
    if np.sum((bones @ rest - images) ** 2) <= _SYMMETRIC * np.sum(bones**2):
        chosen = [rest] * len(pairs)
    else:
        chosen = _choose_reflections(motion, body, rest, pairs)
    return np.stack([_fit_reflection(*pair, usual) for pair, usual in zip(pairs, chosen)])


def _compute_rest_mirror(skeleton: Skeleton, body: Humanoid) -> np.ndarray:
    """Return the mirror (3, 3) of the rest pose: the reflection across the line from hip to hip."""
    rest, _ = compute_pose(skeleton, np.zeros(3), quaternion.identity(len(skeleton)))
    across = rest[body.left.upper_leg] - rest[body.right.upper_leg]
    across = unit_vector(across)
    return np.eye(3) - 2.0 * np.outer(across, across)


def _choose_reflections(motion: Motion, body: Humanoid, rest: np.ndarray, pairs) -> list[np.ndarray]:
    """Choose D_j (3, 3) for all joints where the rest pose is not symmetric; `pairs` as from `_collect_bone_pairs`."""
    candidates = np.stack([rest, *_FLIPS])
    frames = np.unique(np.linspace(0, len(motion) - 1, _SAMPLED_FRAMES).astype(int))
    mean = quaternion.to_matrix(motion.rotations[frames]).mean(axis=0)
    chosen: list[np.ndarray] = []
    for joint, partner in enumerate(body.mirror):
        if partner < joint:
            chosen.append(chosen[partner])
            continue
        before = chosen[motion.skeleton.parents[joint]] if joint else None
        chosen.append(_choose_reflection(candidates, pairs[joint], before, mean[joint], mean[partner]))
    return chosen


def _collect_bone_pairs(skeleton: Skeleton, body: Humanoid, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Collect the offsets (B, 3) in metres of the bones that start in `joint`, and of the matching ones of its partner.
    """
    partner = body.mirror[joint]
    pairs = [
        (skeleton.offsets[child], skeleton.offsets[body.mirror[child]])
        for child in skeleton.children(joint)
        if skeleton.parents[body.mirror[child]] == partner
    ]
    tips = [skeleton.end_offsets[[p == j for p in skeleton.end_parents]] for j in (joint, partner)]
    pairs += list(zip(*tips))
    bones = np.array(pairs).reshape(-1, 2, 3)
    return bones[:, 0], bones[:, 1]


def _choose_reflection(candidates, pair, parent_reflection, mean, partner_mean) -> np.ndarray:
    """Choose the D (3, 3) of one joint from the candidates (D, 3, 3).

    In the mirrored body a local rotation is C_parent^-1 L_p C_j, which should look like L_j on average.

    Args:
        candidates: (D, 3, 3) candidate reflections.
        pair: offsets (B, 3) of the joint's bones and of its partner's, metres.
        parent_reflection: (3, 3) the parent's D; None at the root, whose rotation has no parent to be compared with.
        mean: (3, 3) mean local rotation matrix of the joint.
        partner_mean: (3, 3) the same of its partner.
    Returns:
        The candidate of lowest cost: misfit of the bones, of the mean rotations, and of a change against the parent.
    """
    bones, images = pair
    length = max(np.sum(bones**2), 1e-12)
    misfit = np.sum((bones @ candidates.transpose(0, 2, 1) - images) ** 2, axis=(1, 2)) / length
    cost = _GEOMETRY_WEIGHT * misfit
    if parent_reflection is not None:
        cost = cost + np.sum((parent_reflection.T @ partner_mean @ candidates - mean) ** 2, axis=(1, 2))
        cost = cost - _CHANGE_COST * np.all(candidates == parent_reflection, axis=(1, 2))
    return candidates[np.argmin(cost)]


def _fit_reflection(bones: np.ndarray, images: np.ndarray, preferred: np.ndarray) -> np.ndarray:
    """Fit the orthogonal matrix of determinant -1 that carries bones (B, 3) to images (B, 3); `preferred` decides the
    rest.
    """
    # the same scale for a joint and its partner, so that their matrices are inverse to each other
    scale = np.sqrt(np.sum(bones**2) * np.sum(images**2)) or 1.0
    u, _, v = np.linalg.svd(images.T @ bones / scale + _PULL_WEIGHT * preferred)
    return u @ np.diag([1.0, 1.0, -np.linalg.det(u) * np.linalg.det(v)]) @ v
