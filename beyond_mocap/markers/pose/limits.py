"""Exact limits on the angles of a chain's joints (Fredriksson section 5.3.1).

A hinge is stored as angles and cannot leave its limits. A joint that is free about all axes is stored as a quaternion;
its angles are read here (of two triples for the same rotation, the one that exceeds the limits less) and limited after
each step. A step that would exceed a limit is solved again so that it ends at the limit, with the rotation in that
direction fixed; the other directions then find their optimum. At a limit a joint stays fixed as long as the markers
pull beyond it (an active set, as in Bertsekas 1982, projected Newton methods).

Within some degrees of the pole of its axis order, a joint's outer angles are meaningless; only the middle one is
limited there.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import arctan2
from ...motion import quaternion
from .chain import AXES, Chain, Poses, compute_hinge_axes, cross, limit_angles, read_angles
from .elimination import JointTerms

_NEAR_POLE = 0.12  # cosine of the middle angle below which the outer ones are meaningless (7 degrees)
_AT_LIMIT = 1e-7  # radians from a limit within which an angle is at it
_FIXED_CURVATURE = 1e6  # curvature, m2 per radian2, of a rotation that is fixed


def find_limited_joints(chain: Chain) -> dict[str, np.ndarray]:
    """Find the joints that are free about all axes and have limits, by their axis order; the root has none."""
    bound = np.isfinite(chain.low).any(axis=1) | np.isfinite(chain.high).any(axis=1)
    found: dict[str, list[int]] = {}
    for joint in range(1, len(chain.skeleton)):
        if bound[joint] and chain.is_fully_free[joint]:
            found.setdefault(chain.order[joint], []).append(joint)
    return {order: np.array(joints) for order, joints in found.items()}


def apply_limits(chain: Chain, joints: dict[str, np.ndarray], poses: Poses) -> tuple[Poses, np.ndarray]:
    """Limit the angles of these joints.

    Args:
        chain: the chain.
        joints: as `find_limited_joints` returns them.
        poses: F poses.
    Returns:
        The limited poses with the angles of these joints, and the angles (J, 3, F) before.
    """
    local, angles = poses.local.copy(), poses.angles.copy()
    before = angles.copy()
    for order, group in joints.items():
        angles[group] = before[group] = _read_euler_angles(local[group], order)
        outside = (angles[group] > chain.high[group][..., None]) | (angles[group] < chain.low[group][..., None])
        for joint, exceeding in zip(group, outside.any(axis=1)):
            if exceeding.any():
                _limit_joint(chain, joint, np.flatnonzero(exceeding), local=local, angles=angles, before=before)
    return Poses(poses.root, local, angles), before


def _limit_joint(chain, joint, frames, local, angles, before) -> None:
    """Limit one joint in these frames, where it really exceeds its limits, in place."""
    angles_now = read_angles(chain, joint, local[joint][:, frames])
    limited = np.where(_find_valid_angles(angles_now), limit_angles(chain, joint, angles_now), angles_now)
    angles[joint][:, frames] = limited
    before[joint][:, frames] = np.where(_find_valid_angles(angles_now), angles_now, 0.0)
    moves = np.any(limited != angles_now, axis=0)
    local[joint][:, frames[moves]] = quaternion.from_euler(limited[:, moves].T, chain.order[joint]).T


def _read_euler_angles(q: np.ndarray, order: str) -> np.ndarray:
    """Read angles (..., 3, F) radians of rotations (..., 4, F), the middle one within a quarter turn."""
    i, j, k = (AXES[letter] for letter in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    w, v = q[..., 0, :], [q[..., 1 + axis, :] for axis in (i, j, k)]
    # entries of the rotation's matrix, in the order's own axes
    first = 2.0 * (sign * v[1] * v[2] - w * v[0]), 1.0 - 2.0 * (v[0] * v[0] + v[1] * v[1])
    third = 2.0 * (sign * v[0] * v[1] - w * v[2]), 1.0 - 2.0 * (v[1] * v[1] + v[2] * v[2])
    middle = np.arcsin(np.clip(2.0 * (sign * v[0] * v[2] + w * v[1]), -1.0, 1.0))
    return np.stack([arctan2(-first[0], first[1]), middle, arctan2(-third[0], third[1])], axis=-2)


def _find_valid_angles(angles: np.ndarray) -> np.ndarray:
    """Return which angles (3, F) are meaningful: all, but near the pole only the middle one."""
    away = np.abs(np.cos(angles[1])) >= _NEAR_POLE
    return np.stack([away, np.ones_like(away), away])


def hold_at_limits(chain: Chain, joints: dict[str, np.ndarray], poses: Poses, slope: np.ndarray,
                   joint_terms: JointTerms, next_angles: np.ndarray | None = None) -> np.ndarray:
    """Fix the angles that are at a limit and pulled beyond it, and let those that exceeded a limit end at it.

    Args:
        chain: the chain.
        joints: as `find_limited_joints` returns them.
        poses: F poses.
        slope: (J, 3, F), the derivative of half the cost by each joint's rotations.
        joint_terms: the terms of the joints; changed in place.
        next_angles: (J, 3, F) the angles to which a first step led, or None.
    Returns:
        (J, F) bool, joints that are fixed.
    """
    low, high = chain.low[..., None], chain.high[..., None]
    is_fixed = np.zeros(poses.angles.shape, dtype=bool)
    # the nearer limit of each angle; an infinite one counts as beyond any angle (9 rad)
    bound = np.where(poses.angles > 0.5 * (np.maximum(low, -9.0) + np.minimum(high, 9.0)), high, low)
    touching = ((poses.angles >= high - _AT_LIMIT) | (poses.angles <= low + _AT_LIMIT)) & chain.free[..., None]
    if next_angles is not None:
        over, under = next_angles > high, next_angles < low
        is_fixed |= over | under
        bound = np.where(over, high, np.where(under, low, bound))
    limited_joints = [*chain.hinges, *(joint for group in joints.values() for joint in group)]
    for joint in limited_joints:
        if touching[joint].any() or is_fixed[joint].any():
            _hold_joint_at_limits(chain, joint, poses.angles[joint], touching=touching[joint], bound=bound[joint],
                                  slope=slope[joint], is_fixed=is_fixed[joint], joint_terms=joint_terms)
    idle = np.setdiff1d(np.arange(len(is_fixed)), limited_joints)
    is_fixed[idle] = False
    return is_fixed.any(axis=1)


def _hold_joint_at_limits(chain, joint, angles, touching, bound, slope, is_fixed, joint_terms) -> None:
    """Do `hold_at_limits` for one joint: complete `is_fixed` (3, F) and change `joint_terms`, in place."""
    frames = np.flatnonzero((touching | is_fixed).any(axis=0))
    here = angles[:, frames]
    if chain.is_fully_free[joint]:
        basis = compute_hinge_axes(chain, joint, here)
        rates = _invert_axes(basis)
        is_valid = _find_valid_angles(here)
    else:
        basis = rates = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, len(frames)))
        is_valid = np.broadcast_to(chain.free[joint][:, None], here.shape)
    # derivative of the cost by each angle: pulled outwards if it falls beyond the limit
    along = np.einsum("abf,af->bf", basis, slope[:, frames])
    outward = np.where(here >= chain.high[joint][:, None] - _AT_LIMIT, along < 0.0, along > 0.0)
    is_fixed[:, frames] = ((touching[:, frames] & outward) | is_fixed[:, frames]) & is_valid
    # fix an angle by a very stiff term that moves it onto its limit
    strength = np.where(is_fixed[:, frames], _FIXED_CURVATURE, 0.0)
    excess = np.where(is_fixed[:, frames], here - bound[:, frames], 0.0)
    joint_terms.curvature[joint][..., frames] += np.einsum("naf,nbf,nf->abf", rates, rates, strength)
    joint_terms.pull[joint][:, frames] += np.einsum("naf,nf->af", rates, strength * excess)


def move_along_limits(chain: Chain, held: np.ndarray, poses: Poses, rotations: np.ndarray, next_poses: Poses) -> Poses:
    """Move joints that limits fix along their limit, in place.

    Their angles change by the solved rotations; a rotation about a fixed axis would leave the limit.

    Args:
        chain: the chain.
        held: (J, F) bool, joints that are fixed.
        poses: F poses before the step.
        rotations: (J, 3, F) radians, the solved rotations.
        next_poses: F poses after the step; changed in place.
    Returns:
        The poses after the step.
    """
    for joint in np.flatnonzero(held.any(axis=1)):
        if chain.is_fully_free[joint]:
            frames = np.flatnonzero(held[joint])
            angles = poses.angles[joint][:, frames]
            rates = _invert_axes(compute_hinge_axes(chain, joint, angles))
            limited_angles = angles + np.einsum("naf,af->nf", rates, rotations[joint][:, frames])
            next_poses.local[joint][:, frames] = quaternion.from_euler(limited_angles.T, chain.order[joint]).T
    return next_poses


def _invert_axes(basis: np.ndarray) -> np.ndarray:
    """Invert the axes (3 components, 3, F): how each angle grows with a rotation, (3 angles, 3 components, F)."""
    columns = basis[:, 0], basis[:, 1], basis[:, 2]
    # inverse of a 3x3 matrix by cross products of its columns, over their determinant
    rows = np.stack([cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])])
    size = np.einsum("af,af->f", columns[0], rows[0])
    return rows / np.where(np.abs(size) < 1e-3, np.copysign(1e-3, size), size)
