"""The surfaces of a whole body as simple bodies, and how deep the ball lies in them.

Limbs and trunk are capsules that taper from one joint to the next, with the girths of the drawn body
(`appearance.body`); feet, head and hands are the surfaces that strike the ball (`striking`), so that a ball which
touches one of them is not inside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..motion.humanoid import Humanoid, Limb, identify_joints
from ..motion.skeleton import Skeleton
from ..motion.track import BALL_RADIUS
from .striking import BODY_PARTS, Surface, build_part_surfaces, find_nearest_point

# Metres at the first and the last joint: half depths of the drawn body. The trunk is wider than deep: capsules along
# its flanks, across the hips and across the shoulders give it its width.
_LIMBS = {
    "thigh": ("upper_leg", "lower_leg", 0.080, 0.055), "shank": ("lower_leg", "foot", 0.055, 0.038),
    "upper arm": ("upper_arm", "lower_arm", 0.046, 0.039), "forearm": ("lower_arm", "hand", 0.039, 0.026),
}  # fmt: skip
_HIPS_RADIUS, _SPINE_RADIUS, _SHOULDER_RADIUS, _FLANK_RADIUS, _NECK_RADIUS = 0.09, 0.105, 0.07, 0.05, 0.055
_ORIGIN = np.zeros(3)
_ORIGIN.setflags(write=False)


@dataclass(frozen=True, eq=False)
class BodySurface(Surface):
    """A surface whose radius changes evenly along its line.

    Attributes:
        part: a part of `BODY_PARTS` but the chest, or "thigh", "shank", "upper arm", "forearm", "trunk", "neck".
        end_radius: m, at its end; `radius` is that at its start.
    """

    end_radius: float


def build_body_surfaces(skeleton: Skeleton) -> tuple[BodySurface, ...]:
    """Build the surfaces of a whole body; parts that the skeleton lacks are left out.

    Args:
        skeleton: a humanoid skeleton, J joints.
    """
    body = identify_joints(skeleton)
    parts = [one for part in BODY_PARTS if part != "chest" for one in build_part_surfaces(skeleton, part)]
    striking = [BodySurface(**vars(one), end_radius=one.radius) for one in parts]
    limbs = [one for side in ("left", "right") for one in _list_limbs(getattr(body, side), side)]
    return (*striking, *limbs, *_list_trunk(body))


def _list_limbs(limb: Limb, side: str) -> list[BodySurface]:
    """List the capsules of a leg and an arm."""
    found = []
    for part, (first, last, radius, end_radius) in _LIMBS.items():
        joints = getattr(limb, first), getattr(limb, last)
        if None not in joints:
            found.append(_build_capsule(part, side, joints, radius, end_radius))
    return found


def _list_trunk(body: Humanoid) -> list[BodySurface]:
    """List the capsules of hips, spine, shoulders, flanks and neck."""
    arms = [limb.upper_arm for limb in (body.left, body.right)]
    hips = body.left.upper_leg, body.right.upper_leg
    found = [_build_capsule("trunk", "", hips, _HIPS_RADIUS)]
    found.append(_build_capsule("trunk", "", (body.hips, body.chest), _SPINE_RADIUS))
    if body.neck is not None and body.spine:
        found.append(_build_capsule("trunk", "", (body.chest, body.neck), _SPINE_RADIUS, _NECK_RADIUS))
    if body.neck is not None and body.head is not None:
        found.append(_build_capsule("neck", "", (body.neck, body.head), _NECK_RADIUS))
    if None not in arms:
        found.append(_build_capsule("trunk", "", arms, _SHOULDER_RADIUS))
        found += [_build_capsule("trunk", "", pair, _FLANK_RADIUS) for pair in zip(hips, arms)]
    return found


def _build_capsule(part: str, side: str, joints, radius: float, end_radius: float | None = None) -> BodySurface:
    """Build the capsule between two joints, of one radius if no other is given for its end."""
    start, end = joints
    return BodySurface(part=part, side=side, radius=radius, start=(start, _ORIGIN), end=(end, _ORIGIN),
                       end_radius=radius if end_radius is None else end_radius)


def measure_ball_depths(
    surfaces: Sequence[BodySurface], positions: np.ndarray, rotations: np.ndarray, ball: np.ndarray
) -> np.ndarray:
    """Measure how deep the ball lies in each surface.

    Args:
        surfaces: S surfaces, of `build_body_surfaces`.
        positions: (T, J, 3) m, world frame.
        rotations: (T, J, 4) quaternions, world frame.
        ball: (T, 3) m, the ball's centre, world frame.
    Returns:
        (T, S) m, negative where they are apart, NaN without a ball.
    """
    depths = [_measure_depth(surface, positions, rotations, ball) for surface in surfaces]
    return np.stack(depths, axis=1) if depths else np.zeros((len(ball), 0))


def _measure_depth(surface: BodySurface, positions: np.ndarray, rotations: np.ndarray, ball: np.ndarray) -> np.ndarray:
    """Measure how deep (T,) m the ball lies in one surface."""
    start, end = surface.compute_line(positions, rotations)
    nearest = find_nearest_point((start, end), ball)
    length = np.linalg.norm(end - start, axis=-1)
    share = np.linalg.norm(nearest - start, axis=-1) / np.maximum(length, 1e-9)
    radius = surface.radius + share * (surface.end_radius - surface.radius)
    return radius + BALL_RADIUS - np.linalg.norm(ball - nearest, axis=-1)
