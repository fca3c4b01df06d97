"""Poses as each body sees itself, and how alike every two frames of a library are (Ball handling §4 eq. 1).

The root stands over the origin and faces X. A player of a passing scene may leave any clip for any other between two
strikes, and the path search weighs how alike the poses are against where the player has to go; so it gets eq. 1's poses
of all frames: positions and velocities of the main bones, times their weights.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import InputError
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions, identify
from ..motion.motion import Motion, at_frames, pose_kinematics
from . import kept
from .pass_scene import BONES

_FINE = 60.0

_known: weakref.WeakKeyDictionary[Library, np.ndarray] = weakref.WeakKeyDictionary()


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
    joints = [body.hips, chest if body.head is None else body.head,
              *(chest if limb.hand is None else limb.hand for limb in (body.left, body.right)), body.left.toe_or_foot,
              body.right.toe_or_foot]
    return places[:, joints], heading_from_positions(motion.skeleton, places)


def weigh_bones(library: Library, weights: BoneWeights = BoneWeights()) -> np.ndarray:
    """(N, 12, 3) float32 of the library's N frames: the sum of the distances of two frames' rows is eq. 1, over the sum
    of the usual weights of positions, so that it is about the distance in m of one bone. Kept beside the library's
    cache."""
    scale = sum(BoneWeights().position)
    measure = np.array([*weights.position, *weights.velocity]) / scale
    return measure_bones(library) * measure.astype(np.float32)[:, None]


def measure_bones(library: Library) -> np.ndarray:
    """(N, 12, 3) float32: positions m, then velocities m/s, of `links.BONES` at every frame of the library."""
    if library not in _known:
        arrays = kept.load(library, "bones")
        if arrays is None or len(arrays["bones"]) != len(library.frames):
            arrays = {"bones": _measured(library)}
            kept.save(library, "bones", arrays)
        _known[library] = arrays["bones"]
    return _known[library]


def _measured(library: Library) -> np.ndarray:
    frames = library.frames
    parts = []
    for clip, first, count in zip(library.clips, frames.first, frames.count):
        parts.append(np.concatenate(aligned(clip.motion, frames.source[first : first + count]), axis=1))
    return np.concatenate(parts).astype(np.float32)
