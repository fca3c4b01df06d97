"""Poses as each body sees itself, and what differences between them weigh (Ball handling §4 eq. 1): the root stands
over the origin and faces X."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base.errors import InputError
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions, identify
from ..motion.motion import Motion, at_frames, pose_kinematics

BONES = ("root", "head", "left hand", "right hand", "left foot", "right foot")
_FINE = 60.0


@dataclass(frozen=True)
class BoneWeights:
    """The weights of eq. 1: of each of BONES' positions (without unit) and velocities (s). The feet count double,
    because feet that slide over the ground are what eyes notice."""

    position: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0, 2.0, 2.0)
    velocity: tuple[float, ...] = field(default=(0.1, 0.1, 0.1, 0.1, 0.2, 0.2))

    def __post_init__(self):
        for name in ("position", "velocity"):
            values = getattr(self, name)
            if len(values) != len(BONES) or not all(0.0 <= value < np.inf for value in values):
                expected = f"{len(BONES)} numbers from 0 up: {', '.join(BONES)}"
                raise InputError(f"weights of {name}", f"{values}", expected)


def aligned(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (N, 6, 3), m and m/s, of BONES at fractional `frames` (N,), seen from the body: the root
    over the origin, facing X. Hands and head that a skeleton lacks are its chest."""
    step = motion.fps / _FINE
    before, here, after = (_bones(motion, frames + offset) for offset in (-step, 0.0, step))
    taken = np.clip(frames + step, 0, len(motion) - 1) - np.clip(frames - step, 0, len(motion) - 1)
    velocity = (after[0] - before[0]) * (motion.fps / np.maximum(taken, 1e-9))[:, None, None]
    places, facing = here
    turn = quaternion.about_up(-facing)[:, None]
    return quaternion.rotate(turn, places - places[:, :1] * [1.0, 1.0, 0.0]), quaternion.rotate(turn, velocity)


def _bones(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """World positions (N, 6, 3) m of BONES, and the heading (N,) rad."""
    root, local = at_frames(motion, frames)
    places, _ = pose_kinematics(motion.skeleton, root, local)
    body = identify(motion.skeleton)
    chest = body.chest
    joints = [
        body.hips, chest if body.head is None else body.head,
        *(chest if limb.hand is None else limb.hand for limb in (body.left, body.right)),
        body.left.toe_or_foot, body.right.toe_or_foot,
    ]
    return places[:, joints], heading_from_positions(motion.skeleton, places)
