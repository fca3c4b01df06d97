"""The ball's samples as a feed has them: which are filled in, which are wrong, and how far they scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.time_series import runs
from ...motion.skeleton import frozen_array
from ...motion.track import BALL_RADIUS

FASTEST_BALL = 45.0  # m/s, well above the hardest kicks (38 m/s)
_STRAIGHT = 0.4  # seconds that must be straight at constant velocity to be called filled in
_SCATTER_WINDOW = 1.2  # seconds over which the scatter is taken
_LEAST_SCATTER, _MOST_SCATTER = 0.03, 0.35  # m
_WRONG = 6.0  # times the scatter
_FARTHEST = 1e4  # m from the middle; beyond is no place
_MEDIAN_LENGTH = 1.177  # of vectors of two normal values
_LOW = 0.3  # m, of a ball on the ground


@dataclass(frozen=True, eq=False, kw_only=True)
class Samples:
    """N samples of the ball.

    times: (N,) s, growing. positions: (N, 3) m of its centre, z NaN where the feed has no height; known (N,) bool,
    whether x and y are numbers. filled: (N,) bool, made by the feed at constant velocity. outlier: (N,) bool, single
    samples far from both neighbours. scatter: (N,) m, standard deviation of x and of y around it. interval: s, the
    usual step."""

    times: np.ndarray
    positions: np.ndarray
    known: np.ndarray
    filled: np.ndarray
    outlier: np.ndarray
    scatter: np.ndarray
    interval: float

    @property
    def used(self) -> np.ndarray:
        """(N,) bool: known and not wrong."""
        return self.known & ~self.outlier

    @property
    def measured(self) -> np.ndarray:
        """(N,) bool: used and not filled in."""
        return self.used & ~self.filled


def read_samples(times: np.ndarray, ball: np.ndarray, where: str = "ball") -> Samples:
    """The samples of a feed: times (N,) s, ball (N, 3) m, NaN where unknown.

    Samples whose time is no number, or not after the one before, are left out. InputError where fewer than five have a
    place."""
    times, ball = np.asarray(times, float), np.asarray(ball, float)
    ball = np.where(np.abs(ball) < _FARTHEST, ball, np.nan)
    keep = np.isfinite(times)
    highest = np.maximum.accumulate(np.where(keep, times, -np.inf))
    keep[1:] &= times[1:] > highest[:-1]
    times, ball = times[keep], ball[keep]
    known = np.isfinite(ball[:, :2]).all(axis=1)
    if np.count_nonzero(known) < 5:
        raise InputError(where, f"{np.count_nonzero(known)} samples of the ball", "at least five",
                         "choose a feed with a ball, times that rise, or more seconds of it")
    interval = float(np.median(np.diff(times)))
    filled = _filled(ball[:, :2], known, interval)
    scatter = _scatter(ball[:, :2], interval)
    outlier = _outliers(times, ball[:, :2], known, scatter)
    known, filled, outlier = (frozen_array(flag, bool) for flag in (known, filled & known, outlier))
    return Samples(times=frozen_array(times), positions=frozen_array(_centred(ball)), known=known, filled=filled,
                   outlier=outlier, scatter=frozen_array(scatter), interval=interval)


def _centred(ball: np.ndarray) -> np.ndarray:
    """The same with heights of the ball's centre: some feeds say 0 for a ball on the ground."""
    low = ball[:, 2][ball[:, 2] < _LOW]
    lies_at_zero = len(low) > 0 and np.median(low) < BALL_RADIUS / 2.0
    return ball + [0.0, 0.0, BALL_RADIUS] if lies_at_zero else ball


def quantum(points: np.ndarray) -> float:
    """The step (m) to which a feed rounds: the least difference of neighbouring values (N, k), at most 0.1."""
    steps = np.abs(np.diff(points, axis=0))
    steps = steps[np.isfinite(steps) & (steps > 1e-6)]
    return float(min(steps.min(initial=0.1), 0.1))


def _filled(points: np.ndarray, known: np.ndarray, interval: float) -> np.ndarray:
    """(N,) bool: within a stretch that no measurement makes: straight and even to within the rounding."""
    count = max(5, round(_STRAIGHT / interval) + 1)
    if len(points) < count:
        return np.zeros(len(points), bool)
    tolerance = max(1.01 * quantum(points[known]), 1e-3)
    windows = np.lib.stride_tricks.sliding_window_view(points, count, axis=0)  # (N - count + 1, 2, count)
    first, last = windows[..., :1], windows[..., -1:]
    chord = first + (last - first) * np.linspace(0.0, 1.0, count)
    straight = np.nan_to_num(np.abs(windows - chord).max(axis=(1, 2)), nan=np.inf) <= tolerance
    moves = np.linalg.norm((last - first)[..., 0], axis=1) > 5.0 * tolerance
    inside = np.zeros(len(points) + 1, int)
    begins = np.flatnonzero(straight & moves)
    np.add.at(inside, begins, 1)
    np.add.at(inside, begins + count, -1)
    return np.cumsum(inside[:-1]) > 0


def _scatter(points: np.ndarray, interval: float) -> np.ndarray:
    """(N,) standard deviation of x and of y of points (N, 2), from second differences: the middle one over a window
    around each."""
    from scipy.ndimage import median_filter

    count = len(points)
    bends = np.full(count, np.nan)
    bends[1:-1] = np.linalg.norm(np.diff(points, 2, axis=0), axis=1)
    there = np.flatnonzero(np.isfinite(bends))
    if len(there) < 3:
        return np.full(count, _LEAST_SCATTER)
    middle = median_filter(bends[there], max(7, 2 * round(_SCATTER_WINDOW / interval / 2) + 1), mode="nearest")
    found = np.interp(np.arange(count), there, middle) / (_MEDIAN_LENGTH * np.sqrt(6.0))
    return np.clip(found, _LEAST_SCATTER, _MOST_SCATTER)


def _outliers(times: np.ndarray, points: np.ndarray, known: np.ndarray, scatter: np.ndarray) -> np.ndarray:
    """(N,) bool: samples that no ball can reach from either side, or that stick out alone between quiet neighbours."""
    wrong = np.zeros(len(points), bool)
    there = np.flatnonzero(known)
    at, when = points[there], times[there]
    if len(there) < 5:
        return wrong
    step = np.linalg.norm(np.diff(at, axis=0), axis=1) / np.diff(when)
    jump = (step[:-1] > FASTEST_BALL) & (step[1:] > FASTEST_BALL)
    over = np.linalg.norm(at[2:] - at[:-2], axis=1) / (when[2:] - when[:-2])
    wrong[there[1:-1]] = jump & (over < FASTEST_BALL)
    around = np.stack([at[:-4], at[1:-3], at[3:-1], at[4:]])  # the two before and the two after
    share = np.array([-2.0, -1.0, 1.0, 2.0])
    middle = around.mean(axis=0)
    slope = np.tensordot(share, around, 1) / 10.0
    off = np.linalg.norm(around - middle - share[:, None, None] * slope, axis=2).max(axis=0)
    out = np.linalg.norm(at[2:-2] - middle, axis=1)
    limit = np.maximum(_WRONG * scatter[there[2:-2]], 0.4)
    wrong[there[2:-2]] |= (out > limit) & (out > 4.0 * off)
    for first, end in runs(wrong):
        if end - first > 3:
            wrong[first:end] = False  # not single samples: the feed has gone elsewhere
    return wrong
