"""Examples as arrays of equal length, in float32, for training frame by frame; and poses near them.

In use a network receives its own earlier output, never exactly the truth; from disturbed poses that lead back to the
truth, networks learn to return (Holden, Komura and Saito 2017 use dropout for that).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from beyond_mocap.base.digest import hex_digest
from beyond_mocap.base.errors import InputError
from beyond_mocap.base.vectors import skew_matrix
from beyond_mocap.throws.networks.chains import Chains
from beyond_mocap.throws.networks.description import Windows, build_windows
from beyond_mocap.throws.networks.example import Example, build_description, compute_poses
from beyond_mocap.throws.networks.features import build_input, compute_phase
from beyond_mocap.throws.networks.kinematics import Pose, compute_world_transforms
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.network_output import build_output
from beyond_mocap.throws.networks.training_set import Steps

HEADING_NOISE = 5.0
"""Radians by which a whole body is rotated about the vertical, for each radian of joint noise."""
POSITION_NOISE = 0.4
"""Metres of root error, for each radian of joint noise."""


class Recordings(NamedTuple):
    """N examples, each extended by its last frame to the longest, T frames.

    Attributes:
        pose: arrays (N, T, ...).
        window: arrays (N, T, ...).
        lengths: (N,) frames of each example.
    """

    pose: Pose
    window: Windows
    lengths: tuple[int, ...]

    def select_frames(self, example, frame):
        """Return poses and windows (B, ...) of frames (B,) of examples (B,)."""
        return Pose(*(one[example, frame] for one in self.pose)), Windows(*(one[example, frame] for one in self.window))

    @property
    def digest(self) -> str:
        """Short hash of all values."""
        return hex_digest(repr(self.lengths), self.pose.root, self.pose.local, *self.window)


def build_recordings(examples: Sequence[Example], reference: np.ndarray | None = None) -> Recordings:
    """Build the arrays of examples.

    Args:
        examples: the examples.
        reference: (N,) speed curve of warped phases, or None.
    Raises:
        InputError: if there is no example.
    """
    if not examples:
        raise InputError("training", "no example", "at least one throw or kick")
    lengths = tuple(len(example.motion) for example in examples)
    longest = max(lengths)
    pose = [compute_poses(example) for example in examples]
    window = [build_windows(build_description(example), reference) for example in examples]
    return Recordings(Pose(*_pad_fields(pose, longest)), Windows(*_pad_fields(window, longest)), lengths)


def _pad_fields(parts: list, longest: int) -> list[np.ndarray]:
    """Pad and stack each field of tuples of arrays (T, ...) to one array (N, longest, ...), float32."""
    out = []
    for field in zip(*parts):
        padded = [np.concatenate([one, np.repeat(one[-1:], longest - len(one), axis=0)]) for one in field]
        out.append(np.stack(padded).astype(np.float32))
    return out


def build_single_steps(recorded: Recordings) -> Steps:
    """Build the steps (F, ...) from all frames that have a next one, example by example."""
    example = np.concatenate([np.full(length - 1, i) for i, length in enumerate(recorded.lengths)])
    frame = np.concatenate([np.arange(length - 1) for length in recorded.lengths])
    pose, window = recorded.select_frames(example, frame)
    return Steps(pose, recorded.select_frames(example, frame + 1)[0], window)


def build_step_arrays(name: str, chains: Chains, settings: ModelSettings, steps: Steps, reach: dict):
    """Build inputs X (F, in), outputs Y (F, out) and phases (F,) of a network over steps, float32.

    `reach` is the leg reach, as for `compute_phase`.
    """
    x = build_input(name, chains, settings, *steps)
    y = build_output(name, chains, settings, steps.pose, steps.after)
    phase = compute_phase(name, chains, steps.after, steps.window, reach)
    return x.astype(np.float32), y.astype(np.float32), phase.astype(np.float32)


def sample_noise(chains: Chains, count: int, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample normal noise for poses.

    Args:
        chains: chains of the skeleton.
        count: number N of poses.
        noise: rad, standard deviation of the joints.
        seed: of the noise.
    Returns:
        Rotation vectors of the joints (N, J, 3) rad, zero for joints that no network moves, rotations of the bodies
        (N,) rad and shifts (N, 3) m.
    """
    rng = np.random.default_rng(seed)
    vectors = np.zeros((count, len(chains.skeleton), 3))
    vectors[:, list(chains.joints)] = noise * rng.normal(size=(count, len(chains.joints), 3))
    return vectors, HEADING_NOISE * noise * rng.normal(size=count), POSITION_NOISE * noise * rng.normal(size=(count, 3))


def disturb_poses(chains: Chains, pose: Pose, vectors, facing, shift, xp=np) -> Pose:
    """Disturb poses (B, ...); their displacements `moved` stay.

    Args:
        chains: chains of the skeleton.
        pose: the poses.
        vectors: (B, J, 3) rad, rotation vectors of the joints.
        facing: (B,) rad, rotation about the vertical through the hips.
        shift: (B, 3) m.
        xp: numpy or jax.numpy.
    """
    skeleton, hips = chains.skeleton, pose.positions[..., chains.hips, :]
    about = to_rotations(facing[..., None] * np.array([0.0, 0.0, 1.0], dtype=pose.root.dtype), xp)
    local = xp.matmul(pose.local, to_rotations(vectors, xp))
    local = xp.concatenate([xp.matmul(about, local[..., 0, :, :])[..., None, :, :], local[..., 1:, :, :]],
                           axis=-3)
    root = hips + xp.matmul(about, (pose.root - hips)[..., None])[..., 0] + shift
    positions, turns = compute_world_transforms(skeleton.offsets.astype(pose.root.dtype), skeleton.parents, root, local,
                                                xp)
    return Pose(root, local, positions, turns, pose.moved)


def to_rotations(vectors, xp=np):
    """Convert rotation vectors (..., 3) rad to rotations (..., 3, 3) (Rodrigues)."""
    angle = xp.sqrt(xp.sum(vectors**2, -1) + 1e-12)[..., None, None]
    skew = skew_matrix(vectors, xp)
    return (
        np.eye(3, dtype=vectors.dtype) + xp.sin(angle) / angle * skew + (1 - xp.cos(angle)) / angle**2 * (skew @ skew)
    )
