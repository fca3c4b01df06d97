"""Examples as arrays of one length, in float32, as a training reads them frame by frame; and poses beside them.

In use a network is given what networks said before, never quite the truth; from poses beside it that lead back to it,
networks learn to come back (Holden, Komura and Saito 2017 do so with dropout).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from beyond_mocap.base.digest import hex_digest
from beyond_mocap.base.errors import InputError
from beyond_mocap.base.vectors import skew_matrix
from beyond_mocap.throws.networks.answers import network_output
from beyond_mocap.throws.networks.chains import Chains
from beyond_mocap.throws.networks.description import Windows, windows
from beyond_mocap.throws.networks.example import Example, describe, poses
from beyond_mocap.throws.networks.features import network_input, phase_of
from beyond_mocap.throws.networks.kinematics import Pose, places_and_turns
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.training_set import Steps

FACING = 5.0
"""Radians by which a whole body is turned about the upright, for each radian of its joints."""
PLACE = 0.4
"""Metres by which its root is off, for each radian."""


class Recordings(NamedTuple):
    """N examples, each held at its last frame up to the longest, T frames. pose, window: their arrays (N, T, ...).
    lengths (N,): frames of each example."""

    pose: Pose
    window: Windows
    lengths: tuple[int, ...]

    def at(self, example, frame):
        """Poses and windows (B, ...) of frames (B,) of examples (B,)."""
        return Pose(*(one[example, frame] for one in self.pose)), Windows(*(one[example, frame] for one in self.window))

    @property
    def digest(self) -> str:
        """A short hash of all numbers in them."""
        return hex_digest(repr(self.lengths), self.pose.root, self.pose.local, *self.window)


def recordings(examples: Sequence[Example], reference: np.ndarray | None = None) -> Recordings:
    """The examples' arrays. reference: of warped phases, or None. InputError where there is no example."""
    if not examples:
        raise InputError("training", "no example", "one throw or kick at least")
    lengths = tuple(len(example.motion) for example in examples)
    longest = max(lengths)
    pose = [poses(example) for example in examples]
    window = [windows(describe(example), reference) for example in examples]
    return Recordings(Pose(*_padded(pose, longest)), Windows(*_padded(window, longest)), lengths)


def _padded(parts: list, longest: int) -> list[np.ndarray]:
    """Each field of tuples of arrays (T, ...) as one array (N, longest, ...), float32."""
    out = []
    for field in zip(*parts):
        held = [np.concatenate([one, np.repeat(one[-1:], longest - len(one), axis=0)]) for one in field]
        out.append(np.stack(held).astype(np.float32))
    return out


def single_steps(recorded: Recordings) -> Steps:
    """All frames that have one after them (F, ...), example by example."""
    example = np.concatenate([np.full(length - 1, i) for i, length in enumerate(recorded.lengths)])
    frame = np.concatenate([np.arange(length - 1) for length in recorded.lengths])
    pose, window = recorded.at(example, frame)
    return Steps(pose, recorded.at(example, frame + 1)[0], window)


def step_arrays(name: str, chains: Chains, settings: ModelSettings, told: Steps, reach: dict):
    """Inputs X (F, in), outputs Y (F, out) and phases (F,) of a network over steps, float32. reach: of the legs, as
    `phase_of` takes it."""
    x = network_input(name, chains, settings, *told)
    y = network_output(name, chains, settings, told.pose, told.after)
    phase = phase_of(name, chains, told.after, told.window, reach)
    return x.astype(np.float32), y.astype(np.float32), phase.astype(np.float32)


def drawn(chains: Chains, count: int, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints' turns (N, J, 3) rad, the bodies' turns (N,) rad and shifts (N, 3) m: normal, none of joints that ride
    along; `noise`: the joints' standard deviation in radians."""
    rng = np.random.default_rng(seed)
    vectors = np.zeros((count, len(chains.skeleton), 3))
    vectors[:, list(chains.joints)] = noise * rng.normal(size=(count, len(chains.joints), 3))
    return vectors, FACING * noise * rng.normal(size=count), PLACE * noise * rng.normal(size=(count, 3))


def disturbed(chains: Chains, pose: Pose, vectors, facing, shift, xp=np) -> Pose:
    """Poses (B, ...) whose joints are turned by rotation vectors (B, J, 3), and which stand `shift` (B, 3) m beside,
    turned about the upright through the hips by `facing` (B,) radians; how they moved stays."""
    skeleton, hips = chains.skeleton, pose.positions[..., chains.hips, :]
    about = small_turns(facing[..., None] * np.array([0.0, 0.0, 1.0], dtype=pose.root.dtype), xp)
    local = xp.matmul(pose.local, small_turns(vectors, xp))
    local = xp.concatenate([xp.matmul(about, local[..., 0, :, :])[..., None, :, :], local[..., 1:, :, :]], axis=-3)
    root = hips + xp.matmul(about, (pose.root - hips)[..., None])[..., 0] + shift
    positions, turns = places_and_turns(skeleton.offsets.astype(pose.root.dtype), skeleton.parents, root, local, xp)
    return Pose(root, local, positions, turns, pose.moved)


def small_turns(vectors, xp=np):
    """Rotations (..., 3, 3) by rotation vectors (..., 3) in radians (Rodrigues)."""
    angle = xp.sqrt(xp.sum(vectors**2, -1) + 1e-12)[..., None, None]
    skew = skew_matrix(vectors, xp)
    return (
        np.eye(3, dtype=vectors.dtype) + xp.sin(angle) / angle * skew + (1 - xp.cos(angle)) / angle**2 * (skew @ skew)
    )
