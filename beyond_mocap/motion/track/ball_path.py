"""The ball's path over a take: where it is at which time, and whether that was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class BallPath:
    """The ball at the output's rate: times (T,) s on the track's clock, positions (T, 3) m of its centre, measured (T,)
    bool; rotations (T, 4) of its body, None where nobody knows how it turns."""

    times: np.ndarray
    positions: np.ndarray
    measured: np.ndarray
    rotations: np.ndarray | None = None
