"""Tracks that were drawn instead of measured: a line on the ground with speeds at its points, followed in even samples.

Between two points the acceleration is constant: the square of the speed changes evenly along the line, which lets a
player start from rest and come to rest. A point with speed 0 is a stop.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.errors import InputError
from ...base.settings.synthesis import MAX_SPEED
from ...base.time_series import interpolate_columns
from .data import Track

SAMPLE_RATE = 25.0  # samples a second of a track from a drawn line

MIN_LENGTH = 0.2
"""Minimum length of a drawn line, metres."""

MAX_SECONDS = 3600.0  # a longer track is a mistake, and would fill the memory


def build_line_track(
    line: np.ndarray, arc: Sequence[float], speeds: Sequence[float], waits: Sequence[float], start: float = 0.0,
    name: str = "track",
) -> Track:
    """Build the track of a player who follows a line.

    Samples are 1 / SAMPLE_RATE s apart, nearly: the first and the last are the line's ends.

    Args:
        line: (N, 2) metres, dense enough that its corners do not show.
        arc: (P,) metres along the line of the P points, rising, the first 0 and the last the line's length.
        speeds: (P,) m/s at the points.
        waits: (P,) seconds that are spent where the speed is 0.
        start: seconds of the first sample.
        name: for messages.
    Returns:
        The track.
    Raises:
        InputError: for a line that is too short, two stops in a row, or speeds that are invalid or beyond MAX_SPEED.
    """
    line, arc, speeds, waits = (np.asarray(values, dtype=float) for values in (line, arc, speeds, waits))
    _check_line(line, arc, speeds, name)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line_distance = np.concatenate([[0.0], np.cumsum(steps)])
    gaps = np.diff(arc)
    pauses = np.where(speeds > 0.0, 0.0, np.maximum(waits, 0.0))
    seconds = 2.0 * gaps / (speeds[:-1] + speeds[1:])
    arrive = np.concatenate([[0.0], np.cumsum(seconds + pauses[:-1])])
    leave = arrive + pauses
    if not leave[-1] <= MAX_SECONDS:
        raise InputError(name, f"a duration of {leave[-1]:.0f} s", "an hour at most", "raise the speeds at its points")
    count = max(int(round(leave[-1] * SAMPLE_RATE)), 5)
    times = np.linspace(0.0, leave[-1], count + 1)
    at = np.clip(np.searchsorted(arrive, times, side="right") - 1, 0, len(gaps) - 1)
    # seconds since leaving the last point, 0 while waiting there; then s = s0 + v t + a t^2 / 2
    elapsed = np.clip(times - leave[at], 0.0, seconds[at])
    acceleration = (speeds[at + 1] - speeds[at]) / seconds[at]
    distance = np.clip(arc[at] + speeds[at] * elapsed + 0.5 * acceleration * elapsed**2, 0.0, line_distance[-1])
    places = interpolate_columns(distance, line_distance, line[:, :2])
    return Track(times + start, places, name=name)


def build_moving_track(times: np.ndarray, places: np.ndarray, name: str = "track") -> Track:
    """Build the track of an animated object.

    Args:
        times: (N,) seconds.
        places: (N, 2) metres on the ground.
        name: for messages.
    Returns:
        The track, at SAMPLE_RATE samples a second.
    Raises:
        InputError: if it moves for less than 0.2 s or faster than MAX_SPEED.
    """
    times, places = np.asarray(times, dtype=float), np.asarray(places, dtype=float)
    if len(times) < 2 or times[-1] - times[0] < 0.2:
        raise InputError(name, "moves for less than 0.2 s", "an animated object", "add keyframes or a longer range")
    count = max(int(round((times[-1] - times[0]) * SAMPLE_RATE)), 5)
    even = np.linspace(times[0], times[-1], count + 1)
    places = interpolate_columns(even, times, places)
    fastest = np.linalg.norm(np.diff(places, axis=0), axis=1).max() / (even[1] - even[0])
    if not fastest <= MAX_SPEED:
        raise InputError(name, f"moves at {fastest:.1f} m/s", f"{MAX_SPEED:g} m/s at most", "slow it down")
    return Track(even, places, name=name)


def sample_nurbs(
    points: np.ndarray, weights: np.ndarray, order: int, clamped: bool, pieces_per_point: int
) -> tuple[np.ndarray, np.ndarray]:
    """Sample a NURBS curve with even knots.

    Args:
        points: (P, 3) control points.
        weights: (P,).
        order: degree plus one.
        clamped: whether it starts and ends in its first and last point.
        pieces_per_point: pieces for each control point except one.
    Returns:
        The line (N, 3), and (P,) the sample where each control point has most influence: at the mean of its knots.
    """
    from scipy.interpolate import BSpline

    count, degree = len(points), min(order, len(points)) - 1
    if clamped:
        knots = np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, count - degree + 1), np.ones(degree)])
    else:
        knots = np.arange(count + degree + 1, dtype=float)
    means = np.array([knots[i + 1 : i + 1 + degree].mean() for i in range(count)])
    means = (means - means[0]) / (means[-1] - means[0])  # unclamped, its first point still marks the beginning
    pieces = pieces_per_point * (count - 1)
    at = np.linspace(knots[degree], knots[count], pieces + 1)
    values = BSpline(knots, np.column_stack([points * weights[:, None], weights]), degree)(at)
    return values[:, :3] / values[:, 3:], np.round(means * pieces).astype(int)


def _check_line(line: np.ndarray, arc: np.ndarray, speeds: np.ndarray, name: str) -> None:
    """Check that the line is long enough and its speeds and points are valid (InputError)."""
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) if len(line) > 1 else 0.0
    if not length >= MIN_LENGTH or len(arc) < 2:
        raise InputError(name, f"{length:.2f} m long", f"{MIN_LENGTH:g} m or more", "draw it longer")
    if not np.all(np.isfinite(speeds)) or np.any(speeds < 0.0):
        raise InputError(name, "an invalid speed", "0 m/s or more", "set the speeds of its points")
    if speeds.max() > MAX_SPEED:
        raise InputError(name, f"{speeds.max():.1f} m/s", f"{MAX_SPEED:g} m/s at most", "lower the speed of that point")
    stops = np.flatnonzero((speeds[:-1] == 0.0) & (speeds[1:] == 0.0))
    if len(stops):
        found = f"speed 0 at both points {stops[0] + 1} and {stops[0] + 2}: no player gets from one to the other"
        raise InputError(name, found, "a speed at one of them", "set the speed of the points")
    if np.any(np.diff(arc) <= 0.0):
        raise InputError(name, "two points at the same position", "points apart from each other", "delete one of them")
