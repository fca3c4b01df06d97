"""Move the path of a limb's end so that it has another position and velocity at one instant.

Of all shifts s(t) that are zero outside a window, the one with the smallest integral of |s|^2 + SHIFT_TIME^4 |s''|^2 is
chosen: it begins and ends within some hundredths of a second without a corner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..motion.motion import Motion
from ..synthesis.construct.move_body_part import Body, LimbReference, move_limb
from .ball_release import AtFoot, InHand, sample_points_and_velocities

LimitRotations = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function that limits rotations: from local rotations (W, C, 4) of a limb's joints and the original ones to allowed
ones.
"""
_NUDGE = np.array([0.005, 0.005, 0.005, 0.2, 0.2, 0.2])  # m and m/s, steps of numerical derivatives
SHIFT_TIME = 0.05
"""s: time scale of a shift; shorter ones are smaller and more sudden."""


@dataclass(frozen=True, eq=False)
class Shifts:
    """All optimal shifts about one instant.

    Attributes:
        frames: (N,) int, frames that may be moved.
        rows: (N, 2), shift of each frame for a position offset of 1 m, and for a velocity change of 1 m/s.
        cost: (2, 2) m^2 for positions (m) and velocities (m/s), per axis.
    """

    frames: np.ndarray
    rows: np.ndarray
    cost: np.ndarray

    def compute_shift(self, place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Compute the shifts (N, 3) m for an offset of the position (3,) m and of the velocity (3,) m/s."""
        return self.rows @ np.stack([place, velocity])


def solve_shifts(at: float, first: int, last: int, fps: float) -> Shifts:
    """Compute the shifts about the fractional frame `at`, zero before frame `first` and after frame `last`."""
    from scipy.interpolate import CubicSpline

    frames = np.arange(first, last + 1)
    count = len(frames)
    # second differences of the frames, with two zero frames on either side
    second_differences = np.diff(np.eye(count + 4), 2, axis=0)[:, 2:-2] * fps**2
    normalization = 2.0 * np.sqrt(2.0) * SHIFT_TIME * fps  # normalisation: a position offset alone costs its square
    energy = (np.eye(count) + SHIFT_TIME**4 * second_differences.T @ second_differences) / normalization
    padded = np.arange(first - 2, last + 3)
    spline = CubicSpline(padded, np.eye(len(padded)))
    # rows that evaluate the shift's spline and its derivative at `at`; the optimum satisfies both as constraints
    constraints = np.stack([spline(at), fps * spline(at, 1)])[:, 2:-2]
    response = np.linalg.solve(energy, constraints.T)
    cost = np.linalg.inv(constraints @ response)
    return Shifts(frames, response @ cost, cost)


@dataclass(frozen=True, eq=False, kw_only=True)
class ShiftedLimb:
    """A motion whose limb follows shifted paths.

    Attributes:
        motion: the motion.
        part: hand or foot that releases the ball.
        shifts: possible shifts.
        window: the body in the frames of the shifts.
        limb: its limb at rest.
        limit_rotations: limits the joints, None if they have no limits.
    """

    motion: Motion
    part: InHand | AtFoot
    shifts: Shifts
    window: Body
    limb: LimbReference
    limit_rotations: LimitRotations | None = None

    @classmethod
    def from_motion(cls, motion: Motion, part: InHand | AtFoot, shifts: Shifts, limit_rotations: LimitRotations
                    | None = None) -> ShiftedLimb:
        """Build the limb of a motion."""
        first, last = shifts.frames[0], shifts.frames[-1] + 1
        body = Body.from_pose(motion.skeleton, motion.root_positions[first:last], motion.rotations[first:last])
        return cls(motion=motion, part=part, shifts=shifts, window=body,
                   limb=LimbReference.from_body(body, part.list_joints(motion)), limit_rotations=limit_rotations)

    def shift_motion(self, change: np.ndarray) -> Motion:
        """Shift the limb by a change (6,) of position (m) and velocity (m/s) at the release; return the motion."""
        if not np.any(change):
            return self.motion
        rotations = self.motion.rotations.copy()
        shifts, chain = self.shifts.compute_shift(change[:3], change[3:]), list(self.limb.chain)
        shifted_rotations = move_limb(self.window, self.limb, shifts)
        if self.limit_rotations is not None:
            shifted_rotations[:, chain] = self.limit_rotations(shifted_rotations[:, chain],
                                                               self.window.rotations[:, chain])
        rotations[self.shifts.frames] = shifted_rotations
        return replace(self.motion, rotations=rotations)

    def measure_response(self, change: np.ndarray, frame: float, points, velocities) -> tuple[np.ndarray, np.ndarray]:
        """Measure how the limb really responds to requested changes.

        Args:
            change: (6,) present change.
            frame: fractional frame of the release.
            points: (1, K, 3) m with that change.
            velocities: (1, K, 3) m/s with that change.
        Returns:
            Derivatives (6, K, 3) of points and velocities with respect to each requested m and m/s.
        """
        found = []
        for number, nudge in enumerate(np.diag(_NUDGE)):
            near = sample_points_and_velocities(self.part, self.shift_motion(change + nudge), np.array([frame]))
            found.append([(new - old)[0] / _NUDGE[number] for new, old in zip(near, (points, velocities))])
        return tuple(np.swapaxes(np.array(found), 0, 1))


def build_exact_response(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of `ShiftedLimb.measure_response` for K points that follow exactly."""
    both = np.repeat(np.eye(6)[:, None, :], count, axis=1)
    return both[..., :3], both[..., 3:]
