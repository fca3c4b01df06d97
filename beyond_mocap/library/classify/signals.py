"""A recording as signals independent of its body: at one rate, in the heading frame, in leg lengths; and one moment of
them as a row of numbers.

Positions and velocities of twelve points that every humanoid has, the pelvis's height, speed and turning, and the
trunk's lean. The mirrored body's signals follow by exchanging sides, so that one example teaches both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...base.vectors import unit_vectors
from ...motion import contacts
from ...motion.humanoid import Humanoid, compute_heading_from_positions, identify_joints, measure_leg_length
from ...motion.motion import Motion, forward_kinematics
from ...motion.quaternion import rotate_about_up

RATE = 30.0
"""Signals per second."""

MIDDLE, PAIRED = ("chest", "head"), ("hand", "elbow", "knee", "ankle", "toe")
"""Points by name: those without a side, and those with a left and a right one."""

_SMOOTH = 0.015  # seconds over which positions are smoothed before taking velocities
_REACH = 0.12  # seconds by which velocities are multiplied, to be lengths like the positions (`library.features`)
STRIKES = ("foot", "hand", "head", "pelvis up", "pelvis down")
"""Signals with a peak, at the recording's own rate, where something is struck, caught or cleared: the faster foot's and
the faster hand's speed, the head's forward speed against the chest, the pelvis's height and its negative."""

OFFSETS = np.array([-18, -12, -8, -5, -3, -1, 0, 1, 3, 5, 8, 12, 18])
"""Samples (1/30 s) of a window around its moment: dense near it, up to 0.6 s to both sides."""

LENGTH = 13 * 80
"""Numbers in a window."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Signals:
    """The signals of a recording.

    Attributes:
        fps: the recording's own rate.
        count: its frames.
        frames: (N,) the fractional frames of N samples at RATE.
        middle: (N, 2, 6) and
        paired: (N, 2, 5, 6) of each point (MIDDLE; left and right PAIRED) the position relative to the pelvis and the
            velocity times 0.12 s, x forward, y left, z up, in leg lengths.
        trunk: (N, 8) pelvis's height in leg lengths, its velocity in m/s (forward, left, up), turning in rad/s, the
            trunk's direction (3).
        strikes: (count, 5) STRIKES in m/s and m.
    """

    fps: float
    count: int
    frames: np.ndarray
    middle: np.ndarray
    paired: np.ndarray
    trunk: np.ndarray
    strikes: np.ndarray

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def mirror_signals(self) -> "Signals":
        """The same signals with left and right exchanged."""
        across, trunk = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0]), np.array([1, 1, -1, 1, -1, 1, -1, 1.0])
        middle, paired = self.middle * across, self.paired[:, ::-1] * across
        return replace(self, middle=middle, paired=paired, trunk=self.trunk * trunk)


def build_signals(motion: Motion) -> Signals:
    """Build the signals of a recording; InputError where its skeleton has no legs."""
    body, leg = identify_joints(motion.skeleton), measure_leg_length(motion.skeleton)
    places, _ = forward_kinematics(motion)
    facing = np.unwrap(compute_heading_from_positions(motion.skeleton, places))
    moving = _compute_velocity(places, motion.fps)
    hips = body.hips
    at = np.arange(0.0, len(motion) - 1 + 1e-6, motion.fps / RATE)
    rows = np.minimum(np.round(at).astype(int), len(motion) - 1)

    def list_joint_positions(joints: list[int]) -> np.ndarray:
        offsets = places[rows][:, joints] - places[rows][:, [hips]]
        velocities = (moving[rows][:, joints] - moving[rows][:, [hips]]) * _REACH
        turn = -facing[rows][:, None]
        return np.concatenate([rotate_about_up(offsets, turn), rotate_about_up(velocities, turn)], axis=-1) / leg

    sides = [_list_side_joints(body, limb) for limb in (body.left, body.right)]
    head = body.head_or_neck
    strikes = _compute_strikes(places, moving, body, head, facing)
    return Signals(fps=motion.fps, count=len(motion), frames=at, middle=list_joint_positions([body.chest, head]),
                   paired=np.stack([list_joint_positions(one) for one in sides], axis=1),
                   trunk=_compute_trunk(motion, body, places, moving=moving, facing=facing, leg=leg)[rows],
                   strikes=strikes)


def _list_side_joints(body: Humanoid, limb) -> list[int]:
    """List the joints of PAIRED on one side; a missing joint is replaced by the one that would carry it."""
    upper = limb.upper_arm if limb.upper_arm is not None else body.chest
    elbow = limb.lower_arm if limb.lower_arm is not None else upper
    return [limb.hand if limb.hand is not None else elbow, elbow, limb.lower_leg, limb.foot, limb.toe_or_foot]


def _compute_trunk(motion, body: Humanoid, places, moving, facing, leg: float) -> np.ndarray:
    """Compute `Signals.trunk` at the recording's rate: (T, 8)."""
    hips, top = body.hips, body.neck_or_chest
    height = (places[:, hips, 2] - contacts.measure_ground_height(motion)) / leg
    pace = rotate_about_up(moving[:, hips], -facing)
    pace = gaussian_filter1d(pace, max(0.05 * motion.fps, 0.5), axis=0, mode="nearest")
    smooth = gaussian_filter1d(facing, max(0.1 * motion.fps, 0.5), mode="nearest")
    turning = np.gradient(smooth) * motion.fps if len(motion) > 1 else np.zeros(1)
    up = rotate_about_up(places[:, top] - places[:, hips], -facing)
    up = unit_vectors(up)
    return np.concatenate([height[:, None], pace, turning[:, None], up], axis=1)


def _compute_strikes(places, moving, body: Humanoid, head: int, facing) -> np.ndarray:
    """Compute `Signals.strikes`: (T, 5)."""
    feet = [body.left.toe_or_foot, body.right.toe_or_foot]
    hands = [_list_side_joints(body, limb)[0] for limb in (body.left, body.right)]
    speed = np.linalg.norm(moving[:, [*feet, *hands]], axis=-1).reshape(len(places), 2, 2).max(axis=2)
    nod = rotate_about_up(moving[:, head] - moving[:, body.chest], -facing)[:, 0]
    height = places[:, body.hips, 2]
    return np.concatenate([speed, nod[:, None], height[:, None], -height[:, None]], axis=1)


def _compute_velocity(places: np.ndarray, fps: float) -> np.ndarray:
    """Compute the velocity (T, J, 3) m/s of positions (T, J, 3) m."""
    if len(places) < 2:
        return np.zeros_like(places)
    return np.gradient(gaussian_filter1d(places, max(_SMOOTH * fps, 0.5), axis=0, mode="nearest"), axis=0) * fps


def build_windows(signals: Signals) -> np.ndarray:
    """Build the windows (N, LENGTH), one row a sample; beyond the ends the first and last sample repeat."""
    count = len(signals)
    flat = np.concatenate([part.reshape(count, -1) for part in (signals.middle, signals.paired, signals.trunk)], axis=1)
    around = np.clip(np.arange(count)[:, None] + OFFSETS, 0, count - 1)
    return flat[around].reshape(count, -1)


@dataclass(frozen=True, eq=False)
class Space:
    """Windows reduced to their principal components.

    Attributes:
        mean, scale: (LENGTH,) of the windows.
        basis: (LENGTH, K).
    """

    mean: np.ndarray
    scale: np.ndarray
    basis: np.ndarray

    @classmethod
    def from_windows(cls, rows: np.ndarray, components: int) -> "Space":
        """Build the space of windows (N, LENGTH), with at most `components` components."""
        mean, scale = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-6)
        unit = (rows - mean) / scale
        _, vectors = np.linalg.eigh(unit.T @ unit)
        count = min(components, len(rows))
        return cls(mean, scale, vectors[:, ::-1][:, :count].astype(np.float32))

    def project(self, rows: np.ndarray) -> np.ndarray:
        """Project windows (N, LENGTH) to the space: (N, K), of unit variance in all."""
        return (rows - self.mean) / self.scale @ self.basis / np.sqrt(self.basis.shape[0])
