"""Moves of a foot that do not take it through the ground, which is at height 0."""

from __future__ import annotations

import numpy as np

from ...annotation.striking import Surface
from ...motion import quaternion
from ...motion.humanoid import identify
from .carry import Body

_SOLE, _ROUNDING = 0.02, 0.03  # metres of the lowest foot joint above the ground, and over which it nears that


def above_ground(body: Body, foot: Surface, at, shift: np.ndarray) -> np.ndarray:
    """Shifts (..., 3) m of a foot at frames `at` that does not go through the ground, but where it is there already."""
    tip = _tip(body, foot, at)
    lowest = np.minimum(np.min(body.line(foot, at), axis=0)[..., 2], tip[..., 2])
    out = shift.copy()
    least, wish = np.minimum(_SOLE - lowest, 0.0), shift[..., 2]
    # a maximum without a corner: at its sharpest _ROUNDING is between the two, and nothing where nothing is moved
    corner = _ROUNDING * np.minimum(1.0, np.linalg.norm(shift, axis=-1) / (2.0 * _ROUNDING))
    out[..., 2] = 0.5 * (wish + least + np.hypot(wish - least, corner))
    return out


def _tip(body: Body, foot: Surface, at) -> np.ndarray:
    """(..., 3) m: the end of a foot at frames `at`."""
    skeleton, toe = body.skeleton, getattr(identify(body.skeleton), foot.side).toe_or_foot
    offset = next((o for p, o in zip(skeleton.end_parents, skeleton.end_offsets) if p == toe), np.zeros(3))
    return body.places[at, toe] + quaternion.rotate(body.world[at, toe], offset)
