"""A track at an even rate, smoothed as its noise needs (Faustino §4.2.3: time scaling, orientation, speed)."""

from __future__ import annotations

import numpy as np

from ...base.errors import InputError, format_count
from ...base.time_series import interpolate_columns
from ...base.vectors import arctan2, measure_lengths
from .data import BALL_RADIUS, SampledTrack, Track

SMOOTHING_SECONDS = 1.2
"""Length of the smoothing window of `smooth_positions`."""

GAP_INTERVALS = 3.0
"""More than this many sample intervals without a measured sample is a gap."""

LONG_GAP = 1.0
"""Seconds; in a longer gap it is unknown what the player did."""

MOVING_SPEED = 0.5
"""m/s; below it a direction of travel is mostly noise."""

_TURN_SECONDS = 0.5  # in which a player at rest turns before setting off
_MAX_SECONDS = 6 * 3600.0  # s


def sample_track(track: Track, fps: float, window: float = SMOOTHING_SECONDS) -> SampledTrack:
    """Sample a cleaned track at an even rate: floor(duration * fps) + 1 frames from its first time on.

    The ball is interpolated linearly, constant before its first and after its last sample, and no lower than its
    radius, which is also its height where the feed has none.

    Args:
        track: a cleaned track.
        fps: frames per second, 1 to 480.
        window: seconds of the smoothing window.
    Returns:
        The sampled track.
    Raises:
        InputError: with fewer than two measured samples, or for a track longer than six hours.
    """
    times, fine_times, step = _build_time_grids(track, fps)
    positions = smooth_positions(interpolate_columns(fine_times, track.times, track.positions), fps * step,
                                 window)[::step]
    measured = track.is_measured
    velocity = np.broadcast_to((positions[-1] - positions[0]) * fps, positions.shape)  # of one or two frames
    if len(times) > 2:
        velocity = np.gradient(positions, 1.0 / fps, axis=0, edge_order=2)
    speed = measure_lengths(velocity)
    ball, ball_measured = _sample_ball(track, times)
    return SampledTrack(
        times=times, positions=positions, raw=interpolate_columns(times, track.times[measured],
                                                                  track.positions[measured]), velocity=velocity,
        speed=speed, direction=compute_travel_direction(velocity, fps),
        valid=_is_within_gap(times, track.times[measured], max(GAP_INTERVALS * track.interval, LONG_GAP)), ball=ball,
        ball_measured=ball_measured, fps=float(fps),
    )


def smooth_positions(positions: np.ndarray, fps: float, window: float = SMOOTHING_SECONDS) -> np.ndarray:
    """Smooth positions without the feed's jitter: a Hann window whose bias is corrected twice.

    One pass of a window pulls curves inward by half its variance times the acceleration (0.037 s^2 for 1.5 s: 15 cm at
    4 m/s^2). Smoothing the residual and adding it back removes that up to the fourth derivative; twice, up to the
    sixth. Measured on five real tracks of 20-25 Hz, difference of the 1.5 s Hann windows of result and samples, mean /
    95 %: Hann 0.7 s alone 1.6 / 3.9 cm; 0.7 s corrected once 0.08 / 0.22 cm, but rms jerk 16 m/s^3; this one 0.18 / 0.5
    cm and jerk 10 m/s^3; a smoothing spline of the same jerk 0.2 / 0.5 cm, but 2-3 cm at the ends. The window also has
    an end: an edit changes nothing beyond 1.8 s, bit for bit, which a spline cannot promise.

    Args:
        positions: (T, k).
        fps: frames per second.
        window: seconds.
    Returns:
        (T, k).
    """
    out = smooth_zero_phase_hann(positions, fps, window)
    for _ in range(2):
        out = out + smooth_zero_phase_hann(positions - out, fps, window)
    return out


def smooth_zero_phase_hann(values: np.ndarray, fps: float, seconds: float) -> np.ndarray:
    """Smooth values with a symmetric Hann window; the ends are point-reflected.

    Point reflection continues x beyond its last value e as 2 e - x backwards, so ends stay and keep their slope.

    Args:
        values: (T, k).
        fps: frames per second.
        seconds: length of the window.
    Returns:
        (T, k).
    """
    values = np.asarray(values, dtype=float)
    half = max(int(np.ceil(seconds * fps / 2.0 - 1e-9)) - 1, 0)
    if half == 0 or len(values) < 2:
        return values.copy()
    window = 0.5 + 0.5 * np.cos(2.0 * np.pi * np.arange(-half, half + 1) / (fps * seconds))
    padded = _continue_ends(values, half)
    return np.stack([np.convolve(column, window / window.sum(), "valid") for column in padded.T], axis=1)


def _continue_ends(values: np.ndarray, count: int) -> np.ndarray:
    """Continue values (T, k) by `count` rows at both ends, point-reflected."""
    if count >= len(values):
        return np.pad(values, ((count, count), (0, 0)), mode="reflect", reflect_type="odd")
    before, behind = values[count:0:-1], values[-2 : -count - 2 : -1]
    return np.concatenate([2.0 * values[:1] - before, values, 2.0 * values[-1:] - behind])


def compute_travel_direction(velocity: np.ndarray, fps: float) -> np.ndarray:
    """Compute the direction of travel, held while the player is slower than MOVING_SPEED.

    Slower frames keep the direction before them, and turn to the next one in the last half second before it: a player
    at rest does not spin with the noise and does not snap round when setting off. If all are slow, it is the direction
    of the fastest frame, 0 if none moves.

    Args:
        velocity: (T, 2) m/s.
        fps: frames per second.
    Returns:
        (T,) radians from +x, unwrapped.
    """
    speed = measure_lengths(velocity)
    moving = np.flatnonzero(speed >= min(MOVING_SPEED, speed.max(initial=0.0)))
    if not len(moving) or not speed.any():
        return np.zeros(len(velocity))
    angles = np.unwrap(arctan2(velocity[moving, 1], velocity[moving, 0]))
    frames = np.arange(len(velocity))
    # indices into `moving` of the last moving frame before each frame and of the next one after it
    before = np.clip(np.searchsorted(moving, frames, side="right") - 1, 0, None)
    after = np.clip(np.searchsorted(moving, frames), None, len(moving) - 1)
    pause = np.maximum(moving[after] - moving[before], 1)
    remaining = np.clip((moving[after] - frames) / np.minimum(_TURN_SECONDS * fps, pause), 0.0, 1.0)
    return angles[after] + (angles[before] - angles[after]) * remaining * remaining * (3.0 - 2.0 * remaining)


def _build_time_grids(track: Track, fps: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Build the frame times, the times of a finer grid of at least 50 Hz (the window needs many), and its steps per
    frame.
    """
    if not 1.0 <= fps <= 480.0:
        raise InputError("fps", f"{fps}", "1 to 480 frames per second")
    if np.count_nonzero(track.is_measured) < 2 or not np.all(np.diff(track.times) > 0):
        raise InputError(track.name, format_count(np.count_nonzero(track.is_measured), "usable sample"),
                         "two or more, cleaned")
    duration = track.times[-1] - track.times[0]
    if duration > _MAX_SECONDS:
        raise InputError(track.name, f"{duration:.0f} s", "at most six hours", "cut the track")
    step = int(np.ceil(50.0 / fps))
    count = int(np.floor(duration * fps + 1e-6)) + 1
    fine = track.times[0] + np.arange((count - 1) * step + 1) / (fps * step)
    return fine[::step], fine, step


def _is_within_gap(at: np.ndarray, times: np.ndarray, longest: float) -> np.ndarray:
    """Whether `at` (len(at),) is at a time of `times` (N,) or between two of them no more than `longest` seconds apart.
    """
    after = np.clip(np.searchsorted(times, at - 1e-9), 0, len(times) - 1)
    before = np.clip(np.searchsorted(times, at + 1e-9, side="right") - 1, 0, len(times) - 1)
    covered = (at >= times[before] - 1e-6) & (at <= times[after] + 1e-6)
    return covered & (times[after] - times[before] <= longest + 1e-9)


def _sample_ball(track: Track, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample the ball at the times `at` (T,): positions (T, 3) m and whether each is measured (T,)."""
    seen = np.isfinite(track.ball[:, :2]).all(axis=1)
    if not seen.any():
        return np.full((len(at), 3), np.nan), np.zeros(len(at), dtype=bool)
    times = track.times[seen]
    height = np.where(track.ball_height_known[seen], track.ball[seen, 2], BALL_RADIUS)
    ball = interpolate_columns(at, times, np.column_stack([track.ball[seen, :2], np.maximum(height, BALL_RADIUS)]))
    return ball, _is_within_gap(at, times, GAP_INTERVALS * track.interval)
