"""The trunk of the body that is shown, as elliptic sections that follow the spine, and how deep points are inside it.

The sections are those of the sculpted athlete (`template`), fitted to a skeleton as its skin is (`fit`, `body`): the
girths follow the stature, the heights the distance from hips to shoulders, and each section follows the same two joints
of the spine as the skin does there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.vectors import dot_products, measure_lengths
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.retargeting.adult import ADULT_LEG
from ..motion.retargeting.neutral import NeutralStance
from .body import find_spine_joints
from .landmarks import HIPS, SHOULDERS

SECTIONS = ((-0.12, 0.185, 0.148), (0.02, 0.187, 0.145), (0.25, 0.170, 0.123), (0.40, 0.168, 0.118),
            (0.60, 0.196, 0.128), (0.85, 0.205, 0.135), (1.00, 0.130, 0.100))
"""Height as a share from hip joints to shoulder joints, half breadth and half depth in m, at a stature of 1.80 m."""

_OVERLAP = 0.25  # share of a part's height by which it reaches into the next: where the trunk bends, gaps would open
_NEAR = 0.09  # m around the trunk within which depths are measured: more than a spine bends from a straight line


@dataclass(frozen=True, eq=False, kw_only=True)
class Trunk:
    """K elliptic sections of a trunk, from below.

    Attributes:
        joints: (K, 2) joints of the spine that a section follows.
        shares: (K, 2) by how much.
        middles: (K, 2, 3) m, its middle in each joint's frame.
        axes: (K, 2, 2, 3) m, its half axes to the left and ahead, in each joint's frame.
        scale: the stature relative to 1.80 m.
    """

    joints: np.ndarray
    shares: np.ndarray
    middles: np.ndarray
    axes: np.ndarray
    scale: float


def build_trunk(stance: NeutralStance) -> Trunk:
    """Build the trunk of a skeleton's body.

    Args:
        stance: its neutral stance.
    Returns:
        The trunk.
    """
    body, places = identify_joints(stance.skeleton), stance.positions
    scale = stance.leg / ADULT_LEG
    hips = 0.5 * (places[body.left.upper_leg] + places[body.right.upper_leg])
    arms = [limb.upper_arm for limb in (body.left, body.right)]
    shoulders = (hips + scale * (SHOULDERS - HIPS) if None in arms
                 else 0.5 * (places[arms[0]] + places[arms[1]]))
    height, breadth, depth = np.array(SECTIONS).T
    middles = hips + height[:, None] * (shoulders - hips)
    low, high, upper = find_spine_joints(stance, body, middles[:, 2])
    joints = np.stack([low, high], axis=1)
    back = quaternion.inverse(stance.rotations[joints])
    zero = np.zeros_like(breadth)
    axes = scale * np.stack([np.stack([zero, breadth, zero], axis=1), np.stack([depth, zero, zero], axis=1)], axis=1)
    return Trunk(joints=joints, shares=np.stack([1.0 - upper, upper], axis=1),
                 middles=quaternion.rotate(back, middles[:, None] - places[joints]),
                 axes=quaternion.rotate(back[:, :, None], axes[:, None]), scale=scale)


@dataclass(frozen=True, eq=False, kw_only=True)
class PosedTrunk:
    """A trunk in T poses.

    Attributes:
        middles: (K, T, 3) m, world.
        axes: (2, K, T, 3) m, half axes to the left and ahead, world.
    """

    middles: np.ndarray
    axes: np.ndarray


def pose_trunk(trunk: Trunk, positions: np.ndarray, rotations: np.ndarray) -> PosedTrunk:
    """Pose a trunk.

    Args:
        trunk: K sections.
        positions: (T, J, 3) m, the skeleton's joints, world; those of the spine at least.
        rotations: (T, J, 4), the same.
    Returns:
        The posed trunk.
    """
    many, count = len(trunk.joints), len(positions)
    # by component in memory, as poses are: rows of three take twice as long
    found = np.moveaxis(np.zeros((many, 3, 3, count)), 2, 3)  # of each section its middle and both axes
    for joint in np.unique(trunk.joints):
        turn = np.moveaxis(quaternion.to_matrix(rotations[:, joint]), 0, 2).copy()  # (3, 3, T)
        for k, side in np.argwhere((trunk.joints == joint) & (trunk.shares > 0.0)):
            share = trunk.shares[k, side]
            for row, vector in zip(found[k], (trunk.middles[k, side], *trunk.axes[k, side])):
                for component, weight in enumerate(share * vector):
                    row += weight * turn[:, component].T
            found[k, 0] += share * positions[:, joint]
    return PosedTrunk(middles=found[:, 0], axes=np.moveaxis(found[:, 1:], 1, 0))


def measure_depth(trunk: PosedTrunk, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure how deep points are inside a trunk, along the shortest way out across it, to first order.

    Args:
        trunk: in T poses.
        points: (P, T, 3) m, world.
    Returns:
        (P, T) m, negative outside, minus infinity above and below the trunk and far from it; and the ways out
        (P, T, 3), unit, 0 there.
    """
    deepest, ways = np.full(points.shape[:2], -np.inf), np.zeros(points.shape)
    at, frame = np.nonzero(_find_near(trunk, points))
    near, best, way = points[at, frame], np.full(len(at), -np.inf), np.zeros((len(at), 3))
    last = len(trunk.middles) - 2
    for low in range(last + 1):
        start = trunk.middles[low, frame]
        line, offset = trunk.middles[low + 1, frame] - start, near - start
        share = dot_products(offset, line) / dot_products(line, line)
        least, most = -_OVERLAP if low else 0.0, 1.0 + _OVERLAP if low < last else 1.0
        beside = np.flatnonzero((share >= least) & (share <= most))
        offset = offset[beside] - share[beside, None] * line[beside]
        depth, out = _measure_ellipse_depth(trunk, low, np.clip(share[beside], 0.0, 1.0), offset, frame[beside])
        deeper = depth > best[beside]  # where the trunk bends, a point may lie beside two parts of it
        best[beside[deeper]], way[beside[deeper]] = depth[deeper], out[deeper]
    deepest[at, frame], ways[at, frame] = best, way
    return deepest, ways


def _find_near(trunk: PosedTrunk, points: np.ndarray) -> np.ndarray:
    """Find which points (P, T, 3) m are near a trunk: (P, T) bool, within a wider ellipse along its whole length."""
    foot, axes = trunk.middles[0], trunk.axes[:, len(trunk.middles) // 2]
    chord, offset = trunk.middles[-1] - foot, points - foot
    share = np.clip(dot_products(offset, chord) / dot_products(chord, chord), 0.0, 1.0)
    offset = offset - share[..., None] * chord
    ratio = np.zeros(share.shape)
    for axis in axes:
        length = measure_lengths(axis)
        ratio += (dot_products(offset, axis) / (length * (length + _NEAR))) ** 2
    return ratio < 1.0


def _measure_ellipse_depth(trunk: PosedTrunk, low: int, share: np.ndarray, offset: np.ndarray,
                           frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure how deep N points are inside the ellipses between section `low` and the next.

    Args:
        trunk: in T poses.
        low: the lower section.
        share: (N,) of the way to the next one.
        offset: (N, 3) m from the middle there, world.
        frame: (N,) poses.
    Returns:
        As `measure_depth`: (N,) and (N, 3).
    """
    ratio, slope = np.zeros(len(share)), np.zeros((len(share), 3))
    for axes in trunk.axes:
        start, end = axes[low, frame], axes[low + 1, frame]
        axis = start + share[:, None] * (end - start)
        square = dot_products(axis, axis)
        across = dot_products(offset, axis) / square  # 1 on the skin
        ratio += across * across
        slope += (across / square)[:, None] * axis
    ratio = np.sqrt(ratio)
    slope /= np.maximum(ratio, 1e-6)[:, None]
    steep = np.maximum(measure_lengths(slope), 1e-6)
    return (1.0 - ratio) / steep, slope / steep[:, None]
