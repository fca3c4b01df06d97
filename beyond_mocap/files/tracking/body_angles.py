"""Headings from the angles of bodies that some feeds have.

What such an angle is measured from, and which way it grows, is not documented: both are found from the players who run,
since these face where they go.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import arctan2
from ...motion import quaternion

_RUNNING = 2.5  # m/s from which on players face where they go
_FEWEST = 100  # samples of players who run
_AGREEMENT = 0.8  # least mean cosine between heading and travel
_MOST_RADIANS = 2.0 * np.pi  # of the median; larger ones are degrees
_MARGIN = 0.1  # by which the next best reading agrees less
_READINGS = [(sign, 0.5 * np.pi * quarter) for sign in (1.0, -1.0) for quarter in range(4)]


def find_headings(times: np.ndarray, positions: np.ndarray, angles: np.ndarray,
                  periods: list[tuple[float, float, int, float]]) -> tuple[np.ndarray, list[str]]:
    """Find where bodies face.

    Args:
        times: (N,) s.
        positions: (P, N, 2) m, NaN where absent.
        angles: (P, N) of the feed, rad or degrees, NaN where not known.
        periods: start and end s, number and seconds before (`match_arrays.build_clock`) of each period, which has a
            reading of its own: halves may have been turned.
    Returns:
        (P, N) rad from +x to the left, NaN where not known; and lines for people.
    """
    headings, lines = np.full(angles.shape, np.nan), []
    is_known = np.isfinite(angles)
    if is_known.any() and np.median(np.abs(angles[is_known])) > _MOST_RADIANS:
        angles = np.radians(angles)
        lines.append("angles of bodies are taken as degrees")
    velocity = np.gradient(positions, times, axis=1)
    is_running = (np.linalg.norm(velocity, axis=2) > _RUNNING) & is_known
    travel = arctan2(velocity[..., 1], velocity[..., 0])
    for start, end, number, _ in periods:
        part = slice(*np.searchsorted(times, [start - 1e-6, end + 1e-6]))
        shown = is_running[:, part]
        reading = _find_reading(angles[:, part][shown], travel[:, part][shown])
        if reading is None:
            lines.append(f"period {number}: angles of bodies are not used, because players who run do not show what "
                         "they are measured from")
            continue
        headings[:, part] = quaternion.wrap_angle(reading[0] * angles[:, part] + reading[1])
        lines.append(f"period {number}: bodies face where their angles say")
    return headings, lines


def _find_reading(angles: np.ndarray, travel: np.ndarray) -> tuple[float, float] | None:
    """Find sign and zero, rad, by which angles (K,) agree with the travel (K,); None where that is not clear."""
    if len(angles) < _FEWEST:
        return None
    agreement = [float(np.cos(sign * angles + zero - travel).mean()) for sign, zero in _READINGS]
    best, second = np.argsort(agreement)[::-1][:2]
    if agreement[best] < _AGREEMENT or agreement[best] - agreement[second] < _MARGIN:
        return None
    return _READINGS[best]
