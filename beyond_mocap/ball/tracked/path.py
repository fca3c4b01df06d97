"""The solved path of the ball: pieces between the moments in which its course changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.easing import hermite
from ...motion.skeleton import frozen_array


@dataclass(frozen=True, eq=False, kw_only=True)
class BallPiece:
    """The ball between two changes of its course.

    times: (n,) s, n >= 2, from its start to its end; positions (n, 3) m of the centre and velocities (n, 3) m/s then.
    kind: "flight", "roll" or "still". spin: (3,) rad/s at its start.
    residual: m, root mean square over the ground to the measured samples, NaN where there are none. bounces: (k,) s."""

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    kind: str
    spin: np.ndarray
    residual: float
    bounces: np.ndarray

    def __post_init__(self):
        for name in ("times", "positions", "velocities", "spin", "bounces"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))

    @property
    def start(self) -> float:
        """Seconds."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Seconds."""
        return float(self.times[-1])


@dataclass(frozen=True, eq=False)
class SolvedPath:
    """Pieces one after the other; before the first and after the last the ball rests where they begin and end, and
    where none is in between it goes straight and evenly from one to the next."""

    pieces: tuple[BallPiece, ...]

    @cached_property
    def _knots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        names = ("times", "positions", "velocities")
        return tuple(np.concatenate([getattr(piece, name) for piece in self.pieces]) for name in names)

    @cached_property
    def _begins(self) -> np.ndarray:
        """The numbers of the knots at which pieces begin."""
        return np.cumsum([0, *(len(piece.times) for piece in self.pieces[:-1])])

    def at(self, times: np.ndarray) -> np.ndarray:
        """(N, 3) m, the ball's centre at `times` (N,) s."""
        return self._hermite(np.asarray(times, float), False)

    def velocity(self, times: np.ndarray) -> np.ndarray:
        """(N, 3) m/s at `times` (N,) s; in the moment of a touch, the velocity after it."""
        return self._hermite(np.asarray(times, float), True)

    def _hermite(self, at: np.ndarray, slope: bool) -> np.ndarray:
        times, places, speeds = self._knots
        after = np.clip(np.searchsorted(times, at, "right"), 1, len(times) - 1)
        before = after - 1
        step = (times[after] - times[before])[:, None]
        safe = np.maximum(step, 1e-9)
        share = np.clip((at - times[before])[:, None] / safe, 0.0, 1.0)
        p, q = places[before], places[after]
        nowhere = np.isin(after, self._begins)[:, None]
        m, n = (np.where(nowhere, q - p, speeds[knot] * step) for knot in (before, after))
        if not slope:
            return hermite(share, p, m, q, n)
        rising = 6 * share - 6 * share**2
        out = rising * (q - p) + (3 * share**2 - 4 * share + 1) * m + (3 * share**2 - 2 * share) * n
        inside = (at >= times[0]) & (at <= times[-1])
        return np.where(inside[:, None], np.where(step > 1e-9, out / safe, speeds[after]), 0.0)

    def residuals(self, times: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(N,) m over the ground from points (N, 2 or 3) seen at `times` (N,) s; NaN where a point is."""
        return np.linalg.norm(self.at(times)[:, :2] - np.asarray(points)[:, :2], axis=1)
