"""The turn that lets an armature stand along Z and face +X."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...beyond_mocap.motion import quaternion


def upright_turn(heads: Mapping[str, np.ndarray]) -> np.ndarray:
    """The turn (4,), by quarter turns, that lets a body stand along Z and face +X.

    heads: part -> its place (3,) at rest, in the armature's space; thighs and feet are needed.
    """
    legs = [heads["left upper_leg"], heads["right upper_leg"]]
    up = nearest_axis(np.mean(legs, axis=0) - 0.5 * (heads["left foot"] + heads["right foot"]))
    across = legs[0] - legs[1]
    left = nearest_axis(across - (across @ up) * up)
    return quaternion.from_matrix(np.stack([np.cross(left, up), left, up]))


def nearest_axis(vector: np.ndarray) -> np.ndarray:
    """The axis (3,), with its sign, along which a vector (3,) goes furthest."""
    axis = int(np.argmax(np.abs(vector)))
    return np.eye(3)[axis] * np.sign(vector[axis])
