"""How people move: recordings as joints that all are as tall, seen from their own heading, to compare others with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.errors import InputError
from ..base.vectors import arctan2
from ..library.features import HORIZON, sample_positions
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.retargeting.adult import ADULT_LEG

RATE = 30.0
"""Frames per second of examples."""
CONTEXT = 0.12
"""Seconds over which velocities are measured."""
_PARTS = {"hip": "upper_leg", "shoulder": "upper_arm", "knee": "lower_leg", "ankle": "foot", "elbow": "lower_arm",
          "wrist": "hand"}  # joints of `Limb`
COMPARED = tuple(f"{side}_{part}" for part in _PARTS for side in ("left", "right"))
"""Joints by which people are compared: the first columns of examples, of the left and the right in turn."""

_LEG = [[0, 1], [4, 5], [6, 7]]  # columns of hips, knees and ankles
_LEFT, _RIGHT = [0, 2], [1, 3]  # of hips and shoulders
_MOST_FRAMES = 60_000  # of a library; of a larger one every second, third... recording


@dataclass(frozen=True, eq=False)
class JointExamples:
    """Recordings at RATE, one after the other.

    Attributes:
        joints: (N, K, 3) m, world, of people whose legs are ADULT_LEG long: the first K of COMPARED.
        first, last: (N,) the first and the last frame of the same recording.
    """

    joints: np.ndarray
    first: np.ndarray
    last: np.ndarray

    def select(self, count: int) -> JointExamples:
        """Select the first columns; all of them with what is computed of them so far."""
        return self if count == self.joints.shape[1] else replace(self, joints=self.joints[:, :count])

    @cached_property
    def root(self) -> np.ndarray:
        """(N, 2) m, the middle of the hips."""
        return find_root(self.joints)

    @cached_property
    def heading(self) -> np.ndarray:
        """(N,) rad."""
        return measure_heading(self.joints)

    @cached_property
    def poses(self) -> np.ndarray:
        """(N, K, 3) m from the ground below the hips, in the heading frame."""
        return quaternion.rotate_about_up(_move_level(self.joints, -self.root), -self.heading[:, None])

    def measure_velocities(self, is_before: bool) -> np.ndarray:
        """Measure velocities (N, K, 3) m/s over the CONTEXT before, or after, each frame, in its heading
        frame.
        """
        reach, at = int(round(CONTEXT * RATE)), np.arange(len(self.joints))
        low, high = (np.maximum(at - reach, self.first), at) if is_before else (at, np.minimum(at + reach, self.last))
        seconds = np.maximum(high - low, 1) / RATE
        moved = (self.joints[high] - self.joints[low]) / seconds[:, None, None].astype(self.joints.dtype)
        return quaternion.rotate_about_up(moved, -self.heading[:, None])

    @cached_property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """How each frame looks as the last before a gap, and as the first after one (`describe_end`)."""
        before, after = (describe_end(self.poses, self.measure_velocities(is_before)) for is_before in (True, False))
        return before, after


def describe_end(poses: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Describe poses (N, K, 3) m and velocities (N, K, 3) m/s by numbers (N, K * 6) whose distance is in metres."""
    joined = np.concatenate([poses, HORIZON * velocities], axis=2) / np.sqrt(poses.shape[1])
    return joined.reshape(len(poses), -1)


def find_root(joints: np.ndarray) -> np.ndarray:
    """Find the middle (T, 2) m between the hips of joints (T, K, 3)."""
    return 0.5 * (joints[:, _LEFT[0], :2] + joints[:, _RIGHT[0], :2])


def measure_heading(joints: np.ndarray) -> np.ndarray:
    """Measure the heading (T,) rad of joints (T, K, 3), square to hips and shoulders."""
    across = (joints[:, _LEFT, :2] - joints[:, _RIGHT, :2]).sum(axis=1)
    return arctan2(-across[:, 0], across[:, 1])


def measure_size(joints: np.ndarray) -> float:
    """Measure by what joints (T, K, 3) have to be multiplied so that legs are ADULT_LEG long."""
    hip, knee, ankle = (joints[:, columns] for columns in _LEG)
    return ADULT_LEG / float(np.median(np.linalg.norm(hip - knee, axis=2) + np.linalg.norm(knee - ankle, axis=2)))


def build_examples(recordings: Iterable[np.ndarray]) -> JointExamples:
    """Build examples of recordings, one or more, each (T, K, 3) m of two frames or more."""
    parts = [(measure_size(one) * one).astype(np.float32) for one in recordings]
    counts = np.array([len(part) for part in parts], int)
    end = np.cumsum(counts)
    return JointExamples(np.concatenate(parts), np.repeat(end - counts, counts), np.repeat(end - 1, counts))


def read_examples(library: Library) -> JointExamples:
    """Read the examples of a library, its recordings and their mirrored twins; InputError for one without arms."""
    body = identify_joints(library.skeleton)
    joints = [getattr(limb, role) for role in _PARTS.values() for limb in (body.left, body.right)]
    if None in joints:
        raise InputError(library.folder, "a skeleton without arms", "clips of whole bodies", "choose another library")
    step = int(np.ceil(len(library.frames) / _MOST_FRAMES))
    clips = (clip for number, clip in enumerate(library.clips) if number // 2 % step == 0)  # each twin follows its own
    places = (sample_positions(clip.motion, RATE)[1][:, joints] for clip in clips)
    return build_examples(one for one in places if len(one) >= 2)


def mirror_joints(joints: np.ndarray) -> np.ndarray:
    """Mirror joints (T, K, 3)."""
    other = np.arange(joints.shape[1]) ^ 1
    return joints[:, other] * [1.0, -1.0, 1.0]


def _move_level(joints: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Move joints (N, K, 3) on the ground by (N, 2)."""
    return np.concatenate([joints[..., :2] + move[:, None], joints[..., 2:]], axis=2)
