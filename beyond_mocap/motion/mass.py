"""The centre of mass of a body from the masses of its segments.

Source: de Leva 1996, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters", J. Biomech. 29, table 4 (men).
"""

from __future__ import annotations

import numpy as np

from .humanoid import Humanoid

# share of the body's mass, and where its centre lies as a share of the way from the first joint to the second
_LEG = (("upper_leg", "lower_leg", 0.1416, 0.4095), ("lower_leg", "foot", 0.0433, 0.4395), ("foot", None, 0.0137, 0.0))
_ARM = (("upper_arm", "lower_arm", 0.0271, 0.5772), ("lower_arm", "hand", 0.0162, 0.4574), ("hand", None, 0.0061, 0.0))
_TRUNK, _HEAD = (0.4346, 0.5514), 0.0694


def compute_centre_of_mass(body: Humanoid, positions: np.ndarray) -> np.ndarray:
    """Compute the centre of mass; segments that the skeleton lacks count as part of the trunk.

    Args:
        body: which joint is what.
        positions: (..., J, 3) m, world frame.
    Returns:
        (..., 3) m, world frame.
    """
    hips = 0.5 * (positions[..., body.left.upper_leg, :] + positions[..., body.right.upper_leg, :])
    top = positions[..., body.neck_or_chest, :]
    centre = _TRUNK[1] * top + (1.0 - _TRUNK[1]) * hips
    total = centre.copy()
    parts = [] if body.head is None else [(positions[..., body.head, :], _HEAD)]
    for limb in (body.left, body.right):
        for first, second, mass, share in (*_LEG, *_ARM):
            joints = getattr(limb, first), getattr(limb, second or first)
            if None not in joints:
                near, far = (positions[..., joint, :] for joint in joints)
                parts.append(((1.0 - share) * near + share * far, mass))
    for place, mass in parts:
        total = total + mass * (place - centre)
    return total
