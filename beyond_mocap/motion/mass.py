"""The centre of mass of a body from the masses of its segments.

Where a skeleton has no joint at the end of a segment, the nearest one stands for it: hands are at the wrist, feet at
the ankle and the head at its joint, which lies some centimetres below its centre; the trunk reaches up to the neck
instead of the upper end of the breastbone. It has what the other segments leave, so that rounded shares add up.

Source: de Leva 1996, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters", J. Biomech. 29, table 4 (men
and women of about 20 years; shank to the centre of the ankle).
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from .humanoid import Humanoid

# limbs from a joint to the next one, in the order of `SegmentMasses.limbs`
_SEGMENTS = (
    ("upper_leg", "lower_leg"), ("lower_leg", "foot"), ("foot", None),
    ("upper_arm", "lower_arm"), ("lower_arm", "hand"), ("hand", None),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SegmentMasses:
    """How a body's mass is distributed over its segments; the trunk has what the others leave.

    Attributes:
        limbs: thigh, shank, foot, upper arm, forearm and hand of one side: share of the body's mass, and where the
            segment's centre lies as a share of the way from its first joint to the second.
        head: share of the body's mass.
        trunk: where the trunk's centre lies as a share of the way from the middle of the hips up to the neck.
    """

    limbs: tuple[tuple[float, float], ...]
    head: float
    trunk: float


SEGMENT_MASSES = MappingProxyType({
    "men": SegmentMasses(
        limbs=((0.1416, 0.4095), (0.0433, 0.4395), (0.0137, 0.0), (0.0271, 0.5772), (0.0162, 0.4574), (0.0061, 0.0)),
        head=0.0694, trunk=0.5514,
    ),
    "women": SegmentMasses(
        limbs=((0.1478, 0.3612), (0.0481, 0.4352), (0.0129, 0.0), (0.0255, 0.5754), (0.0138, 0.4559), (0.0056, 0.0)),
        head=0.0668, trunk=0.5849,
    ),
})  # fmt: skip
"""Whose segment masses (settings table, `masses`) -> the masses."""


def compute_centre_of_mass(
    body: Humanoid, positions: np.ndarray, masses: SegmentMasses = SEGMENT_MASSES["men"]
) -> np.ndarray:
    """Compute the centre of mass; segments that the skeleton lacks count as part of the trunk.

    Args:
        body: which joint is what.
        positions: (..., J, 3) m, world frame.
        masses: of its segments.
    Returns:
        (..., 3) m, world frame.
    """
    hips = 0.5 * (positions[..., body.left.upper_leg, :] + positions[..., body.right.upper_leg, :])
    top = positions[..., body.neck_or_chest, :]
    centre = masses.trunk * top + (1.0 - masses.trunk) * hips
    total = centre.copy()
    parts = [] if body.head is None else [(positions[..., body.head, :], masses.head)]
    for limb in (body.left, body.right):
        for (first, second), (mass, share) in zip(_SEGMENTS, masses.limbs):
            joints = getattr(limb, first), getattr(limb, second or first)
            if None not in joints:
                near, far = (positions[..., joint, :] for joint in joints)
                parts.append(((1.0 - share) * near + share * far, mass))
    for place, mass in parts:
        total = total + mass * (place - centre)
    return total
