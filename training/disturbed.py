"""Poses a little beside the truth. In use a network is given what networks said before, never quite the truth; from
poses beside it that lead back to it, networks learn to come back (Holden, Komura and Saito 2017 do so with dropout)."""

from __future__ import annotations

import numpy as np

from beyond_mocap.base.vectors import skew_matrix
from beyond_mocap.throws.networks.chains import Chains
from beyond_mocap.throws.networks.kinematics import Pose, places_and_turns

FACING = 5.0
"""Radians by which a whole body is turned about the upright, for each radian of its joints."""
PLACE = 0.4
"""Metres by which its root is off, for each radian."""


def drawn(chains: Chains, count: int, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints' turns (N, J, 3) rad, the bodies' turns (N,) rad and shifts (N, 3) m: normal, none of joints that ride
    along; `noise`: the joints' standard deviation in radians."""
    rng = np.random.default_rng(seed)
    vectors = np.zeros((count, len(chains.skeleton), 3))
    vectors[:, list(chains.joints)] = noise * rng.normal(size=(count, len(chains.joints), 3))
    return vectors, FACING * noise * rng.normal(size=count), PLACE * noise * rng.normal(size=(count, 3))


def disturbed(chains: Chains, pose: Pose, vectors, facing, shift, xp=np) -> Pose:
    """Poses (B, ...) whose joints are turned by rotation vectors (B, J, 3), and which stand `shift` (B, 3) m beside,
    turned about the upright through the hips by `facing` (B,) radians; how they moved stays."""
    skeleton, hips = chains.skeleton, pose.positions[..., chains.hips, :]
    about = small_turns(facing[..., None] * np.array([0.0, 0.0, 1.0], dtype=pose.root.dtype), xp)
    local = xp.matmul(pose.local, small_turns(vectors, xp))
    local = xp.concatenate([xp.matmul(about, local[..., 0, :, :])[..., None, :, :], local[..., 1:, :, :]], axis=-3)
    root = hips + xp.matmul(about, (pose.root - hips)[..., None])[..., 0] + shift
    positions, turns = places_and_turns(skeleton.offsets.astype(pose.root.dtype), skeleton.parents, root, local, xp)
    return Pose(root, local, positions, turns, pose.moved)


def small_turns(vectors, xp=np):
    """Rotations (..., 3, 3) by rotation vectors (..., 3) in radians (Rodrigues)."""
    angle = xp.sqrt(xp.sum(vectors**2, -1) + 1e-12)[..., None, None]
    skew = skew_matrix(vectors, xp)
    return (
        np.eye(3, dtype=vectors.dtype) + xp.sin(angle) / angle * skew + (1 - xp.cos(angle)) / angle**2 * (skew @ skew)
    )
