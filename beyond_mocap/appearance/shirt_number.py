"""A flat drawing on the back or chest of a body's shirt that follows the cloth, such as a shirt number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..base.vectors import cross_on_ground
from ..motion.motion import Motion
from ..motion.retargeting.neutral import build_neutral_stance
from ..motion.skeleton import Skeleton, freeze_array
from .mesh import SHIRT, BodyMesh, deform_body

_ABOVE = 0.004  # metres of the drawing above the cloth: more than coarse rings dip while they bend
_MIDDLE = {"back": 0.70, "chest": 0.74}  # height of the drawing's middle as a share of the shirt's height from its hem


@dataclass(frozen=True, eq=False)
class ShirtDecal:
    """Points on a shirt, in the skeleton's rest pose.

    Attributes:
        vertices: (N, 3) m.
        joints: (N, 6) int, the joints that each point follows.
        weights: (N, 6), sum 1.
    """

    vertices: np.ndarray
    joints: np.ndarray
    weights: np.ndarray


def place_on_shirt(
    body: BodyMesh, skeleton: Skeleton, points: np.ndarray, side: str = "back", example: Motion | None = None
) -> ShirtDecal:
    """Place the points of a drawing on a shirt.

    Each point takes position and weights of the triangle of cloth behind it, so it stays on the shirt in every pose.
    Points outside the shirt are moved to its edge.

    Args:
        body: the mesh, built with the same `example`.
        skeleton: its skeleton.
        points: (N, 2) m to the right and up from the drawing's middle, as seen by a viewer in front of that side.
        side: "back" or "chest".
        example: any recording on the skeleton, or None.
    Returns:
        The points in the skeleton's rest pose.
    Raises:
        InputError: if the body has no shirt.
    """
    neutral = build_neutral_stance(skeleton, example)
    standing = deform_body(body, skeleton, neutral.positions, neutral.rotations)
    outward = 1.0 if side == "chest" else -1.0
    triangles = _find_cloth(body, standing, outward)
    if not len(triangles):
        raise InputError("body", "it has no shirt", "a body with a shirt", "build it with build_body")
    low, high = np.min(standing[triangles][..., 2]), np.max(standing[triangles][..., 2])
    across = outward * np.asarray(points)[:, 0] + np.mean(standing[triangles][..., 1])
    up = np.asarray(points)[:, 1] + low + _MIDDLE[side] * (high - low)
    triangle_index, share = _find_triangles(standing[triangles][..., 1:], np.column_stack([across, up]))
    corners = triangles[triangle_index]
    at_rest = np.einsum("nk,nkc->nc", share, body.vertices[corners])
    edges = body.vertices[corners[:, 1:]] - body.vertices[corners[:, :1]]
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    weights = (share[:, :, None] * body.weights[corners]).reshape(len(corners), -1)
    joints = body.joints[corners].reshape(len(corners), -1)
    return ShirtDecal(freeze_array(at_rest + _ABOVE * normal), freeze_array(joints, int), freeze_array(weights))


def _find_cloth(body: BodyMesh, standing: np.ndarray, outward: float) -> np.ndarray:
    """Find the triangles (K, 3) of the trunk's shirt that face `outward` along X.

    standing: (V, 3) m, the vertices in the neutral stance.
    """
    faces = [face for face, material in zip(body.faces, body.material) if material == SHIRT]
    split = [(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)]
    triangles = np.array(split, dtype=int).reshape(-1, 3)
    edges = standing[triangles[:, 1:]] - standing[triangles[:, :1]]
    normal = np.cross(edges[:, 0], edges[:, 1])
    size = np.linalg.norm(normal, axis=1)
    middle = np.abs(standing[triangles][..., 1]).max(axis=1) < 0.1  # near the middle plane: not a sleeve
    trunk = np.isin(body.joints[triangles[:, 0], 0], np.unique(body.joints[triangles[middle], 0]))
    return triangles[trunk & (outward * normal[:, 0] > 0.2 * size) & (size > 1e-9)]


def _find_triangles(flat: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find for points (N, 2) the triangle of (K, 3, 2) that contains each or is nearest, and barycentric weights (N,
    3)."""
    origin, first, second = flat[:, 0], flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = cross_on_ground(first, second)
    offset = points[:, None] - origin
    b = cross_on_ground(offset, second) / area
    c = cross_on_ground(first, offset) / area
    shares = np.stack([1.0 - b - c, b, c], axis=-1)
    chosen = np.argmax(shares.min(axis=-1), axis=1)
    share = np.clip(shares[np.arange(len(points)), chosen], 0.0, None)
    return chosen, share / share.sum(axis=1, keepdims=True)
