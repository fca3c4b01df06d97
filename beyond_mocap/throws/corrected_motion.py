"""A throw or kick whose ball hits, and what may be changed for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.motion import Motion

_FINE_MISS, _SMALL_DISPLACEMENT = 0.02, 0.05  # m of miss and of wrist or ankle up to which nothing else is tried


@dataclass(frozen=True)
class Freedom:
    """What may be changed besides wrist or ankle, each to either side.

    Attributes:
        rotation: rad, rotation about the start.
        pace: share of the playback rate.
        release: s.
        start_position: the body may begin at another position, so that its foot reaches a ball at a given position.
    """

    rotation: float = np.radians(15.0)
    pace: float = 0.15
    release: float = 0.02
    start_position: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class CorrectedMotion:
    """A motion whose ball hits.

    Attributes:
        motion: the motion.
        frame: fractional frame at which the ball leaves.
        position: (3,) m of the ball then.
        velocity: (3,) m/s of the ball then.
        spin: (3,) rad/s of the ball then.
        seconds: s until it is at the target.
        miss: m between ball and target then.
        displacement: m, largest displacement of the wrist or ankle.
        shift: (T, 3) m, displacement of the wrist or ankle in each frame.
        rotation: rad by which the body was rotated about its start.
        pace: factor of the playback rate.
        release_delay: s by which the release was moved, at that pace.
        start_offset: m by which the start was moved.
        gap: m between foot and ball, 0 for throws.
        tilt: rad by which the foot was pointed before.
    """

    motion: Motion
    frame: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    seconds: float
    miss: float
    displacement: float
    shift: np.ndarray
    rotation: float
    pace: float
    release_delay: float
    start_offset: float = 0.0
    gap: float = 0.0
    tilt: float = 0.0

    @property
    def total_miss(self) -> float:
        """Total miss (m): at the target, and between foot and ball."""
        return self.miss + self.gap

    @property
    def is_small(self) -> bool:
        """Whether the ball hits although wrist or ankle was hardly moved."""
        return self.total_miss < _FINE_MISS and self.displacement < _SMALL_DISPLACEMENT

    @property
    def cost(self) -> float:
        """Cost (m), by which corrections are compared."""
        return self.total_miss + 0.2 * self.displacement
