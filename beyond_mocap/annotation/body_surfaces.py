"""The whole body as simple solids, and how far a ball is from it: what a ball must not lie inside.

    surfaces = build_body_surfaces(skeleton)
    gaps = BodySolid.from_pose(surfaces, positions, rotations).measure_gaps(balls, frames)

Feet, head and hands are the surfaces that strike the ball (`striking`), so a ball that touches one of them lies
outside of the body. Legs, arms and trunk are capsules around their bones, as thick as the drawn body
(`appearance.body`) without its clothes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..motion.humanoid import Humanoid, Limb, identify_joints
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS
from .striking import Surface, build_part_surfaces

SHIN_RADIUS, TIP_RADIUS = 0.05, 0.0
"""Metres around the lines of a shin and of the toes' tip."""

THIGH_RADIUS, PELVIS_RADIUS, TRUNK_RADIUS, SHOULDER_RADIUS, NECK_RADIUS = 0.075, 0.10, 0.115, 0.07, 0.055
UPPER_ARM_RADIUS, FOREARM_RADIUS = 0.045, 0.04
_ORIGIN = np.zeros(3)
_ORIGIN.setflags(write=False)


def build_leg_surfaces(skeleton: Skeleton) -> tuple[Surface, ...]:
    """Build what a ball on the ground can lie inside: both feet, then shin and toes' tip of the left and right leg.

    Args:
        skeleton: the skeleton, J joints.
    """
    surfaces = [*build_part_surfaces(skeleton, "foot")]
    for side, limb in _list_limbs(identify_joints(skeleton)):
        toe = limb.toe_or_foot
        tip = (toe, skeleton.tip_offset(toe))
        surfaces.append(_build_bone("shin", side, SHIN_RADIUS, limb.lower_leg, limb.foot))
        surfaces.append(Surface("tip", side, TIP_RADIUS, (toe, _ORIGIN), tip))
    return tuple(surfaces)


def build_body_surfaces(skeleton: Skeleton) -> tuple[Surface, ...]:
    """Build all solids of a body: the legs' (`build_leg_surfaces`), thighs, trunk, head, arms and hands.

    Args:
        skeleton: the skeleton, J joints; what it lacks is left out.
    """
    body, surfaces = identify_joints(skeleton), [*build_leg_surfaces(skeleton)]
    surfaces.append(_build_bone("pelvis", "", PELVIS_RADIUS, body.left.upper_leg, body.right.upper_leg))
    surfaces.append(_build_bone("trunk", "", TRUNK_RADIUS, body.hips, body.chest))
    surfaces += [*build_part_surfaces(skeleton, "head"), *build_part_surfaces(skeleton, "hand")]
    if body.head is not None:
        surfaces.append(_build_bone("neck", "", NECK_RADIUS, body.chest, body.head))
    if None not in (body.left.upper_arm, body.right.upper_arm):
        shoulders = body.left.upper_arm, body.right.upper_arm
        surfaces.append(_build_bone("shoulders", "", SHOULDER_RADIUS, *shoulders))
    for side, limb in _list_limbs(body):
        surfaces.append(_build_bone("thigh", side, THIGH_RADIUS, limb.upper_leg, limb.lower_leg))
        if None not in (limb.upper_arm, limb.lower_arm, limb.hand):
            surfaces.append(_build_bone("upper arm", side, UPPER_ARM_RADIUS, limb.upper_arm, limb.lower_arm))
            surfaces.append(_build_bone("forearm", side, FOREARM_RADIUS, limb.lower_arm, limb.hand))
    return tuple(surfaces)


def _list_limbs(body: Humanoid) -> tuple[tuple[str, Limb], ...]:
    """List both sides with their limbs."""
    return ("left", body.left), ("right", body.right)


def _build_bone(part: str, side: str, radius: float, start: int, end: int) -> Surface:
    """Build the solid around the line between two joints."""
    return Surface(part, side, radius, (start, _ORIGIN), (end, _ORIGIN))


@dataclass(frozen=True, eq=False)
class BodySolid:
    """S solids of a body over W frames.

    Attributes:
        start, along: (W, S, 3) m, begin and extent of the solids' lines, world frame.
        least: (S,) m, the radius of each solid plus the ball's.
    """

    start: np.ndarray
    along: np.ndarray
    least: np.ndarray

    @classmethod
    def from_pose(cls, surfaces: tuple[Surface, ...], positions: np.ndarray, rotations: np.ndarray) -> BodySolid:
        """Place solids on a posed body.

        Args:
            surfaces: the solids, S of them.
            positions: (W, J, 3) m, world frame.
            rotations: (W, J, 4) quaternions, world frame.
        """
        lines = [surface.compute_line(positions, rotations) for surface in surfaces]
        start = np.stack([line[0] for line in lines], axis=1)
        along = np.stack([line[1] for line in lines], axis=1) - start
        return cls(start, along, np.array([surface.radius for surface in surfaces]) + BALL_RADIUS)

    @cached_property
    def _squared(self) -> np.ndarray:
        """Squared lengths (W, S) m^2 of the solids' lines."""
        return np.maximum(np.sum(self.along**2, axis=-1), 1e-12)

    def measure_gaps(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Measure the gaps between balls and the nearest part of the body.

        Args:
            balls: (N, 3) m, centres, world frame.
            frames: (N,) frame of each.
        Returns:
            (N,) m, negative inside the body.
        """
        return np.min(self.compute_offsets(balls, frames)[1], axis=1)

    def compute_offsets(self, balls: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the vectors (N, S, 3) m from the nearest points of all solids to the balls, and the gaps (N, S) m.

        Args:
            balls: (N, 3) m, centres, world frame.
            frames: (N,) frame of each.
        """
        start, along = self.start[frames], self.along[frames]
        to = balls[:, None] - start
        # nearest point of a line segment: projection, limited to its ends
        share = np.clip(np.einsum("npk,npk->np", to, along) / self._squared[frames], 0.0, 1.0)
        to -= share[..., None] * along
        return to, np.sqrt(np.einsum("npk,npk->np", to, to)) - self.least

    def compute_way_out(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Compute the shortest level move out of the part of the body that each ball is deepest in.

        Args:
            balls: (N, 3) m, centres, world frame.
            frames: (N,) frame of each.
        Returns:
            (N, 2) m; zero outside the body.
        """
        away, gaps = self.compute_offsets(balls, frames)
        rows, part = np.arange(len(balls)), np.argmin(gaps, axis=1)
        offset, level = away[rows, part], np.linalg.norm(away[rows, part, :2], axis=1)
        needed = np.sqrt(np.maximum(self.least[part] ** 2 - offset[:, 2] ** 2, 0.0))
        return offset[:, :2] * (np.maximum(needed - level, 0.0) / np.maximum(level, 1e-6))[:, None]
