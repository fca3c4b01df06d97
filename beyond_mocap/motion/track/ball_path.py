"""The ball's trajectory over a take: its position over time, and whether that was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class BallPath:
    """The ball at the output's rate.

    Attributes:
        times: (T,) seconds on the track's clock.
        positions: (T, 3) metres, the ball's centre, world.
        measured: (T,) bool.
        rotations: (T, 4) of its body; None where its spin is unknown.
    """

    times: np.ndarray
    positions: np.ndarray
    measured: np.ndarray
    rotations: np.ndarray | None = None
