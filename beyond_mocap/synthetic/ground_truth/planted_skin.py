"""How skin moves over bones, made up: what soft tissue does to planted markers.

Two parts, as measured on pins in bones (Cappozzo et al. 1996, Clin. Biomech. 11, 90-100; Camomilla et al. 2017, J.
Biomech. 62, 5-13): a shift that follows the angles of the joints beside the segment, of which a share is common to the
whole cluster (no rigid fit can see it) and the rest is each marker's own; and flesh that lags behind shocks as a damped
mass does. Directions are drawn once for a body and a marker; they do not change from trial to trial.
"""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from .planted_places import Placed

_COMMON = 0.45  # share of the shift that a whole cluster makes
_RATE, _DAMPING = 11.0, 0.35  # Hz of wobbling flesh, and its damping ratio
_LONGEST = 0.02  # m of lag behind the hardest shock


def markers_on(motion: Motion, placed: Placed) -> np.ndarray:
    """Markers (T, M, 3) metres, world, that stand still on their bones."""
    positions, turns = forward_kinematics(motion)
    return positions[:, placed.joint] + quaternion.rotate(turns[:, placed.joint], placed.places)


def on_skin(motion: Motion, placed: Placed, neutral: np.ndarray, seed: int, softness: float = 1.0) -> np.ndarray:
    """Markers (T, M, 3) metres, world, that the skin carries over the bones.

    neutral: (J, 4) local rotations in which no skin is shifted. softness: factor on all shifts; 0 is bone.
    """
    rigid = markers_on(motion, placed)
    if softness <= 0.0:
        return rigid
    _, turns = forward_kinematics(motion)
    shift = quaternion.rotate(turns[:, placed.joint], _shifts(motion, placed, neutral, seed))
    return rigid + softness * (shift + placed.wobble[:, None] * _lag(rigid, motion.fps))


def _shifts(motion: Motion, placed: Placed, neutral: np.ndarray, seed: int) -> np.ndarray:
    """What the joints' angles do to each marker (T, M, 3), metres in its segment's axes."""
    rng = np.random.default_rng(seed)
    bends = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(neutral), motion.rotations))
    shifts = np.zeros((len(motion), len(placed.labels), 3))
    for joint in np.unique(placed.joint):
        beside = _beside(motion, int(joint), bends)
        common = _directions(rng)
        for marker in np.flatnonzero(placed.joint == joint):
            mix = _COMMON * common + np.sqrt(1.0 - _COMMON**2) * _directions(rng)
            shifts[:, marker] = placed.soft[marker] * beside @ mix
    return shifts


def _beside(motion: Motion, joint: int, bends: np.ndarray) -> np.ndarray:
    """The bends (T, 6) radians of the joint above a segment (none for the root) and of the one below, levelled off
    beyond a radian."""
    children = motion.skeleton.children(joint)
    own = bends[:, joint] if joint else np.zeros((len(motion), 3))
    below = np.mean([bends[:, child] for child in children], axis=0) if children else np.zeros((len(motion), 3))
    return np.tanh(np.concatenate([own, below], axis=1))


def _directions(rng: np.random.Generator) -> np.ndarray:
    """For each of six bends a direction of about unit length that the skin shifts in: (6, 3)."""
    return rng.normal(0.0, 1.0 / np.sqrt(3.0), (6, 3)) * np.repeat([0.8, 0.6], 3)[:, None]


def _lag(rigid: np.ndarray, fps: float) -> np.ndarray:
    """How a damped mass on each marker lags behind it (T, M, 3), metres, at most some centimetres."""
    from scipy.signal import cont2discrete, lfilter

    pull = 2.0 * np.pi * _RATE
    if fps < 4.0 * _RATE or len(rigid) < 8:
        return np.zeros_like(rigid)
    acceleration = np.gradient(np.gradient(rigid, axis=0), axis=0) * fps**2
    above, below, _ = cont2discrete(([1.0], [1.0, 2.0 * _DAMPING * pull, pull**2]), 1.0 / fps, "bilinear")
    lag = -lfilter(np.ravel(above), below, acceleration, axis=0)
    length = np.linalg.norm(lag, axis=-1, keepdims=True)
    return lag * np.where(length > 1e-9, _LONGEST * np.tanh(length / _LONGEST) / np.maximum(length, 1e-9), 1.0)
