"""A recording as signals that no longer tell whose body it is: at one rate, in the facing frame, in lengths of a leg;
and what one moment of them looks like, as one row of numbers.

Positions and velocities of twelve points that every humanoid has, the pelvis's height, speed and turning, and the
trunk's lean. The mirrored body's signals come from these by exchanging sides, so that one example teaches both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...base.vectors import unit_vectors
from ...motion import contacts
from ...motion.humanoid import Humanoid, heading_from_positions, identify, leg_length
from ...motion.motion import Motion, forward_kinematics
from ...motion.quaternion import turned_about_up

RATE = 30.0
"""Signals per second."""

MIDDLE, PAIRED = ("chest", "head"), ("hand", "elbow", "knee", "ankle", "toe")
"""Points by name: those that have no side, and those of which there is a left and a right one."""

_SMOOTH = 0.015  # seconds: velocities are taken of places smoothed so
_REACH = 0.12  # seconds by which velocities are weighed, so that they are lengths like the places (`library.features`)
STRIKES = ("foot", "hand", "head", "pelvis up", "pelvis down")
"""What has a peak at the recording's own rate where something is struck, caught or cleared: the faster foot's and the
faster hand's speed, the head's forward against the chest, the pelvis's height and its negative."""

OFFSETS = np.array([-18, -12, -8, -5, -3, -1, 0, 1, 3, 5, 8, 12, 18])
"""Samples (1/30 s) around a moment that its window looks at: close ones near it, 0.6 s to both sides."""

LENGTH = 13 * 80
"""Numbers of a window."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Signals:
    """What a recording shows.

    fps: the recording's own rate; count: its frames. frames (N,): the fractional frames of N samples at RATE.
    middle (N, 2, 6), paired (N, 2, 5, 6): of each point (MIDDLE; left and right PAIRED) place against the pelvis and
    velocity times 0.12 s, x forward, y left, z up, in legs. trunk (N, 8): pelvis's height in legs, its velocity in
    m/s (forward, left, up), turning in rad/s, the trunk's direction (3). strikes (count, 5): STRIKES in m/s and m."""

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
    def mirrored(self) -> "Signals":
        """The same with left and right exchanged."""
        across, trunk = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0]), np.array([1, 1, -1, 1, -1, 1, -1, 1.0])
        middle, paired = self.middle * across, self.paired[:, ::-1] * across
        return replace(self, middle=middle, paired=paired, trunk=self.trunk * trunk)


def signals(motion: Motion) -> Signals:
    """The signals of a recording; InputError where its skeleton has no legs."""
    body, leg = identify(motion.skeleton), leg_length(motion.skeleton)
    places, _ = forward_kinematics(motion)
    facing = np.unwrap(heading_from_positions(motion.skeleton, places))
    moving = _velocity(places, motion.fps)
    hips = body.hips
    at = np.arange(0.0, len(motion) - 1 + 1e-6, motion.fps / RATE)
    rows = np.minimum(np.round(at).astype(int), len(motion) - 1)

    def points(joints: list[int]) -> np.ndarray:
        away = places[rows][:, joints] - places[rows][:, [hips]]
        pace = (moving[rows][:, joints] - moving[rows][:, [hips]]) * _REACH
        turn = -facing[rows][:, None]
        return np.concatenate([turned_about_up(away, turn), turned_about_up(pace, turn)], axis=-1) / leg

    sides = [_points_of(body, limb) for limb in (body.left, body.right)]
    head = body.head_or_neck
    strikes = _strikes(places, moving, body, head, facing)
    return Signals(fps=motion.fps, count=len(motion), frames=at, middle=points([body.chest, head]),
                   paired=np.stack([points(one) for one in sides], axis=1),
                   trunk=_trunk(motion, body, places, moving=moving, facing=facing, leg=leg)[rows], strikes=strikes)


def _points_of(body: Humanoid, limb) -> list[int]:
    """Joints of PAIRED on one side; what a body lacks stands where it would hang."""
    upper = limb.upper_arm if limb.upper_arm is not None else body.chest
    elbow = limb.lower_arm if limb.lower_arm is not None else upper
    return [limb.hand if limb.hand is not None else elbow, elbow, limb.lower_leg, limb.foot, limb.toe_or_foot]


def _trunk(motion, body: Humanoid, places, moving, facing, leg: float) -> np.ndarray:
    """(T, 8) of `Signals.trunk`."""
    hips, top = body.hips, body.neck_or_chest
    height = (places[:, hips, 2] - contacts.ground_height(motion)) / leg
    pace = turned_about_up(moving[:, hips], -facing)
    pace = gaussian_filter1d(pace, max(0.05 * motion.fps, 0.5), axis=0, mode="nearest")
    smooth = gaussian_filter1d(facing, max(0.1 * motion.fps, 0.5), mode="nearest")
    turning = np.gradient(smooth) * motion.fps if len(motion) > 1 else np.zeros(1)
    up = turned_about_up(places[:, top] - places[:, hips], -facing)
    up = unit_vectors(up)
    return np.concatenate([height[:, None], pace, turning[:, None], up], axis=1)


def _strikes(places, moving, body: Humanoid, head: int, facing) -> np.ndarray:
    """(T, 5) of `Signals.strikes`."""
    feet = [body.left.toe_or_foot, body.right.toe_or_foot]
    hands = [_points_of(body, limb)[0] for limb in (body.left, body.right)]
    speed = np.linalg.norm(moving[:, [*feet, *hands]], axis=-1).reshape(len(places), 2, 2).max(axis=2)
    nod = turned_about_up(moving[:, head] - moving[:, body.chest], -facing)[:, 0]
    height = places[:, body.hips, 2]
    return np.concatenate([speed, nod[:, None], height[:, None], -height[:, None]], axis=1)


def _velocity(places: np.ndarray, fps: float) -> np.ndarray:
    """(T, J, 3) m/s of places (T, J, 3) m."""
    if len(places) < 2:
        return np.zeros_like(places)
    return np.gradient(gaussian_filter1d(places, max(_SMOOTH * fps, 0.5), axis=0, mode="nearest"), axis=0) * fps


def windows(signals: Signals) -> np.ndarray:
    """(N, LENGTH) one row a sample; before the first and after the last sample these are held."""
    count = len(signals)
    flat = np.concatenate([part.reshape(count, -1) for part in (signals.middle, signals.paired, signals.trunk)], axis=1)
    around = np.clip(np.arange(count)[:, None] + OFFSETS, 0, count - 1)
    return flat[around].reshape(count, -1)


@dataclass(frozen=True, eq=False)
class Space:
    """Windows reduced to their principal components. mean, scale (LENGTH,): of each; basis (LENGTH, K)."""

    mean: np.ndarray
    scale: np.ndarray
    basis: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, components: int) -> "Space":
        """The space of windows (N, LENGTH), in at most so many components."""
        mean, scale = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-6)
        unit = (rows - mean) / scale
        _, vectors = np.linalg.eigh(unit.T @ unit)
        kept = min(components, len(rows))
        return cls(mean, scale, vectors[:, ::-1][:, :kept].astype(np.float32))

    def within(self, rows: np.ndarray) -> np.ndarray:
        """(N, K) windows (N, LENGTH) in it, of unit variance in all."""
        return (rows - self.mean) / self.scale @ self.basis / np.sqrt(self.basis.shape[0])
