"""How far a body can move the part that meets the ball."""

from __future__ import annotations

import numpy as np

from ....annotation.striking import Surface
from ....motion.humanoid import identify_joints
from ..move_body_part import (
    MAX_ANGLE,
    MAX_SWING,
    Body,
    Swing,
    compute_swing_shift,
    limb_chain,
    limit_to_ground,
    solve_swing,
)

MAX_SHIFT = {"foot": 0.45, "hand": 0.4, "head": 0.2, "chest": 0.12, "thigh": 0.1}
"""Metres, largest move of a part from the recording."""

PELVIS_RANGE = (0.20, 0.64)
"""Metres on the ground from pelvis to striking foot in measured kicks, unless recorded further."""

MAX_DROP = 0.04
"""Metres, largest drop of the pelvis."""


def limit_shift(body: Body, part: Surface, at: int, shift: np.ndarray) -> np.ndarray:
    """Limit a shift to what a body can do: not too far, no limb below the ground or beyond its joints.

    Args:
        body: the body.
        part: the part that is shifted.
        at: its frame.
        shift: (3,) m.
    Returns:
        (3,) m.
    """
    shift = shift * min(1.0, MAX_SHIFT[part.part] / max(np.linalg.norm(shift), 1e-9))
    if part.part == "foot":
        shift = limit_to_ground(body, part, at, _limit_pelvis_distance(body, part, at, shift))
    if part.part in MAX_SWING and None not in (chain := limb_chain(body.skeleton, part)):
        shift = compute_swing_shift(body, chain, solve_part_swing(body, part, at, shift), np.arange(len(body.root))
                                    == at)[at]
    return shift


def _limit_pelvis_distance(body: Body, part: Surface, at: int, shift: np.ndarray) -> np.ndarray:
    """Limit the shift (3,) m of a foot to PELVIS_RANGE from the pelvis on the ground."""
    pelvis, middle = body.places[at, identify_joints(body.skeleton).hips], np.mean(body.surface_line(part, at), axis=0)
    away = level_vector(middle + shift - pelvis)
    own, requested = np.linalg.norm(level_vector(middle - pelvis)), np.linalg.norm(away)
    ranged = np.clip(requested, min(PELVIS_RANGE[0], float(own)), max(PELVIS_RANGE[1], float(own)))
    return shift + away * (ranged / max(requested, 1e-9) - 1.0)


def solve_part_swing(body: Body, part: Surface, at: int, shift: np.ndarray) -> Swing:
    """Solve the limb's swing that moves a part; the pelvis sinks where its leg is too short.

    Args:
        body: the body.
        part: the part that is shifted.
        at: its frame.
        shift: (3,) m.
    Returns:
        The swing.
    """
    chain = limb_chain(body.skeleton, part)
    place = body.places[at, chain[2]] + shift
    lowered = _compute_drop(body, chain, at, place) if part.part == "foot" else 0.0
    return solve_swing(body, chain, at, place=place, max_turn=MAX_SWING[part.part], lowered=lowered)


def _compute_drop(body: Body, chain: tuple[int, int, int], at: int, ankle: np.ndarray) -> float:
    """Compute how far the pelvis sinks so that the leg reaches the place (3,) of its ankle, m, at most MAX_DROP."""
    hip, knee, own = body.places[at, list(chain)]
    upper, lower = np.linalg.norm(knee - hip), np.linalg.norm(own - knee)
    # law of cosines: length of the leg at its largest knee angle
    length = np.sqrt(upper**2 + lower**2 - 2.0 * upper * lower * np.cos(MAX_ANGLE))
    length, level = max(length, np.linalg.norm(own - hip)), np.linalg.norm(level_vector(ankle - hip))
    return float(np.clip(hip[2] - ankle[2] - np.sqrt(max(length**2 - level**2, 0.0)), 0.0, MAX_DROP))


def level_vector(v: np.ndarray) -> np.ndarray:
    """Return a vector without its height.

    Args:
        v: (3,) m or m/s.
    Returns:
        (3,).
    """
    return v * [1.0, 1.0, 0.0]
