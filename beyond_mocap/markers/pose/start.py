"""Estimate an initial pose from the markers of one frame alone: from the root outwards, each joint by its own markers.

The pose only needs to lie near the right minimum; `pose` continues from there. The paper found poses by single segments
too uneven to start every frame from (section 5.3.3); here they start some frames, and the others start from solved
neighbours.
"""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from .chain import CONJUGATE, Chain, Poses, limit_angles, multiply, read_angles, to_matrices

# weight of the next joint's markers relative to a joint's own; again this factor for each joint below
_BELOW_FACTOR = 0.01
_UNTURNED = np.array([[1.0], [0.0], [0.0], [0.0]])
_PARENT_WEIGHT = 4e-4  # m2, weight of the parent's direction, for angles that markers do not determine


def estimate_initial_poses(chain: Chain, seen: np.ndarray, weights: np.ndarray) -> Poses:
    """Estimate poses of frames, each from its own markers.

    Args:
        chain: the chain.
        seen: (M, 3, F) metres, any numbers where the weight is 0.
        weights: (M, F).
    Returns:
        F poses; what markers leave undetermined is as in the rest pose.
    """
    skeleton, frames = chain.skeleton, weights.shape[-1]
    rest, distance = _place_at_rest(chain)
    local = np.zeros((len(skeleton), 4, frames))
    local[:, 0] = 1.0
    angles = np.zeros((len(skeleton), 3, frames))
    # markers have less weight the more joints they lie below
    share = weights * _BELOW_FACTOR ** distance[0][:, None]
    world = [_fit_whole_body(rest, seen, share)]
    centres = _compute_mean(rest, share), _compute_mean(seen, share)
    root = centres[1] - np.einsum("abf,bf->af", to_matrices(world[0]), centres[0])
    local[0], joints = world[0], [root]
    for joint in range(1, len(skeleton)):
        parent = skeleton.parents[joint]
        joints.append(joints[parent] + np.einsum("abf,b->af", to_matrices(world[parent]), skeleton.offsets[joint]))
        near = np.flatnonzero(np.isfinite(distance[joint]))
        share = weights[near] * _BELOW_FACTOR ** distance[joint][near][:, None]
        arms = rest[near] - chain.skeleton.rest_positions[joint]
        prior = multiply(world[parent], _UNTURNED)  # of unit length again
        world.append(_fit_joint(arms, seen[near] - joints[joint], share, prior))
        local[joint] = multiply(world[parent] * CONJUGATE, world[joint])
        if not chain.is_fully_free[joint]:
            angles[joint] = limit_angles(chain, joint, read_angles(chain, joint, local[joint]))
            local[joint] = quaternion.from_euler(angles[joint].T, chain.order[joint]).T
            world[joint] = multiply(world[parent], local[joint])
    return Poses(root, local, angles)


def _place_at_rest(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Return the markers in the rest pose (M, 3) metres, and how many joints (J, M) they lie below each joint, else
    inf.
    """
    distance = np.full((len(chain.skeleton), len(chain.joint)), np.inf)
    for marker, joint in enumerate(chain.joint):
        steps = 0
        while joint >= 0:
            distance[joint, marker] = steps
            joint, steps = chain.skeleton.parents[joint], steps + 1
    return chain.skeleton.rest_positions[chain.joint] + chain.places, distance


def _compute_mean(points: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Compute the weighted mean (3, F) of points (M, 3) or (M, 3, F) by shares (M, F)."""
    points = points[..., None] if points.ndim == 2 else points
    return (share[:, None] * points).sum(axis=0) / np.maximum(share.sum(axis=0), 1e-12)


def _fit_whole_body(rest: np.ndarray, seen: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Fit the rotations (4, F) of the resting markers (M, 3) about their mean to the recorded ones (M, 3, F)."""
    arms = rest[..., None] - _compute_mean(rest, share)
    return _find_best_rotations(np.einsum("mf,maf,mbf->abf", share, seen - _compute_mean(seen, share), arms))


def _fit_joint(arms: np.ndarray, seen: np.ndarray, share: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Fit the rotations (4, F) about a joint of arms (N, 3) to recorded ones (N, 3, F), with a pull to `prior`
    (4, F).
    """
    return _find_best_rotations(np.einsum("mf,maf,mb->abf", share, seen, arms) + _PARENT_WEIGHT * to_matrices(prior))


def _find_best_rotations(profile: np.ndarray) -> np.ndarray:
    """Find the rotations (4, F) with the largest sum of products with these matrices (3, 3, F).

    Davenport's q-method: the dominant eigenvector of a symmetric 4x4 matrix, which cannot be a reflection.
    """
    b = np.moveaxis(profile, -1, 0)
    k = np.empty((len(b), 4, 4))
    trace = np.trace(b, axis1=1, axis2=2)
    k[:, 0, 0] = trace
    k[:, 0, 1:] = np.stack([b[:, 2, 1] - b[:, 1, 2], b[:, 0, 2] - b[:, 2, 0], b[:, 1, 0] - b[:, 0, 1]], axis=-1)
    k[:, 1:, 0] = k[:, 0, 1:]
    k[:, 1:, 1:] = b + np.swapaxes(b, 1, 2) - trace[:, None, None] * np.eye(3)
    return np.ascontiguousarray(np.linalg.eigh(k)[1][:, :, -1].T)
