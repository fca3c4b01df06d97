"""A moving body as solids: how deep a ball lies in them, gaps between balls and body, and the way out.

    solid = BodySolid.from_pose(build_body_surfaces(skeleton), positions, rotations)
    gaps = solid.measure_gaps(balls, frames)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS
from .body_surfaces import BodySurface, build_body_surfaces
from .striking import JOINT_ORIGIN

_TIP_RADIUS = 0.0  # m: boots are thin there, and a ball that touches the foot may lie above its tip


def build_leg_surfaces(skeleton: Skeleton) -> tuple[BodySurface, ...]:
    """Build what a ball on the ground can lie inside: feet, shanks and the tips of the toes.

    Args:
        skeleton: a humanoid skeleton, J joints.
    """
    low = [surface for surface in build_body_surfaces(skeleton) if surface.part in ("foot", "shank")]
    return *low, *_build_tips(skeleton)


def build_solid_surfaces(skeleton: Skeleton) -> tuple[BodySurface, ...]:
    """Build all that a ball can lie inside: the whole body and the tips of the toes.

    Args:
        skeleton: a humanoid skeleton, J joints.
    """
    return *build_body_surfaces(skeleton), *_build_tips(skeleton)


def _build_tips(skeleton: Skeleton) -> list[BodySurface]:
    """Build the lines from the foremost joint of each foot to its end site."""
    body, tips = identify_joints(skeleton), []
    for side in ("left", "right"):
        toe = getattr(body, side).toe_or_foot
        tips.append(BodySurface(part="foot", side=side, radius=_TIP_RADIUS, start=(toe, JOINT_ORIGIN),
                                end=(toe, skeleton.tip_offset(toe)), end_radius=_TIP_RADIUS))
    return tips


def _place_points(points: Sequence[tuple[int, np.ndarray]], positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Place points that joints carry, each with its joint's index: (W, S, 3) m."""
    joints, offsets = [joint for joint, _ in points], np.array([offset for _, offset in points])
    return positions[:, joints] + quaternion.rotate(rotations[:, joints], offsets)


@dataclass(frozen=True, eq=False)
class BodySolid:
    """S solids of a body over W frames.

    Attributes:
        start, along: (W, S, 3) m, begin and extent of the solids' lines, world frame.
        least, taper: (S,) m, the radius of each solid at its start plus the ball's, and what it changes by to its end.
    """

    start: np.ndarray
    along: np.ndarray
    least: np.ndarray
    taper: np.ndarray

    @classmethod
    def from_pose(cls, surfaces: Sequence[BodySurface], positions: np.ndarray, rotations: np.ndarray) -> BodySolid:
        """Place solids on a posed body.

        Args:
            surfaces: the solids, S of them.
            positions: (W, J, 3) m, world frame.
            rotations: (W, J, 4) quaternions, world frame.
        """
        start, end = (_place_points([getattr(surface, name) for surface in surfaces], positions, rotations)
                      for name in ("start", "end"))
        radius = np.array([surface.radius for surface in surfaces])
        end_radius = np.array([surface.end_radius for surface in surfaces])
        return cls(start, end - start, radius + BALL_RADIUS, end_radius - radius)

    @cached_property
    def _line_squares(self) -> np.ndarray:
        """Squared lengths (W, S) m^2 of the solids' lines."""
        return np.maximum(np.sum(self.along**2, axis=-1), 1e-12)

    def measure_depths(self, balls: np.ndarray, frames: np.ndarray | None = None) -> np.ndarray:
        """Measure how deep balls lie in each solid.

        Args:
            balls: (N, 3) m, centres, world frame.
            frames: (N,) frame of each; None: one ball for each frame.
        Returns:
            (N, S) m, negative where they are apart, NaN without a ball.
        """
        away, least = self._compute_offsets(balls, np.arange(len(balls)) if frames is None else frames)
        return least - np.sqrt(np.einsum("npk,npk->np", away, away))

    def measure_gaps(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Measure the gaps between balls and the nearest part of the body.

        Args:
            balls: (N, 3) m, centres, world frame.
            frames: (N,) frame of each.
        Returns:
            (N,) m, negative inside the body.
        """
        return -np.max(self.measure_depths(balls, frames), axis=1)

    def compute_way_out(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Compute the shortest level move out of the part of the body that each ball is deepest in.

        Args:
            balls: (N, 3) m, centres, world frame.
            frames: (N,) frame of each.
        Returns:
            (N, 2) m; zero outside the body.
        """
        away, least = self._compute_offsets(balls, frames)
        rows, part = np.arange(len(balls)), np.argmin(np.linalg.norm(away, axis=2) - least, axis=1)
        offset, level = away[rows, part], np.linalg.norm(away[rows, part, :2], axis=1)
        needed = np.sqrt(np.maximum(least[rows, part] ** 2 - offset[:, 2] ** 2, 0.0))
        return offset[:, :2] * (np.maximum(needed - level, 0.0) / np.maximum(level, 1e-6))[:, None]

    def _compute_offsets(self, balls: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the vectors (N, S, 3) m from the nearest points of all solids to the balls, and the least distances.
        """
        start, along = self.start[frames], self.along[frames]
        to = balls[:, None] - start
        # nearest point of a line segment: projection, limited to its ends
        share = np.clip(np.einsum("npk,npk->np", to, along) / self._line_squares[frames], 0.0, 1.0)
        to -= share[..., None] * along
        return to, self.least + share * self.taper
