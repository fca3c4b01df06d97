"""A body that follows a path, as seen from above: where it is when, also if it set out later or made a detour."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.time_series import interpolate
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from .detour import headings, left_of, offsets, round_offsets

_SPACING = 0.1  # metres between the places at which the path is taken
_PIECES = 24  # of a detour, when its length is taken


@dataclass(frozen=True)
class Change:
    """What is asked of a follower. delay: seconds for which it waits where it begins. detours: ((arc, width, offset),
    ...) in metres along its path as it was, see `detour`."""

    delay: float = 0.0
    detours: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Follower:
    """One body without any change.

    times (T,): seconds, rising, the same clock for all. places (T, 3): metres on the ground. path: what it follows;
    None: something that cannot be asked to give way. arc (T,): metres it has gone along the path. by_arc: whether it
    keeps its speed, so that a detour makes it come later; else it is where its path's parameter says.
    """

    name: str
    times: np.ndarray
    places: np.ndarray
    path: Path | None = None
    arc: np.ndarray | None = None
    by_arc: bool = True

    @cached_property
    def way(self) -> "Way":
        """The path, seen from above."""
        return Way(self.path)

    @cached_property
    def beside(self) -> np.ndarray:
        """(T, 3) metres from the path to the body."""
        return self.places - self.way.places_at(self.arc)

    @cached_property
    def speed(self) -> float:
        """Metres per second along the path, as a rule where it moves."""
        seconds = np.maximum(np.diff(self.times), 1e-9)
        speeds = np.linalg.norm(np.diff(self.places[:, :2], axis=0), axis=1) / seconds
        moving = speeds[speeds > 0.2]
        return float(np.percentile(moving, 80)) if len(moving) else 0.0

    def at(self, times: np.ndarray, change: Change = Change()) -> np.ndarray:
        """Places (N, 3) at these times (N,); before its first and after its last time it stands."""
        times = times - change.delay
        if self.path is None or not change.detours:
            return interpolate(times, self.times, self.places)
        arc = np.interp(times, self.times, self.arc)
        beside = interpolate(times, self.times, self.beside)
        return beside + self.way.with_detours_at(arc, change.detours, self.by_arc)

    def with_more(self, times: np.ndarray, change: Change, train) -> np.ndarray:
        """Places (A, N, 3) with A trains of more detours: quickly, to a few millimetres. train: detours whose numbers
        are arrays (A, 1)."""
        times, way = times - change.delay, self.way
        arc = way.on_it(np.interp(times, self.times, self.arc), change.detours, self.by_arc)[None]
        old = way.aside(arc, change.detours)
        aside = old + way.aside(arc, train)
        if self.by_arc:
            arc = arc - way.extra(arc[0], aside) + way.extra(arc[0], old)
            aside = way.aside(arc, (*change.detours, *train))
        arc, shape = np.broadcast_to(arc, aside.shape).ravel(), (*aside.shape, 3)
        places = interpolate(arc, way.arc, way.places) + aside.reshape(-1, 1) * interpolate(arc, way.arc, way.left)
        return places.reshape(shape) + interpolate(times, self.times, self.beside)

    def arc_at(self, time: float, change: Change = Change()) -> float:
        """Metres along the path as it was at a time."""
        arc = np.interp([time - change.delay], self.times, self.arc)
        return float(self.way.on_it(arc, change.detours, self.by_arc)[0])


class Way:
    """A path as places `spacing` apart, with the directions beside it."""

    def __init__(self, path: Path):
        length = ArcLength(path)
        self.length, self.closed, self.tables = length.length, path.closed, {}
        count = max(int(np.ceil(self.length / _SPACING)), 8)
        self.arc = np.linspace(0.0, self.length, count + 1) if self.length else np.zeros(1)
        self.places = path.at(length.parameter(self.arc))
        heading = headings(self.places, self.arc[1], self.closed) if self.length else np.zeros(1)
        self.left = left_of(heading)
        self.bend = np.gradient(heading, self.arc) if self.length else np.zeros(1)

    def places_at(self, arc: np.ndarray) -> np.ndarray:
        """Places (N, 3) on the path at arc lengths (N,)."""
        return interpolate(self._within(arc, self.length), self.arc, self.places)

    def with_detours_at(self, arc: np.ndarray, detours, by_arc: bool) -> np.ndarray:
        """Places (N, 3) on the path with detours; arc as in `on_it`."""
        arc = self.on_it(arc, detours, by_arc)
        aside = interpolate(arc, self.arc, self.left) * self.aside(arc, detours)[:, None]
        return interpolate(arc, self.arc, self.places) + aside

    def on_it(self, arc: np.ndarray, detours, by_arc: bool) -> np.ndarray:
        """Arc lengths (N,) on the path as it was, of whoever has gone `arc` (N,) metres with the detours."""
        if not by_arc or not detours:
            return self._within(arc, self.length)
        if detours not in self.tables:
            self.tables[detours] = self._gone(detours)
        at, gone = self.tables[detours]
        return np.interp(self._within(arc, gone[-1]), gone, at)

    def _gone(self, detours):
        """Places (K,) along the path as it was, and the metres (K,) gone with the detours up to there."""
        low = np.array([[middle - 0.5 * width] for middle, width, _ in detours])
        wide = np.array([[width] for _, width, _ in detours])
        at = (low + wide * np.linspace(0.0, 1.0, _PIECES + 1)).ravel()
        at = np.unique(np.concatenate([[0.0, self.length], self._within(at, self.length)]))
        aside = self.aside(at, detours)
        along = 1.0 - 0.5 * (aside[1:] + aside[:-1]) * np.interp(0.5 * (at[1:] + at[:-1]), self.arc, self.bend)
        step = np.hypot(np.diff(at) * along, np.diff(aside))
        return at, np.concatenate([[0.0], np.cumsum(step)])

    def extra(self, arc: np.ndarray, aside: np.ndarray) -> np.ndarray:
        """Metres (A, N) gone beyond those of the path at arc lengths (N,), since the first of them; aside: (A, N)."""
        step = np.diff(arc)
        bend = np.interp(0.5 * (arc[1:] + arc[:-1]), self.arc, self.bend)
        along = step * (1.0 - 0.5 * (aside[:, 1:] + aside[:, :-1]) * bend)
        more = np.where(step > 0.0, np.hypot(along, np.diff(aside, axis=1)) - step, 0.0)
        return np.concatenate([np.zeros((len(aside), 1)), np.cumsum(more, axis=1)], axis=1)

    def aside(self, arc: np.ndarray, detours) -> np.ndarray:
        """Metres (N,) to the left."""
        return round_offsets(arc, detours, self.length) if self.closed else offsets(arc, detours)

    def _within(self, arc, length):
        return arc % length if self.closed and length else np.clip(arc, 0.0, length)
