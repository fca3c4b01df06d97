"""A skinned mesh, its materials, and how it bends: the volume-preserving blend that Blender calls Preserve Volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion import quaternion
from ..motion.skeleton import Skeleton

MATERIALS = ("skin", "shirt", "shorts", "socks", "boots", "hair", "trim", "soles", "eyes", "pupils", "gloves")
"""Materials of a body; "trim" are collar and edges of the kit."""

SKIN, SHIRT, SHORTS, SOCKS, BOOTS, HAIR, TRIM, SOLES, EYES, PUPILS, GLOVES = range(len(MATERIALS))


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """A mesh with skin weights, in the skeleton's rest pose (no joint rotated, root at the origin).

    Attributes:
        vertices: (V, 3) m, Z up.
        faces: tuples of 3 or 4 vertex indices, counterclockwise from outside.
        joints: (V, K) int, the joints that a vertex follows, the one with the largest weight first.
        weights: (V, K) their weights, which sum to 1; those after the first may be 0.
        material: (F,) int, index into MATERIALS per face.
        sculpted: (V, 3) m, where each vertex is on the sculpted athlete, by which materials are painted; None for the
            measured boots.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    joints: np.ndarray
    weights: np.ndarray
    material: np.ndarray
    sculpted: np.ndarray | None = None


def deform_body(body: BodyMesh, skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Deform the body like Blender's armature modifier with Preserve Volume.

    Args:
        body: the mesh, V vertices.
        skeleton: its skeleton, J joints.
        positions: (..., J, 3) m, the joints' positions, world frame.
        rotations: (..., J, 4) quaternions, the joints' rotations, world frame.
    Returns:
        (..., V, 3) m, world frame.
    """
    turn, shift = blend_joints(skeleton.rest_positions, (positions, rotations), body.joints, body.weights)
    return quaternion.rotate(turn, body.vertices) + shift


def blend_joints(rest: np.ndarray, pose: tuple[np.ndarray, np.ndarray], joints: np.ndarray,
                 weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Blend the moves of joints to one rigid move for each vertex, by dual quaternions.

    Source: Kavan, Collins, Zara, O'Sullivan 2007, "Skinning with dual quaternions".

    Args:
        rest: (J, 3) m, the joints in the rest pose.
        pose: the joints' positions (..., J, 3) m and rotations (..., J, 4).
        joints, weights: (V, K) as in `BodyMesh`.
    Returns:
        Rotations (..., V, 4) and shifts (..., V, 3) m, to be added after rotating.
    """
    positions, rotations = pose
    shift = positions - quaternion.rotate(rotations, rest)
    dual = 0.5 * quaternion.multiply(np.concatenate([np.zeros_like(shift[..., :1]), shift], axis=-1), rotations)
    pivot = rotations[..., joints[:, 0], :]
    real = weights[:, :1] * pivot
    other = weights[:, :1] * dual[..., joints[:, 0], :]
    for column in range(1, joints.shape[1]):
        used = np.flatnonzero(weights[:, column])
        joint = joints[used, column]
        alike = np.sum(rotations[..., joint, :] * pivot[..., used, :], axis=-1, keepdims=True)
        share = weights[used, column, None] * np.where(alike < 0.0, -1.0, 1.0)
        real[..., used, :] += share * rotations[..., joint, :]
        other[..., used, :] += share * dual[..., joint, :]
    length = np.linalg.norm(real, axis=-1, keepdims=True)
    turn, other = real / length, other / length
    return turn, 2.0 * quaternion.multiply(other, quaternion.inverse(turn))[..., 1:]
