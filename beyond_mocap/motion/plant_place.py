"""Where the plant foot of a kick stands: beside the kicking ankle and ahead of it, as the body faces."""

from __future__ import annotations

import numpy as np

from . import quaternion
from .humanoid import compute_heading_from_positions, identify_joints, measure_leg_length
from .skeleton import Skeleton

PLANT_BESIDE, PLANT_AHEAD = (0.20, 0.37), (-0.05, 0.20)
"""Metres of the plant foot beside and ahead of the kicking ankle (targets of docs/reference/report-figures.md)."""

_LEG_LENGTH = 0.86  # m of the leg for which they hold


def measure_plant_place(skeleton: Skeleton, places: np.ndarray, side: str) -> np.ndarray:
    """Measure where the plant foot stands at the contact.

    Args:
        skeleton: J joints.
        places: (J, 3) m, world.
        side: of the kicking foot, "left" or "right".
    Returns:
        (2,) m from the kicking ankle to the plant foot's: ahead, and towards the plant foot's own side.
    """
    body = identify_joints(skeleton)
    kicking, plant = (body.left, body.right) if side == "left" else (body.right, body.left)
    away = (places[plant.foot] - places[kicking.foot])[:2]
    ahead, left = quaternion.rotate_level(away[None], -compute_heading_from_positions(skeleton, places)[None])[0]
    return np.array([ahead, left if side == "right" else -left])


def compute_plant_shift(skeleton: Skeleton, place: np.ndarray, margin: float = 0.0) -> np.ndarray:
    """Compute what a plant foot lacks to stand within the usual range.

    Args:
        skeleton: the body's, whose size counts.
        place: (2,) m from `measure_plant_place`.
        margin: m inside the range's edges.
    Returns:
        (2,) m, in the same directions; 0 within the range.
    """
    size = measure_leg_length(skeleton) / _LEG_LENGTH
    low, high = size * np.array([PLANT_AHEAD, PLANT_BESIDE]).T
    return np.clip(place, low + margin, high - margin) - place
