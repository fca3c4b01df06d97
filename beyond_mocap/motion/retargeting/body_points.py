"""Points of a body's surface that touch something: the soles of the feet, and what meets a ball.

Points are stored by joint, in the joint's own axes, so that a pose carries them. A character's own mesh gives them
exactly; a skeleton alone has a sole of usual proportions, known from how its feet lie flat (`anatomy`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .. import quaternion
from ..humanoid import Limb
from .anatomy import Anatomy

Points = Mapping[int, np.ndarray]
"""Joint -> points (P, 3) m in its own axes."""

# shares of the distance from ankle to toe joint: the heel behind the ankle, the sole's end ahead of the toe joint
_HEEL, _TIP = 0.35, 0.35


def build_sole_points(anatomy: Anatomy, limb: Limb) -> dict[int, np.ndarray]:
    """Build the points on which a foot of usual proportions stands: its heel, its ball and its tip.

    Args:
        anatomy: of the skeleton.
        limb: the side.
    Returns:
        Joint -> points (P, 3) m in its own axes.
    """
    toe = anatomy.skeleton.offsets[limb.toe] if limb.toe is not None else anatomy.skeleton.tip_offset(limb.foot)
    length = float(np.hypot(*_to_segment(anatomy, limb.foot, toe)[:2])) or 0.15
    heel = [-_HEEL * length, 0.0, -anatomy.ankle]
    if limb.toe is None or limb.toe not in anatomy.known_joints:
        ends = [heel, [length, 0.0, -anatomy.ankle]]
        return {limb.foot: quaternion.rotate(anatomy.axes[limb.foot], np.array(ends))}
    front = np.array([[0.0, 0.0, -anatomy.ball], [_TIP * length, 0.0, -anatomy.ball]])
    return {limb.foot: quaternion.rotate(anatomy.axes[limb.foot], np.array([heel])),
            limb.toe: quaternion.rotate(anatomy.axes[limb.toe], front)}


def _to_segment(anatomy: Anatomy, joint: int, vector: np.ndarray) -> np.ndarray:
    """Express a vector (3,) of a joint's axes in the segment's forward, left and up directions."""
    return quaternion.rotate(quaternion.inverse(anatomy.axes[joint]), vector)


def place_points(points: Points, places: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Place points in the world.

    Args:
        points: the points, at least one.
        places: (T, J, 3) joint positions, metres, world.
        world: (T, J, 4) world rotations.
    Returns:
        (T, P, 3) m, world, joint by joint.
    """
    return np.concatenate([places[:, joint, None] + quaternion.rotate(world[:, joint, None], own[None])
                           for joint, own in points.items()], axis=1)


def measure_sole_heights(points: Points, places: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Measure the height (T,) m of the lowest of some points; arguments as for `place_points`."""
    heights = [places[:, joint, None, 2] + quaternion.to_matrix(world[:, joint])[:, 2] @ own.T
               for joint, own in points.items()]
    return np.concatenate(heights, axis=1).min(axis=1)
