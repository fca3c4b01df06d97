"""A plan between two times of its track: the same order, on the same clock, of a shorter stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...annotation import Timeline
from ...motion.track import Track
from ...synthesis.plan import Plan, SolvedCourse

_BEYOND = 0.5
"""Seconds of the ball's course that are kept beyond both ends."""

_SAME = 1e-9


def cut_plan(plan: Plan, start: float, end: float) -> Plan:
    """The plan from `start` to `end` seconds, both within its track.

    The track's first sample is at `start` and its last at `end`; where the feed has none then, it lies on the line
    between its neighbours. Key moments and pins outside are left out; spans are kept whole where they reach into it.
    """
    inside = [key for key in plan.timeline.keys if start <= key.in_force <= end]
    spans = [span for span in plan.timeline.spans if span.start < end and span.end > start]
    return replace(
        plan,
        track=cut_track(plan.track, start, end),
        timeline=Timeline(tuple(spans), tuple(inside)),
        pins=tuple(pin for pin in plan.pins if pin.time <= end and pin.end >= start),
        solved=None if plan.solved is None else _cut_course(plan.solved, start - _BEYOND, end + _BEYOND),
    )


def cut_track(track: Track, start: float, end: float) -> Track:
    """The samples from `start` to `end` seconds, with one at each of them."""
    inside = track.times[(track.times > start + _SAME) & (track.times < end - _SAME)]
    times = np.concatenate([[start], inside, [end]])
    before = np.clip(np.searchsorted(track.times, times + _SAME, side="right") - 1, 0, len(track) - 1)
    after = np.clip(np.searchsorted(track.times, times - _SAME), 0, len(track) - 1)
    return Track(
        times,
        _between(track.times, track.positions, times, before, after),
        _between(track.times, track.ball, times, before, after),
        ball_height_known=track.ball_height_known[before] & track.ball_height_known[after],
        filled=track.filled[before] | track.filled[after],
        outlier=track.outlier[before] | track.outlier[after],
        name=track.name,
    )


def _between(known: np.ndarray, values: np.ndarray, times: np.ndarray, before: np.ndarray, after: np.ndarray):
    """(K, n): values (N, n) at known times (N,) on the line between the samples `before` (K,) and `after` (K,); the
    very values where there is a sample."""
    step = known[after] - known[before]
    share = np.where(step > 0.0, (times - known[before]) / np.where(step > 0.0, step, 1.0), 0.0)[:, None]
    return np.where(share == 0.0, values[before], values[before] * (1.0 - share) + values[after] * share)


def _cut_course(course: SolvedCourse, start: float, end: float) -> SolvedCourse:
    low = max(int(np.searchsorted(course.times, start)) - 1, 0)
    part = slice(low, int(np.searchsorted(course.times, end)) + 1)
    touches = tuple(touch for touch in course.touches if start <= touch.time <= end)
    return SolvedCourse(course.times[part], course.ball[part], course.filled[part], touches)
