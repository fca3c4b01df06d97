"""The surfaces with which a body strikes the ball, and their distance from the ball's surface.

A skeleton has no skin, so parts are simple bodies: the foot a capsule from its ankle to its toe tip, the head a sphere
around the middle from its joint to its tip, the chest, the thighs and the hands spheres. Motion construction
brings these surfaces to the ball; evaluation measures their distance.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.vectors import dot_products, measure_lengths
from ..motion import quaternion
from ..motion.humanoid import Humanoid, Limb, identify_joints
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS

BODY_PARTS = ("foot", "head", "chest", "hand")
SIDED_PARTS = ("foot", "hand", "tool")
"""Parts that strike on the left or the right; a tool is held in a hand."""

# Metres.
FOOT_RADIUS, THIGH_RADIUS, HEAD_RADIUS, CHEST_RADIUS, HAND_RADIUS = 0.05, 0.08, 0.10, 0.12, 0.05
_THIGH_SHARE = 0.6  # of the thigh from hip to knee, where a ball lands on it
JOINT_ORIGIN = np.zeros(3)
JOINT_ORIGIN.setflags(write=False)
"""(3,) m, a joint's own place in its own frame."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A striking surface: all points within `radius` of the line between two points that joints carry.

    Attributes:
        part: "foot", "thigh", "head", "chest" or "hand".
        side: "left", "right" or "" (head, chest).
        radius: m.
        start, end: a joint's index and the point (3,) in metres in that joint's own frame.
    """

    part: str
    side: str
    radius: float
    start: tuple[int, np.ndarray]
    end: tuple[int, np.ndarray]

    def compute_line(self, positions: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute both ends of the surface's line.

        Args:
            positions: (..., J, 3) m, world frame.
            rotations: (..., J, 4) quaternions, world frame.
        Returns:
            Start and end, (..., 3) m each, world frame.
        """
        return tuple(
            positions[..., joint, :] + quaternion.rotate(rotations[..., joint, :], point)
            for joint, point in (self.start, self.end)
        )


def build_part_surfaces(skeleton: Skeleton, part: str, sides: Iterable[str] = ("left", "right")) -> tuple[Surface, ...]:
    """Build the surfaces of a body part.

    Args:
        skeleton: the skeleton, J joints.
        part: a part of `BODY_PARTS`, or "thigh".
        sides: build one foot, thigh or hand for each.
    Returns:
        The surfaces; none if the skeleton lacks the part.
    """
    body = identify_joints(skeleton)
    if part == "foot":
        return tuple(_build_foot(skeleton, side, getattr(body, side)) for side in sides)
    if part == "thigh":
        return tuple(_build_thigh(skeleton, side, getattr(body, side)) for side in sides)
    if part == "hand":
        hands = [(side, getattr(body, side).hand) for side in sides if getattr(body, side).hand is not None]
        lines = [(side, (hand, JOINT_ORIGIN)) for side, hand in hands]
        return tuple(Surface("hand", side, HAND_RADIUS, middle, middle) for side, middle in lines)
    if part == "head" and body.head is not None:
        return (_build_head(skeleton, body),)
    chest = (body.chest, JOINT_ORIGIN)
    return (Surface("chest", "", CHEST_RADIUS, chest, chest),) if part == "chest" else ()


def trace_fastest_surface(surfaces: Sequence[Surface], positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Trace the middle of the surface that moves farthest from the first frame to the last.

    Args:
        surfaces: the surfaces.
        positions: (T, J, 3) m, world frame.
        rotations: (T, J, 4) quaternions, world frame.
    Returns:
        (T, 3) m, world frame.
    """
    middles = [np.mean(surface.compute_line(positions, rotations), axis=0) for surface in surfaces]
    return max(middles, key=lambda trajectory: float(np.linalg.norm(trajectory[-1] - trajectory[0])))


def measure_ball_gap(
    line: tuple[np.ndarray, np.ndarray], radius: float, ball: np.ndarray, ball_radius: float = BALL_RADIUS
) -> np.ndarray:
    """Measure the signed gap between a surface and the ball's, negative where they overlap.

    Args:
        line: the surface's two ends, (..., 3) m each, world frame.
        radius: the surface's radius, m.
        ball: (..., 3) m, the ball's centre, world frame.
        ball_radius: m.
    Returns:
        (...,) m.
    """
    return measure_lengths(ball - find_nearest_point(line, ball)) - radius - ball_radius


def find_nearest_point(line: Sequence[np.ndarray], position: np.ndarray) -> np.ndarray:
    """Find the point of a line segment that is nearest to a position.

    Args:
        line: start and end, (..., 3) m each.
        position: (..., 3) m, in the same frame.
    Returns:
        (..., 3) m.
    """
    start, end = line
    along = end - start
    share = dot_products(position - start, along) / np.maximum(dot_products(along, along), 1e-12)
    return start + np.minimum(np.maximum(share, 0.0), 1.0)[..., None] * along


def measure_smallest_gap(
    surfaces: Sequence[Surface], positions: np.ndarray, rotations: np.ndarray, ball: np.ndarray
) -> np.ndarray:
    """Measure the smallest gap between the ball and some surfaces; see `measure_ball_gap`.

    Args:
        surfaces: the surfaces.
        positions: (..., J, 3) m, world frame.
        rotations: (..., J, 4) quaternions, world frame.
        ball: (..., 3) m, the ball's centre, world frame.
    Returns:
        (...,) m, NaN without a surface.
    """
    gaps = [measure_ball_gap(s.compute_line(positions, rotations), s.radius, ball) for s in surfaces]
    return np.min(gaps, axis=0) if gaps else np.full(np.shape(ball)[:-1], np.nan)


def _build_foot(skeleton: Skeleton, side: str, limb: Limb) -> Surface:
    """Build the foot from the ankle to the toe joint, or to the foot's end site if there is no toe joint."""
    if limb.toe is not None:
        return Surface("foot", side, FOOT_RADIUS, (limb.foot, JOINT_ORIGIN), (limb.toe, JOINT_ORIGIN))
    return Surface("foot", side, FOOT_RADIUS, (limb.foot, JOINT_ORIGIN), (limb.foot, skeleton.tip_offset(limb.foot)))


def _build_thigh(skeleton: Skeleton, side: str, limb: Limb) -> Surface:
    middle = (limb.upper_leg, _THIGH_SHARE * skeleton.offsets[limb.lower_leg])
    return Surface("thigh", side, THIGH_RADIUS, middle, middle)


def _build_head(skeleton: Skeleton, body: Humanoid) -> Surface:
    middle = (body.head, 0.5 * skeleton.tip_offset(body.head))
    return Surface("head", "", HEAD_RADIUS, middle, middle)
