"""The ball's samples from a feed: which are filled in, which are wrong, and how much they scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, format_count
from ...base.time_series import find_runs
from ...motion.skeleton import freeze_array
from ...motion.track import BALL_RADIUS

FASTEST_BALL = 45.0  # m/s, well above the hardest kicks (38 m/s)
_FILLED_SECONDS = 0.4  # s: samples on a straight line at constant velocity for so long count as filled in
_SCATTER_WINDOW = 1.2  # s over which the scatter is estimated
_MIN_SCATTER, _MAX_SCATTER = 0.03, 0.35  # m
_OUTLIER_RATIO = 6.0  # times the scatter: an outlier
_FARTHEST = 1e4  # m from the middle; positions beyond are invalid
_MEDIAN_LENGTH = 1.177  # median length of a vector of two standard normal values
_GROUND_HEIGHT = 0.3  # m, heights below this belong to a ball on the ground


@dataclass(frozen=True, eq=False, kw_only=True)
class Samples:
    """N samples of the ball.

    Attributes:
        times: (N,) s, ascending.
        positions: (N, 3) m of its centre, z NaN where the feed has no height.
        known: (N,) bool, x and y are finite.
        filled: (N,) bool, filled in by the feed at constant velocity.
        outlier: (N,) bool, single samples far from both neighbours.
        scatter: (N,) m, standard deviation of x and of y.
        interval: s, the usual step.
    """

    times: np.ndarray
    positions: np.ndarray
    known: np.ndarray
    filled: np.ndarray
    outlier: np.ndarray
    scatter: np.ndarray
    interval: float

    @property
    def is_used(self) -> np.ndarray:
        """(N,) bool: known and no outlier."""
        return self.known & ~self.outlier

    @property
    def is_measured(self) -> np.ndarray:
        """(N,) bool: used and not filled in."""
        return self.is_used & ~self.filled


def build_samples(times: np.ndarray, ball: np.ndarray, where: str = "ball") -> Samples:
    """Build the samples of a feed.

    Samples whose time is not finite, or not after the previous one, are left out.

    Args:
        times: (N,) s.
        ball: (N, 3) m, NaN where unknown.
        where: what error messages name.
    Returns:
        The samples.
    Raises:
        InputError: if fewer than five samples have a position.
    """
    times, ball = np.asarray(times, float), np.asarray(ball, float)
    ball = np.where(np.abs(ball) < _FARTHEST, ball, np.nan)
    keep = np.isfinite(times)
    highest = np.maximum.accumulate(np.where(keep, times, -np.inf))
    keep[1:] &= times[1:] > highest[:-1]
    times, ball = times[keep], ball[keep]
    known = np.isfinite(ball[:, :2]).all(axis=1)
    if np.count_nonzero(known) < 5:
        raise InputError(where, f"{format_count(np.count_nonzero(known), 'sample')} of the ball", "at least five",
                         "choose a feed with a ball and ascending times, or a longer part of it")
    interval = float(np.median(np.diff(times)))
    filled = _detect_filled(ball[:, :2], known, interval)
    scatter = _estimate_scatter(ball[:, :2], interval)
    outlier = _detect_outliers(times, ball[:, :2], known, scatter)
    known, filled, outlier = (freeze_array(flag, bool) for flag in (known, filled & known, outlier))
    return Samples(times=freeze_array(times), positions=freeze_array(_shift_to_centre(ball)), known=known,
                   filled=filled, outlier=outlier, scatter=freeze_array(scatter), interval=interval)


def _shift_to_centre(ball: np.ndarray) -> np.ndarray:
    """Shift heights to the ball's centre: some feeds give 0 for a ball on the ground."""
    low = ball[:, 2][ball[:, 2] < _GROUND_HEIGHT]
    lies_at_zero = len(low) > 0 and np.median(low) < BALL_RADIUS / 2.0
    return ball + [0.0, 0.0, BALL_RADIUS] if lies_at_zero else ball


def estimate_quantum(points: np.ndarray) -> float:
    """Estimate the step m to which a feed rounds: the least difference of neighbouring values (N, k), at most 0.1."""
    steps = np.abs(np.diff(points, axis=0))
    steps = steps[np.isfinite(steps) & (steps > 1e-6)]
    return float(min(steps.min(initial=0.1), 0.1))


def _detect_filled(points: np.ndarray, known: np.ndarray, interval: float) -> np.ndarray:
    """Detect samples (N,) bool in stretches no measurement produces: straight and even to within the rounding."""
    count = max(5, round(_FILLED_SECONDS / interval) + 1)
    if len(points) < count:
        return np.zeros(len(points), bool)
    tolerance = max(1.01 * estimate_quantum(points[known]), 1e-3)
    windows = np.lib.stride_tricks.sliding_window_view(points, count, axis=0)  # (N - count + 1, 2, count)
    first, last = windows[..., :1], windows[..., -1:]
    chord = first + (last - first) * np.linspace(0.0, 1.0, count)
    straight = np.nan_to_num(np.abs(windows - chord).max(axis=(1, 2)), nan=np.inf) <= tolerance
    moves = np.linalg.norm((last - first)[..., 0], axis=1) > 5.0 * tolerance
    # +1 where a straight window starts, -1 after its end: the cumulative sum counts the windows over each sample.
    inside = np.zeros(len(points) + 1, int)
    begins = np.flatnonzero(straight & moves)
    np.add.at(inside, begins, 1)
    np.add.at(inside, begins + count, -1)
    return np.cumsum(inside[:-1]) > 0


def _estimate_scatter(points: np.ndarray, interval: float) -> np.ndarray:
    """Estimate the standard deviation (N,) m of x and of y of points (N, 2) m.

    From second differences: their median over a window around each sample.
    """
    from scipy.ndimage import median_filter

    count = len(points)
    bends = np.full(count, np.nan)
    bends[1:-1] = np.linalg.norm(np.diff(points, 2, axis=0), axis=1)
    there = np.flatnonzero(np.isfinite(bends))
    if len(there) < 3:
        return np.full(count, _MIN_SCATTER)
    middle = median_filter(bends[there], max(7, 2 * round(_SCATTER_WINDOW / interval / 2) + 1), mode="nearest")
    found = np.interp(np.arange(count), there, middle) / (_MEDIAN_LENGTH * np.sqrt(6.0))
    return np.clip(found, _MIN_SCATTER, _MAX_SCATTER)


def _detect_outliers(times: np.ndarray, points: np.ndarray, known: np.ndarray, scatter: np.ndarray) -> np.ndarray:
    """Detect samples (N,) bool that no ball can reach from either side, or that deviate alone between smooth
    neighbours.
    """
    outlier = np.zeros(len(points), bool)
    there = np.flatnonzero(known)
    at, when = points[there], times[there]
    if len(there) < 5:
        return outlier
    step = np.linalg.norm(np.diff(at, axis=0), axis=1) / np.diff(when)
    jump = (step[:-1] > FASTEST_BALL) & (step[1:] > FASTEST_BALL)
    over = np.linalg.norm(at[2:] - at[:-2], axis=1) / (when[2:] - when[:-2])
    outlier[there[1:-1]] = jump & (over < FASTEST_BALL)
    around = np.stack([at[:-4], at[1:-3], at[3:-1], at[4:]])  # the two before and the two after
    share = np.array([-2.0, -1.0, 1.0, 2.0])
    middle = around.mean(axis=0)
    slope = np.tensordot(share, around, 1) / 10.0
    neighbour_residual = np.linalg.norm(around - middle - share[:, None, None] * slope, axis=2).max(axis=0)
    deviation = np.linalg.norm(at[2:-2] - middle, axis=1)
    limit = np.maximum(_OUTLIER_RATIO * scatter[there[2:-2]], 0.4)
    outlier[there[2:-2]] |= (deviation > limit) & (deviation > 4.0 * neighbour_residual)
    for first, end in find_runs(outlier):
        if end - first > 3:
            outlier[first:end] = False  # not single samples: the feed follows something else
    return outlier
