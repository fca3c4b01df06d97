"""Poses in the body's own frame, and the distance between any two frames of a library (Ball handling, section 4, eq.
1).

In this frame the root is above the origin and faces X. Between two strikes a player of a passing scene may leave any
clip for any other; the path search weighs the distance of the two poses against where the player has to go. It takes
the terms of eq. 1 for all frames: positions and velocities of the main bones, times their weights.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import InputError
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import Motion, compute_pose, sample_frames
from . import analysis_cache as kept
from .pass_scene import BONES

_DIFFERENCE_RATE = 60.0  # Hz: velocities are central differences over two steps of this rate

_bones_of_library: weakref.WeakKeyDictionary[Library,
                                             np.ndarray] = weakref.WeakKeyDictionary()  # library -> `measure_bones`


@dataclass(frozen=True)
class BoneWeights:
    """Weights of eq. 1 for the positions and velocities of BONES.

    The feet count double because sliding feet are the most visible error.

    Attributes:
        position: one weight per bone, without unit.
        velocity: one weight per bone, seconds.
    """

    position: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0, 2.0, 2.0)
    velocity: tuple[float, ...] = field(default=(0.1, 0.1, 0.1, 0.1, 0.2, 0.2))

    def __post_init__(self):
        for name in ("position", "velocity"):
            values = getattr(self, name)
            if len(values) != len(BONES) or not all(0.0 <= value < np.inf for value in values):
                expected = f"{len(BONES)} numbers of 0 or more, one each for {', '.join(BONES)}"
                raise InputError(f"{name} weights", f"{values}", expected)


def align_poses(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions and velocities of BONES in the body's own frame: root above the origin, facing X.

    A hand or head that the skeleton lacks takes the chest's place.

    Args:
        motion: the motion.
        frames: (N,) fractional frames of the motion.
    Returns:
        positions: (N, 6, 3) m.
        velocities: (N, 6, 3) m/s.
    """
    step = motion.fps / _DIFFERENCE_RATE
    earlier, now, later = (_find_bones(motion, frames + offset) for offset in (-step, 0.0, step))
    # frames really between the two samples: fewer at the clip's ends, where samples are clamped
    spanned = np.clip(frames + step, 0, len(motion) - 1) - np.clip(frames - step, 0, len(motion) - 1)
    velocity = (later[0] - earlier[0]) * (motion.fps / np.maximum(spanned, 1e-9))[:, None, None]
    places, facing = now
    # remove the heading and the root's place on the ground
    turn = quaternion.from_up_angle(-facing)[:, None]
    return quaternion.rotate(turn, places - places[:, :1] * [1.0, 1.0, 0.0]), quaternion.rotate(turn, velocity)


def _find_bones(motion: Motion, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute world positions (N, 6, 3) m of BONES and the heading (N,) rad at fractional frames (N,)."""
    root, local = sample_frames(motion, frames)
    places, _ = compute_pose(motion.skeleton, root, local)
    body = identify_joints(motion.skeleton)
    chest = body.chest
    joints = [body.hips, chest if body.head is None else body.head,
              *(chest if limb.hand is None else limb.hand for limb in (body.left, body.right)), body.left.toe_or_foot,
              body.right.toe_or_foot]
    return places[:, joints], compute_heading_from_positions(motion.skeleton, places)


def weigh_bones(library: Library, weights: BoneWeights = BoneWeights()) -> np.ndarray:
    """Build the weighted rows of eq. 1 for every frame of a library.

    The distance of two frames is the sum of the distances between their rows. It is divided by the sum of the default
    position weights, so its size is roughly the distance of one bone in metres. Stored beside the library's cache.

    Args:
        library: the library, N frames.
        weights: weights of eq. 1.
    Returns:
        (N, 12, 3) float32: six weighted positions, then six weighted velocities.
    """
    scale = sum(BoneWeights().position)
    measure = np.array([*weights.position, *weights.velocity]) / scale
    return measure_bones(library) * measure.astype(np.float32)[:, None]


def measure_bones(library: Library) -> np.ndarray:
    """Compute or load the positions and velocities of BONES at every frame of a library.

    Args:
        library: the library, N frames.
    Returns:
        (N, 12, 3) float32: positions in m, then velocities in m/s, in the body's own frame.
    """
    if library not in _bones_of_library:
        arrays = kept.load_arrays(library, "bones")
        if arrays is None or len(arrays["bones"]) != len(library.frames):
            arrays = {"bones": _measure_clips(library)}
            kept.save_arrays(library, "bones", arrays)
        _bones_of_library[library] = arrays["bones"]
    return _bones_of_library[library]


def _measure_clips(library: Library) -> np.ndarray:
    frames = library.frames
    parts = []
    for clip, first, count in zip(library.clips, frames.first, frames.count):
        parts.append(np.concatenate(align_poses(clip.motion, frames.source[first : first + count]), axis=1))
    return np.concatenate(parts).astype(np.float32)
