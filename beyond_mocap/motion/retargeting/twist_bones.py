"""Twist bones: bones along a limb that share its roll, so that skin does not wring at a wrist or a shoulder.

A forearm's twist bone at a share s of its length rolls with s of the hand's roll about the forearm. An upper arm's, or
a thigh's, gives back the part of the limb's own roll that its place does not have: -(1 - s) of it.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import arctan2, unit_vector
from .. import quaternion


def measure_roll(rotations: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Measure how far rotations roll about an axis: the twist of their swing-twist decomposition.

    Args:
        rotations: (T, 4) local rotations.
        axis: (3,) in the same axes.
    Returns:
        (T,) radians, without jumps.
    """
    along = rotations[:, 1:] @ unit_vector(axis)
    return np.unwrap(2.0 * arctan2(along, rotations[:, 0]))


def compute_twist(rotations: np.ndarray, axis: np.ndarray, share: float) -> np.ndarray:
    """Compute the local rotations of a twist bone.

    Args:
        rotations: (T, 4) local rotations of the joint whose roll is shared.
        axis: (3,) along the limb, at rest.
        share: of the roll; negative to give roll back.
    Returns:
        (T, 4).
    """
    roll = measure_roll(rotations, axis)
    roll = roll - 2.0 * np.pi * np.round(np.median(roll) / (2.0 * np.pi))
    return quaternion.from_axis_angle(np.broadcast_to(unit_vector(axis), (len(roll), 3)), share * roll)
