"""A limb led along the smallest smooth shift of its path that gives it another place and another velocity at one
instant, and how its end really follows.

Of all shifts s(t) that are nothing outside a window, the one with the least integral of |s|^2 + SOFT^4 |s''|^2: it
swings in and out of itself within some hundredths of a second and has no corner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..motion.motion import Motion
from ..synthesis.construct.carry import Body, Resting, limb_carried
from .letting_go import AtFoot, InHand, carried

Hold = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""From local rotations (W, C, 4) of a limb's joints, and from those before they were changed, to those that it can
have."""
_NUDGE = np.array([0.005, 0.005, 0.005, 0.2, 0.2, 0.2])  # m, m/s, by which a limb is tried
SOFT = 0.05
"""s: how long a shift takes; shorter ones are smaller and more sudden."""


@dataclass(frozen=True, eq=False)
class Shifts:
    """All smallest shifts about one instant. frames: (N,) int that may be moved. rows: (N, 2): shift of each frame for
    a place 1 m away, and for a velocity 1 m/s more. cost: (2, 2) m^2 for places (m) and velocities (m/s), per axis."""

    frames: np.ndarray
    rows: np.ndarray
    cost: np.ndarray

    def of(self, place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """(N, 3) m: the shifts for another place (3,) m and another velocity (3,) m/s."""
        return self.rows @ np.stack([place, velocity])


def shifts_about(at: float, first: int, last: int, fps: float) -> Shifts:
    """The shifts about the fractional frame `at`, which are nothing before frame `first` and after frame `last`."""
    from scipy.interpolate import CubicSpline

    frames = np.arange(first, last + 1)
    count = len(frames)
    second = np.diff(np.eye(count + 4), 2, axis=0)[:, 2:-2] * fps**2
    usual = 2.0 * np.sqrt(2.0) * SOFT * fps  # so that a place alone costs its square
    energy = (np.eye(count) + SOFT**4 * second.T @ second) / usual
    padded = np.arange(first - 2, last + 3)
    spline = CubicSpline(padded, np.eye(len(padded)))
    tells = np.stack([spline(at), fps * spline(at, 1)])[:, 2:-2]
    spread = np.linalg.solve(energy, tells.T)
    cost = np.linalg.inv(tells @ spread)
    return Shifts(frames, spread @ cost, cost)


@dataclass(frozen=True, eq=False, kw_only=True)
class LedLimb:
    """A motion whose limb is led along shifted paths: `window`, the body at the frames of the shifts, and its limb as
    it rests. hold: keeps joints within their limits, None where they have none."""

    motion: Motion
    part: InHand | AtFoot
    shifts: Shifts
    window: Body
    limb: Resting
    hold: Hold | None = None

    @classmethod
    def of(cls, motion: Motion, part: InHand | AtFoot, shifts: Shifts, hold: Hold | None = None) -> LedLimb:
        """The limb of a motion."""
        first, last = shifts.frames[0], shifts.frames[-1] + 1
        body = Body.posed(motion.skeleton, motion.root_positions[first:last], motion.rotations[first:last])
        return cls(motion=motion, part=part, shifts=shifts, window=body, limb=Resting.of(body, part.chain(motion)),
                   hold=hold)

    def shifted(self, change: np.ndarray) -> Motion:
        """The motion with another place and velocity (6,) of the part at the release."""
        if not np.any(change):
            return self.motion
        rotations = self.motion.rotations.copy()
        moves, chain = self.shifts.of(change[:3], change[3:]), list(self.limb.chain)
        led = limb_carried(self.window, self.limb, moves)
        if self.hold is not None:
            led[:, chain] = self.hold(led[:, chain], self.window.rotations[:, chain])
        rotations[self.shifts.frames] = led
        return replace(self.motion, rotations=rotations)

    def follows(self, change: np.ndarray, frame: float, points, velocities) -> tuple[np.ndarray, np.ndarray]:
        """(6, K, 3) each: by how much the part's points and their velocities really move for each m and m/s that is
        asked of them, beside a change (6,) that brings them to `points` and `velocities` (1, K, 3)."""
        found = []
        for number, nudge in enumerate(np.diag(_NUDGE)):
            near = carried(self.part, self.shifted(change + nudge), np.array([frame]))
            found.append([(new - old)[0] / _NUDGE[number] for new, old in zip(near, (points, velocities))])
        return tuple(np.swapaxes(np.array(found), 0, 1))


def at_once(count: int) -> tuple[np.ndarray, np.ndarray]:
    """`LedLimb.follows` of K points that do just what is asked."""
    both = np.repeat(np.eye(6)[:, None, :], count, axis=1)
    return both[..., :3], both[..., 3:]
