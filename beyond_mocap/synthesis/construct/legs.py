"""Feet, shins and toes over time, as a ball meets them: what it keeps out of, and where a foot goes."""

from __future__ import annotations

import numpy as np

from ...annotation.striking import Surface, part_surfaces
from ...motion import quaternion
from ...motion.humanoid import heading_from_positions, identify
from ...motion.motion import pose_kinematics
from ...motion.skeleton import Skeleton
from ...motion.track import BALL_RADIUS, zero_phase_hann

SHIN_RADIUS, TIP_RADIUS = 0.05, 0.0
"""Metres about the line of a shin, and about that of the toes beyond their joint, which the ball keeps out of."""

_ROUNDS, _CLOSE = 6, 5e-4

SLOW = 0.6
"""m/s below which a body hardly goes anywhere."""


class Legs:
    """A body over W frames, from its root (W, 3) m and local rotations (W, J, 4).

    feet: their striking surfaces, left and right; lines: both ends (W, 3) m of each. pelvis (W, 2) m; velocity (W, 2)
    m/s and speed (W,) of it without the sway of steps; ahead (W, 2): unit, where it goes, or faces where it hardly
    goes.
    """

    def __init__(self, skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, fps: float):
        places, world = pose_kinematics(skeleton, root, rotations)
        body = identify(skeleton)
        self.fps = fps
        self.pelvis = places[:, body.hips, :2]
        self.feet: tuple[Surface, ...] = part_surfaces(skeleton, "foot")
        self.lines = [foot.line(places, world) for foot in self.feet]
        solid = [(line, foot.radius) for line, foot in zip(self.lines, self.feet)]
        for limb in (body.left, body.right):
            solid.append(((places[:, limb.lower_leg], places[:, limb.foot]), SHIN_RADIUS))
            solid.append((_toes(skeleton, limb, places, world), TIP_RADIUS))
        self.start = np.stack([line[0] for line, _ in solid], axis=1)  # (W, 6, 3)
        self.along = np.stack([line[1] for line, _ in solid], axis=1) - self.start
        self.squared = np.maximum(np.sum(self.along**2, axis=-1), 1e-12)
        self.least = np.array([radius for _, radius in solid]) + BALL_RADIUS
        self.velocity = _smooth_velocity(self.pelvis, fps)
        self.speed = np.linalg.norm(self.velocity, axis=1)
        angle = heading_from_positions(skeleton, places)
        facing = np.column_stack([np.cos(angle), np.sin(angle)])
        going = self.velocity / np.maximum(self.speed, 1e-9)[:, None]
        self.ahead = np.where((self.speed > SLOW)[:, None], going, facing)

    def foot_velocity(self, side: int) -> np.ndarray:
        """(W, 2) m/s of the foot's middle."""
        middle = np.mean(self.lines[side], axis=0)[:, :2]
        return np.gradient(middle, axis=0) * self.fps

    def gaps(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N,) m between balls (N, 3) m at frames (N,) and the nearest part of the body, negative within it."""
        return np.min(self._away(balls, frames)[1], axis=1)

    def kept_out(self, path: np.ndarray, free: np.ndarray) -> np.ndarray:
        """A ball's path (W, 3) m led around the body where it is `free` (W,) bool to go elsewhere."""
        every, aside, free = np.arange(len(path)), np.zeros((len(path), 2)), free[:, None]
        for left in reversed(range(_ROUNDS)):
            out = self.way_out(path + np.pad(aside, ((0, 0), (0, 1))), every) * free
            if np.abs(out).max(initial=0.0) < _CLOSE:
                break
            aside += out
            if left:
                padded = np.pad(aside, ((1, 1), (0, 0)), mode="edge")
                aside = free * (0.25 * padded[:-2] + 0.5 * aside + 0.25 * padded[2:])
        return path + np.pad(aside, ((0, 0), (0, 1)))

    def way_out(self, balls: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(N, 2) m along the ground by which balls (N, 3) m come out of the part of the body that they are deepest
        in."""
        away, gaps = self._away(balls, frames)
        rows, part = np.arange(len(balls)), np.argmin(gaps, axis=1)
        way, level = away[rows, part], np.linalg.norm(away[rows, part, :2], axis=1)
        wanted = np.sqrt(np.maximum(self.least[part] ** 2 - way[:, 2] ** 2, 0.0))
        return way[:, :2] * (np.maximum(wanted - level, 0.0) / np.maximum(level, 1e-6))[:, None]

    def _away(self, balls: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """From the nearest points of all parts to the balls (N, 6, 3) m, and the gaps (N, 6) m."""
        start, along = self.start[frames], self.along[frames]
        to = balls[:, None] - start
        share = np.clip(np.einsum("npk,npk->np", to, along) / self.squared[frames], 0.0, 1.0)
        to -= share[..., None] * along
        return to, np.sqrt(np.einsum("npk,npk->np", to, to)) - self.least


def _toes(skeleton: Skeleton, limb, places, world):
    """Both ends (W, 3) m of what is beyond the toe joint; twice the joint where nothing is."""
    joint = limb.toe if limb.toe is not None else limb.foot
    offset = next((o for p, o in zip(skeleton.end_parents, skeleton.end_offsets) if p == joint), np.zeros(3))
    return places[:, joint], places[:, joint] + quaternion.rotate(world[:, joint], offset)


def _smooth_velocity(places: np.ndarray, fps: float) -> np.ndarray:
    """(W, 2) m/s without the sway of steps."""
    return np.gradient(zero_phase_hann(places, fps, 0.6), axis=0) * fps if len(places) > 2 else np.zeros_like(places)
