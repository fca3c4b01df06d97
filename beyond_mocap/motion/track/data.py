"""The samples of one tracked player and the ball, as a feed delivers them (`Track`) and at an even rate
(`SampledTrack`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...base.time_series import find_runs
from ..skeleton import freeze_array

BALL_RADIUS = 0.11
"""Metres; where a feed gives no height, the ball's centre lies this high."""

_MAX_BALL_DISTANCE = 200.0  # metres from the pitch's centre beyond which a ball position is invalid


@dataclass(frozen=True, eq=False)
class Track:
    """One player's samples, N of them. Arrays are read-only copies.

    Attributes:
        times: (N,) seconds.
        positions: (N, 2) metres on the pitch, origin its centre, x along its length, y to the left of +x.
        ball: (N, 3) metres, the ball's centre, NaN where unknown (z alone may be unknown); None means no ball.
        ball_height_known: (N,) bool, False where the feed has no height; None means wherever z is a number.
        filled: (N,) bool, inserted by `clean_track` because the feed had nothing; None means none.
        outlier: (N,) bool, replaced by `clean_track` because the feed was wrong; None means none.
        name: who this is, for messages.
    """

    times: np.ndarray
    positions: np.ndarray
    ball: np.ndarray | None = None
    ball_height_known: np.ndarray | None = None
    filled: np.ndarray | None = None
    outlier: np.ndarray | None = None
    name: str = "track"

    def __post_init__(self):
        times = freeze_array(self.times).reshape(-1)
        count = len(times)
        arrays = {
            "positions": (self.positions, (count, 2), float),
            "ball": (np.full((count, 3), np.nan) if self.ball is None else self.ball, (count, 3), float),
            "filled": (np.zeros(count, bool) if self.filled is None else self.filled, (count,), bool),
            "outlier": (np.zeros(count, bool) if self.outlier is None else self.outlier, (count,), bool),
        }
        if self.ball_height_known is None:
            known = np.isfinite(np.asarray(arrays["ball"][0], dtype=float)[..., -1])
        else:
            known = self.ball_height_known
        arrays["ball_height_known"] = (known, (count,), bool)
        object.__setattr__(self, "times", times)
        for name, (values, shape, kind) in arrays.items():
            array = freeze_array(values, kind)
            if array.shape != shape:
                raise InputError(self.name, f"{name} of shape {array.shape}", f"{shape}")
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.times)

    @property
    def is_measured(self) -> np.ndarray:
        """(N,) bool: valid positions that the feed itself has."""
        return ~(self.filled | self.outlier) & np.isfinite(self.positions).all(axis=1)

    @cached_property
    def known_ball(self) -> tuple[np.ndarray, np.ndarray]:
        """Seconds (K,) at which the ball is known on the ground, and its places (K, 2) m there."""
        known = np.isfinite(self.ball[:, :2]).all(axis=1)
        return self.times[known], self.ball[known, :2]

    @property
    def interval(self) -> float:
        """Median seconds from one sample to the next."""
        steps = np.diff(np.unique(self.times[np.isfinite(self.times)]))
        return float(np.median(steps)) if len(steps) else np.nan


@dataclass(frozen=True, eq=False, kw_only=True)
class SampledTrack:
    """A track at an even rate, T frames; frame 0 is the track's first time. Arrays are read-only.

    Attributes:
        times: (T,) seconds on the track's clock.
        positions: (T, 2) metres, smoothed, pitch frame.
        raw: (T, 2) metres, the measured samples linearly interpolated (the reference for errors).
        velocity: (T, 2) m/s of the smoothed positions.
        speed: (T,) m/s.
        direction: (T,) radians from +x, of travel, unwrapped; constant while the player does not move.
        valid: (T,) bool, False within a long gap, where it is unknown what the player did (which is not standing
            still).
        ball: (T, 3) metres, NaN where there is no ball at all.
        ball_measured: (T,) bool, False between samples too far apart.
        fps: frames per second.
        heading: (T,) rad from +x where the body should face, None where that is not planned.
        held: (T,) from 0 to 1, how far that heading is given rather than planned, None for nowhere.
        leeway: (T,) m that a slow body may stay off the positions, None where those are not relaxed.
    """

    times: np.ndarray
    positions: np.ndarray
    raw: np.ndarray
    velocity: np.ndarray
    speed: np.ndarray
    direction: np.ndarray
    valid: np.ndarray
    ball: np.ndarray
    ball_measured: np.ndarray
    fps: float
    heading: np.ndarray | None = None
    held: np.ndarray | None = None
    leeway: np.ndarray | None = None

    def __post_init__(self):
        for name in ("times", "positions", "raw", "velocity", "speed", "direction", "ball"):
            object.__setattr__(self, name, freeze_array(getattr(self, name)))
        for name in ("valid", "ball_measured"):
            object.__setattr__(self, name, freeze_array(getattr(self, name), bool))
        for name in ("heading", "held", "leeway"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, freeze_array(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.times)

    def frames(self, start: int, stop: int) -> "SampledTrack":
        """Return frames start .. stop-1."""
        arrays = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "fps"}
        return SampledTrack(**{name: None if values is None else values[start:stop] for name, values in arrays.items()},
                            fps=self.fps)


def is_ball_sentinel(ball: np.ndarray) -> np.ndarray:
    """Mark known ball samples that are no position of a ball: z below the ground, far outside, or parked at the origin.

    Args:
        ball: (N, 3) metres, NaN where unknown.
    Returns:
        (N,) bool.
    """
    is_known = np.isfinite(ball[:, :2]).all(axis=1)
    with np.errstate(invalid="ignore"):
        return is_known & ((np.abs(ball) > _MAX_BALL_DISTANCE).any(axis=1) | (ball[:, 2] < -1.0)
                           | _is_parked_at_origin(ball))


def _is_parked_at_origin(ball: np.ndarray) -> np.ndarray:
    """Mark runs (N,) of three or more samples exactly at (0, 0) that the ball did not roll into or out of."""
    zero = (ball[:, :2] == 0.0).all(axis=1)
    out = np.zeros(len(ball), dtype=bool)
    for start, stop in find_runs(zero):
        beside = [i for i in (start - 1, stop) if 0 <= i < len(ball) and np.isfinite(ball[i, :2]).all()]
        out[start:stop] = stop - start >= 3 and all(np.linalg.norm(ball[i, :2]) > 1.5 for i in beside)
    return out
