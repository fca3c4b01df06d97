"""What a BVH file had beyond its motion, so that a motion can be written back in the form it came in."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping

import numpy as np


@dataclass(frozen=True, kw_only=True)
class RootAbove:
    """A joint that stood above the hips, from the file's root down.

    moves: whether it travelled with the body (LAFAN1's SimulationBone) instead of standing still (Bandai's joint_Root).
    position: (3,) metres, rotation: (4,), relative to the joint above it; constant, of the first frame where it moves.
    heading: radians from the body's facing to this joint's, where it moves. carries: (3,) metres, the hips' place in
    it, where it stands right above hips that have no position channels of their own.
    """

    name: str
    channels: tuple[str, ...]
    moves: bool
    position: np.ndarray
    rotation: np.ndarray
    heading: float = 0.0
    carries: np.ndarray | None = None


@dataclass(frozen=True)
class BvhForm:
    """What writing back needs beyond the motion.

    channels: each joint's channel names in order. above: joints above the hips. unit: metres per file unit, and up: "Y"
    or "Z", as read (files are always written in centimetres with Y up).
    """

    channels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    above: tuple[RootAbove, ...] = ()
    unit: float = 0.01
    up: str = "Y"
