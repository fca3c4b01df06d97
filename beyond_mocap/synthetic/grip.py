"""Where a hand holds a ball: between the fingers, on the palm's side, on any humanoid skeleton."""

from __future__ import annotations

import numpy as np

from ..base.errors import InputError
from ..motion import quaternion
from ..motion.humanoid import identify
from ..motion.retargeting.neutral import Neutral, neutral_stance
from ..motion.skeleton import Skeleton
from . import gait_tables as tables

_AHEAD, _DOWN = 0.012, 0.105  # metres of an adult whose hand hangs: thumb's side, towards the fingertips
USUAL = 0.036
"""Metres from the palm's middle to the centre of a baseball; larger balls lie further out by their radius."""


def grip_of(skeleton: Skeleton, side: str, radius: float = USUAL) -> np.ndarray:
    """(3,) m: the centre of a ball of that radius in the axes of the hand joint. InputError for a body without it."""
    return grip_in(neutral_stance(skeleton), side, radius)


def grip_in(neutral: Neutral, side: str, out: float | None = None) -> np.ndarray:
    """As `grip_of`, of a skeleton whose neutral stance is known; out: m from the palm's middle, None: of an adult's
    baseball, in the body's size."""
    hand = getattr(identify(neutral.skeleton), side).hand
    if hand is None:
        raise InputError("throw", f"a body without a {side} hand", "a skeleton with arms and hands")
    size, sign = neutral.leg / tables.LEG, 1.0 if side == "left" else -1.0
    held = np.array([_AHEAD, -USUAL * sign, -_DOWN]) * size
    if out is not None:
        held[1] = -sign * max(out, USUAL * size)
    return quaternion.rotate(quaternion.inverse(neutral.rotations[hand]), held)
