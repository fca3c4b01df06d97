"""Examples as arrays of one length, in float32, as a training reads them frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from beyond_mocap.base.digest import hex_digest
from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks.answers import network_output
from beyond_mocap.throws.networks.chains import Chains
from beyond_mocap.throws.networks.description import Windows, windows
from beyond_mocap.throws.networks.example import Example, describe, poses
from beyond_mocap.throws.networks.features import network_input, phase_of
from beyond_mocap.throws.networks.kinematics import Pose
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.training_set import Steps


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
