"""The surfaces of a whole body as simple bodies; `body_solid` places them on a posed body.

Limbs and trunk are capsules that taper from one joint to the next, with the girths of the drawn body
(`appearance.body`); feet, head and hands are the surfaces that strike the ball (`striking`), so that a ball which
touches one of them is not inside it.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..motion.humanoid import Humanoid, Limb, identify_joints
from ..motion.skeleton import Skeleton
from .striking import BODY_PARTS, JOINT_ORIGIN, Surface, build_part_surfaces

# Metres at the first and the last joint: half depths of the drawn body. The trunk is wider than deep: capsules along
# its flanks, across the hips and across the shoulders give it its width.
_LIMBS = {
    "thigh": ("upper_leg", "lower_leg", 0.080, 0.055), "shank": ("lower_leg", "foot", 0.055, 0.038),
    "upper arm": ("upper_arm", "lower_arm", 0.046, 0.039), "forearm": ("lower_arm", "hand", 0.039, 0.026),
}  # fmt: skip
_HIPS_RADIUS, _SPINE_RADIUS, _SHOULDER_RADIUS, _FLANK_RADIUS, _NECK_RADIUS = 0.09, 0.105, 0.07, 0.05, 0.055


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
    return BodySurface(part=part, side=side, radius=radius, start=(start, JOINT_ORIGIN), end=(end, JOINT_ORIGIN),
                       end_radius=radius if end_radius is None else end_radius)
