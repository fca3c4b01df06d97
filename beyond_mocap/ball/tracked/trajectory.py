"""The solved trajectory of the ball: pieces between the moments its direction or speed changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.easing import hermite
from ...motion.skeleton import freeze_array


@dataclass(frozen=True, eq=False, kw_only=True)
class BallPiece:
    """The ball between two changes of its trajectory.

    Attributes:
        times: (n,) s, n >= 2, from start to end.
        positions: (n, 3) m of the centre.
        velocities: (n, 3) m/s.
        kind: "flight", "roll" or "still".
        spin: (3,) rad/s at the start.
        residual: m, horizontal root mean square to the measured samples, NaN if there are none.
        bounces: (k,) s.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    kind: str
    spin: np.ndarray
    residual: float
    bounces: np.ndarray

    def __post_init__(self):
        for name in ("times", "positions", "velocities", "spin", "bounces"):
            object.__setattr__(self, name, freeze_array(getattr(self, name)))

    @property
    def start(self) -> float:
        """s of its first moment."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """s of its last moment."""
        return float(self.times[-1])


@dataclass(frozen=True, eq=False)
class SolvedTrajectory:
    """Pieces in order of time.

    Before the first and after the last piece the ball rests; in a gap between two pieces it moves straight at constant
    speed.

    Attributes:
        pieces: the pieces.
    """

    pieces: tuple[BallPiece, ...]

    @cached_property
    def _knots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        names = ("times", "positions", "velocities")
        return tuple(np.concatenate([getattr(piece, name) for piece in self.pieces]) for name in names)

    @cached_property
    def _is_start(self) -> np.ndarray:
        """Whether each knot is the first of its piece."""
        found = np.zeros(len(self._knots[0]), bool)
        found[np.cumsum([0, *(len(piece.times) for piece in self.pieces[:-1])])] = True
        return found

    def at(self, times: np.ndarray) -> np.ndarray:
        """Give the positions (N, 3) m of the ball's centre at `times` (N,) s."""
        return self._interpolate_hermite(np.asarray(times, float), False)

    def velocity(self, times: np.ndarray) -> np.ndarray:
        """Give the velocities (N, 3) m/s at `times` (N,) s; at a touch, the velocity after it."""
        return self._interpolate_hermite(np.asarray(times, float), True)

    def _interpolate_hermite(self, at: np.ndarray, slope: bool) -> np.ndarray:
        """Interpolate positions, or with `slope` velocities, between the knots by cubic Hermite polynomials."""
        times, places, speeds = self._knots
        after = np.clip(np.searchsorted(times, at, "right"), 1, len(times) - 1)
        before = after - 1
        step = (times[after] - times[before])[:, None]
        safe = np.maximum(step, 1e-9)
        share = np.clip((at - times[before])[:, None] / safe, 0.0, 1.0)
        p, q = places[before], places[after]
        in_gap = self._is_start[after][:, None]
        m, n = (np.where(in_gap, q - p, speeds[knot] * step) for knot in (before, after))
        if not slope:
            return hermite(share, p, m, q, n)
        rising = 6 * share - 6 * share**2
        out = rising * (q - p) + (3 * share**2 - 4 * share + 1) * m + (3 * share**2 - 2 * share) * n
        inside = (at >= times[0]) & (at <= times[-1])
        return np.where(inside[:, None], np.where(step > 1e-9, out / safe, speeds[after]), 0.0)

    def residuals(self, times: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Give the horizontal distances (N,) m to `points` (N, 2 or 3) m at `times` (N,) s; NaN where a point is
        NaN.
        """
        return np.linalg.norm(self.at(times)[:, :2] - np.asarray(points)[:, :2], axis=1)
