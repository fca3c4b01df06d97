"""A body that follows a path, as seen from above: where it is when, also if it set out later or made a detour."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..motion.arc_length import ArcLength
from ..motion.path import Path
from .detour import headings, offsets, right_of, round_offsets

_SPACING = 0.1  # metres between the places at which the path is taken


@dataclass(frozen=True)
class Change:
    """What is asked of a follower. delay: seconds for which it waits where it begins. detours: ((arc, width, offset), ...)
    in metres along its path as it was, see `detour`."""

    delay: float = 0.0
    detours: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Follower:
    """One body without any change.

    times (T,): seconds, rising, the same clock for all. places (T, 3): metres on the ground. path: what it follows; None:
    something that cannot be asked to give way. arc (T,): metres it has gone along the path. by_arc: whether it keeps its
    speed, so that a detour makes it come later; else it is where its path's parameter says.
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
            return _sampled(times, self.times, self.places)
        arc = np.interp(times, self.times, self.arc)
        beside = _sampled(times, self.times, self.beside)
        return beside + self.way.with_detours_at(arc, change.detours, self.by_arc)

    def arc_at(self, time: float, change: Change = Change()) -> float:
        """Metres along the path as it was at a time."""
        arc = np.interp([time - change.delay], self.times, self.arc)
        return float(self.way.on_it(arc, change.detours, self.by_arc)[0])


class Way:
    """A path as places `spacing` apart, with the directions beside it."""

    def __init__(self, path: Path):
        length = ArcLength(path)
        self.length, self.closed = length.length, path.closed
        count = max(int(np.ceil(self.length / _SPACING)), 8)
        self.arc = np.linspace(0.0, self.length, count + 1) if self.length else np.zeros(1)
        self.places = path.at(length.parameter(self.arc))
        heading = headings(self.places, self.arc[1], self.closed) if self.length else np.zeros(1)
        self.right = right_of(heading)
        self.bend = np.gradient(heading, self.arc) if self.length else np.zeros(1)

    def places_at(self, arc: np.ndarray) -> np.ndarray:
        """Places (N, 3) on the path at arc lengths (N,)."""
        return _sampled(self._within(arc, self.length), self.arc, self.places)

    def with_detours_at(self, arc: np.ndarray, detours, by_arc: bool) -> np.ndarray:
        """Places (N, 3) on the path with detours; arc as in `on_it`."""
        arc = self.on_it(arc, detours, by_arc)
        aside = _sampled(arc, self.arc, self.right) * self.aside(arc, detours)[:, None]
        return _sampled(arc, self.arc, self.places) + aside

    def on_it(self, arc: np.ndarray, detours, by_arc: bool) -> np.ndarray:
        """Arc lengths (N,) on the path as it was, of whoever has gone `arc` (N,) metres with the detours."""
        if not by_arc or not detours:
            return self._within(arc, self.length)
        gone = self._gone(detours)
        return np.interp(self._within(arc, gone[-1]), gone, self.arc)

    def _gone(self, detours) -> np.ndarray:
        """Metres (K,) gone with the detours at the places of the path."""
        aside = self.aside(self.arc, detours)
        along = 1.0 + 0.5 * (aside[1:] + aside[:-1]) * 0.5 * (self.bend[1:] + self.bend[:-1])
        step = np.hypot(np.diff(self.arc) * along, np.diff(aside))
        return np.concatenate([[0.0], np.cumsum(step)])

    def aside(self, arc: np.ndarray, detours) -> np.ndarray:
        """Metres (N,) to the right."""
        return round_offsets(arc, detours, self.length) if self.closed else offsets(arc, detours)

    def _within(self, arc, length):
        return arc % length if self.closed and length else np.clip(arc, 0.0, length)


def _sampled(at: np.ndarray, grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """values (T, 3) on a rising grid (T,), linearly between, at (N,)."""
    before = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, max(len(grid) - 2, 0))
    after = np.minimum(before + 1, len(grid) - 1)
    width = grid[after] - grid[before]
    share = np.divide(at - grid[before], width, out=np.zeros(len(at)), where=width > 0)
    share = np.clip(share, 0.0, 1.0)[:, None]
    return values[before] * (1.0 - share) + values[after] * share
