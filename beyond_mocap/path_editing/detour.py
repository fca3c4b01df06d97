"""Local detours of a path, and where a body that follows the path is at a time, with a delay or a detour.

A detour is (arc, width, offset) in metres: its middle along the original path, the length of path that it covers, and
how far the path moves to the left (right: negative) at the middle. It rises and falls by the quintic step 6 q^5 - 15
q^4 + 10 q^3, whose slope and curvature vanish at both ends, so that the path stays C2. Detours add up.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.errors import InputError
from ..base.time_series import interpolate_columns
from ..base.vectors import arctan2
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path, SplinePath

RISE = 0.4
"""Share of a detour's width in which it leaves the path, and in which it returns to it."""
_STEP = 0.1  # metres between samples when a path is rebuilt with its detours
_HEADING_METRES = 0.3  # metres over which the lateral direction is smoothed, so that the offset of a corner has no loop

_SPACING = 0.1  # metres between the samples of a `SampledPath`
_PIECES = 24  # pieces into which a detour is divided to measure its length


def compute_offsets(arc: np.ndarray, detours) -> np.ndarray:
    """Compute the lateral offset of a path with detours.

    Args:
        arc: (..., N) metres along the original path.
        detours: (middle, width, offset) of each detour, metres; each number may be an array (..., 1).
    Returns:
        (..., N) metres to the left.
    """
    total = 0.0 * arc
    for middle, width, offset in detours:
        rest = np.minimum(np.maximum((0.5 * width - np.abs(arc - middle)) / (RISE * width), 0.0), 1.0)
        total = total + offset * rest**3 * (10.0 + rest * (6.0 * rest - 15.0))
    return total


def compute_closed_offsets(arc: np.ndarray, detours, length: float) -> np.ndarray:
    """Compute the lateral offset on a closed path, where a detour continues across the place at which the path closes.

    Args:
        arc: (N,) metres along the original path.
        detours: as in `compute_offsets`.
        length: metres of the closed path.
    Returns:
        (N,) metres to the left.
    """
    return sum((compute_offsets(arc + shift * length, detours) for shift in (-1.0, 0.0, 1.0)), np.zeros(()))


def compute_detour_width(offset, speed: float):
    """Compute how much of the path a comfortable detour covers.

    Its curvature stays below that of a radius of 4 m, and its lateral acceleration below 1.5 m/s^2.

    Args:
        offset: metres to the side, a number or an array.
        speed: metres per second of the body.
    Returns:
        Metres of path, at least 1.5, in the shape of `offset`.
    """
    bend = min(0.25, 1.5 / max(speed, 0.1) ** 2)
    most = 10.0 / np.sqrt(3.0)  # the quintic step's largest bend
    return np.maximum(1.5, np.sqrt(most * np.abs(offset) / bend) / RISE)


def compute_headings(places: np.ndarray, spacing: float, closed: bool = False) -> np.ndarray:
    """Compute the smoothed heading along a line of evenly spaced places.

    Where the line goes straight up or down, the heading is interpolated from before and after.

    Args:
        places: (N, 3) metres.
        spacing: metres between two places.
        closed: whether the last place is the first one again.
    Returns:
        (N,) radians, unwrapped yaw.
    """
    along = np.gradient(places, axis=0)
    if closed:
        along[0] = along[-1] = 0.5 * (places[1] - places[-2])
    return _smooth_headings(_compute_raw_headings(along, spacing), _HEADING_METRES / spacing, closed)


def compute_left(heading: np.ndarray) -> np.ndarray:
    """Compute the horizontal unit vectors to the left of a heading.

    Args:
        heading: (N,) radians, yaw.
    Returns:
        (N, 3) unit vectors.
    """
    return np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=-1)


def _compute_raw_headings(along, spacing):
    """Compute the unwrapped yaw (N,) of tangents (N, 3), interpolated where they have no horizontal part."""
    level = np.hypot(along[:, 0], along[:, 1]) > 1e-3 * spacing
    if not level.any():
        return np.zeros(len(along))
    yaw = np.unwrap(arctan2(along[level, 1], along[level, 0]))
    return np.interp(np.arange(len(along)), np.flatnonzero(level), yaw)


def _smooth_headings(heading, sigma, closed):
    """Smooth a yaw (N,) by a Gaussian of `sigma` samples; closed: the last sample is the first one again."""
    reach = int(np.ceil(3.0 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    count = len(heading)
    if closed and count > reach + 1:
        turn = 2.0 * np.pi * np.round((heading[-1] - heading[0]) / (2.0 * np.pi))
        padded = np.concatenate([heading[-1 - reach : -1] - turn, heading, heading[1 : reach + 1] + turn])
    else:  # point reflection at the ends keeps the heading there
        far = np.minimum(np.arange(1, reach + 1), count - 1)
        before, after = 2 * heading[0] - heading[far[::-1]], 2 * heading[-1] - heading[count - 1 - far]
        padded = np.concatenate([before, heading, after])
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def add_detours(path: Path, detours) -> Path:
    """Build the path with its detours, C2 as before and under the same parameters.

    The ends move where a detour includes them. Without detours the result is `path` itself.

    Args:
        path: the original path.
        detours: (arc, width, offset) of each detour, metres.
    Returns:
        The path with all detours.
    Raises:
        InputError: if a detour is not three finite numbers with a positive width.
    """
    for detour in detours:
        if len(detour) != 3 or not np.isfinite(detour).all() or detour[1] <= 0.0:
            raise InputError("detour", str(tuple(detour)), "arc, width and offset in metres, with a width above 0")
    detours = [detour for detour in detours if detour[2] != 0.0]
    length = ArcLength(path)
    if not detours or not length.length:
        return path
    grid = np.linspace(0.0, length.length, max(int(np.ceil(length.length / _STEP)), 8) + 1)
    heading = compute_headings(path.at(length.parameter_at(grid)), grid[1], path.closed)
    parameters = _sample_parameters(path, length)
    arc = length.distance_at(parameters)
    aside = compute_closed_offsets(arc, detours, length.length) if path.closed else compute_offsets(arc, detours)
    left = compute_left(_interpolate_smoothly(grid, heading, arc))
    return _fit_through(parameters, path.at(parameters) + aside[:, None] * left, path.closed)


def _sample_parameters(path, length):
    """Sample the path's parameters, its breaks among them, so that no two are more than _STEP apart."""
    breaks = np.asarray(path.breaks, dtype=float)
    counts = np.maximum(np.ceil(np.diff(length.distance_at(breaks)) / _STEP).astype(int), 1)
    first, share = np.repeat(np.arange(len(counts)), counts), np.concatenate([np.arange(n) / n for n in counts])
    return np.append(breaks[first] + share * np.diff(breaks)[first], breaks[-1])


def _interpolate_smoothly(grid, values, at):
    """Interpolate values (N,) on a grid by a cubic spline, since kinks of the heading would become kinks of the
    path.
    """
    from scipy.interpolate import CubicSpline

    return CubicSpline(grid, values)(at)


def _fit_through(parameters, places, closed):
    """Interpolate places (N, 3) by a cubic spline with the given parameters."""
    from scipy.interpolate import make_interp_spline

    if closed:
        places[-1] = places[0]
    spline = make_interp_spline(parameters, places, k=3, bc_type="periodic" if closed else None)
    return SplinePath(spline.t, spline.c, 3, closed)


@dataclass(frozen=True)
class PathChange:
    """What a follower changes to avoid others.

    Attributes:
        delay: seconds for which it waits at its start.
        detours: (arc, width, offset) of each detour, metres along the original path.
    """

    delay: float = 0.0
    detours: tuple[tuple[float, float, float], ...] = ()

    def describe(self, length: float = np.inf) -> list[str]:
        """Describe the change in words.

        Args:
            length: metres of the path, beyond which no detour is described.
        Returns:
            A phrase for the wait, and one for each detour; detours of one offset that overlap count as one.
        """
        spans: list[list[float]] = []  # start, end, offset
        for middle, width, offset in sorted(self.detours):
            start, end = max(middle - 0.5 * width, 0.0), min(middle + 0.5 * width, length)
            if spans and spans[-1][2] == offset and start <= spans[-1][1]:
                spans[-1][1] = end
            else:
                spans.append([start, end, offset])
        moves = [f"moves {abs(offset):.2f} m to the {'left' if offset > 0 else 'right'} from {start:.1f} to "
                 f"{end:.1f} m of the path" for start, end, offset in spans]
        return [*([f"waits {self.delay:.2f} s"] if self.delay else []), *moves]


@dataclass(frozen=True, eq=False, kw_only=True)
class Follower:
    """One body that follows a path, before any change.

    Attributes:
        name: of the body, for messages.
        times: (T,) seconds, rising, on a clock shared by all bodies.
        places: (T, 3) metres on the ground, world frame.
        path: the path that it follows; None for a body that cannot yield.
        arc: (T,) metres along the path.
        by_arc: whether it keeps its speed, so that a detour delays it; else the path's parameter gives its place.
    """

    name: str
    times: np.ndarray
    places: np.ndarray
    path: Path | None = None
    arc: np.ndarray | None = None
    by_arc: bool = True

    @cached_property
    def sampled_path(self) -> "SampledPath":
        """The path, sampled and seen from above."""
        return SampledPath(self.path)

    @cached_property
    def path_offset(self) -> np.ndarray:
        """(T, 3) metres from the path to the body."""
        return self.places - self.sampled_path.places_at(self.arc)

    @cached_property
    def speed(self) -> float:
        """Typical metres per second while it moves: the 80th percentile."""
        seconds = np.maximum(np.diff(self.times), 1e-9)
        speeds = np.linalg.norm(np.diff(self.places[:, :2], axis=0), axis=1) / seconds
        moving = speeds[speeds > 0.2]
        return float(np.percentile(moving, 80)) if len(moving) else 0.0

    def at(self, times: np.ndarray, change: PathChange = PathChange()) -> np.ndarray:
        """Compute the places of the body at given times; before its first and after its last time it stays there.

        Args:
            times: (N,) seconds.
            change: its delay and detours.
        Returns:
            (N, 3) metres, world frame.
        """
        times = times - change.delay
        if self.path is None or not change.detours:
            return interpolate_columns(times, self.times, self.places)
        arc = np.interp(times, self.times, self.arc)
        beside = interpolate_columns(times, self.times, self.path_offset)
        return beside + self.sampled_path.with_detours_at(arc, change.detours, self.by_arc)

    def places_with_train(self, times: np.ndarray, change: PathChange, train) -> np.ndarray:
        """Compute the places of the body for many variants of additional detours at once.

        Fast, and exact to a few millimetres.

        Args:
            times: (N,) seconds.
            change: its delay and detours so far.
            train: additional detours whose numbers are arrays (A, 1), one row for each variant.
        Returns:
            (A, N, 3) metres, world frame.
        """
        times, sampled_path = times - change.delay, self.sampled_path
        # The arc length with the old detours is exact; the length that the new ones add is subtracted to first order.
        arc = sampled_path.to_original_arc(np.interp(times, self.times, self.arc), change.detours, self.by_arc)[None]
        old = sampled_path.compute_offset(arc, change.detours)
        aside = old + sampled_path.compute_offset(arc, train)
        if self.by_arc:
            arc = arc - sampled_path.compute_extra_length(arc[0], aside) + sampled_path.compute_extra_length(arc[0],
                    old)
            aside = sampled_path.compute_offset(arc, (*change.detours, *train))
        arc, shape = np.broadcast_to(arc, aside.shape).ravel(), (*aside.shape, 3)
        places = interpolate_columns(arc, sampled_path.arc, sampled_path.places) + aside.reshape(-1,
                1) * interpolate_columns(arc, sampled_path.arc, sampled_path.left)
        return places.reshape(shape) + interpolate_columns(times, self.times, self.path_offset)

    def arc_at(self, time: float, change: PathChange = PathChange()) -> float:
        """Compute the metres along the original path at a time.

        Args:
            time: seconds.
            change: its delay and detours.
        Returns:
            Metres along the original path.
        """
        arc = np.interp([time - change.delay], self.times, self.arc)
        return float(self.sampled_path.to_original_arc(arc, change.detours, self.by_arc)[0])


class SampledPath:
    """A path sampled at even arc lengths, with the directions to its left.

    Attributes:
        length: metres of the path.
        closed: whether its end is its start.
        tables: cached arc-length tables, by detours.
        arc: (K,) metres along the path.
        places: (K, 3) metres, world frame.
        left: (K, 3) horizontal unit vectors to the left.
        curvature: (K,) radians per metre, left positive.
    """

    def __init__(self, path: Path):
        length = ArcLength(path)
        self.length, self.closed, self.tables = length.length, path.closed, {}
        count = max(int(np.ceil(self.length / _SPACING)), 8)
        self.arc = np.linspace(0.0, self.length, count + 1) if self.length else np.zeros(1)
        self.places = path.at(length.parameter_at(self.arc))
        heading = compute_headings(self.places, self.arc[1], self.closed) if self.length else np.zeros(1)
        self.left = compute_left(heading)
        self.curvature = np.gradient(heading, self.arc) if self.length else np.zeros(1)

    def places_at(self, arc: np.ndarray) -> np.ndarray:
        """Interpolate the places (N, 3) on the path at arc lengths (N,)."""
        return interpolate_columns(self._wrap_arc(arc, self.length), self.arc, self.places)

    def with_detours_at(self, arc: np.ndarray, detours, by_arc: bool) -> np.ndarray:
        """Compute the places on the path with detours.

        Args:
            arc: (N,) metres, as in `to_original_arc`.
            detours: (arc, width, offset) of each detour, metres.
            by_arc: whether `arc` is measured on the path with its detours.
        Returns:
            (N, 3) metres, world frame.
        """
        arc = self.to_original_arc(arc, detours, by_arc)
        aside = interpolate_columns(arc, self.arc, self.left) * self.compute_offset(arc, detours)[:, None]
        return interpolate_columns(arc, self.arc, self.places) + aside

    def to_original_arc(self, arc: np.ndarray, detours, by_arc: bool) -> np.ndarray:
        """Convert arc lengths on the path with detours to arc lengths on the original path.

        Args:
            arc: (N,) metres that the body has moved along the path with its detours.
            detours: (arc, width, offset) of each detour, metres.
            by_arc: False if `arc` is already measured on the original path.
        Returns:
            (N,) metres along the original path.
        """
        if not by_arc or not detours:
            return self._wrap_arc(arc, self.length)
        if detours not in self.tables:
            self.tables[detours] = self._build_arc_table(detours)
        at, detour_arc = self.tables[detours]
        return np.interp(self._wrap_arc(arc, detour_arc[-1]), detour_arc, at)

    def _build_arc_table(self, detours):
        """Build a table: (K,) metres along the original path and (K,) metres along the path with detours."""
        low = np.array([[middle - 0.5 * width] for middle, width, _ in detours])
        wide = np.array([[width] for _, width, _ in detours])
        at = (low + wide * np.linspace(0.0, 1.0, _PIECES + 1)).ravel()
        at = np.unique(np.concatenate([[0.0, self.length], self._wrap_arc(at, self.length)]))
        aside = self.compute_offset(at, detours)
        # An offset to the inside of a bend shortens the path by offset * curvature, to the outside it lengthens it.
        along = 1.0 - 0.5 * (aside[1:] + aside[:-1]) * np.interp(0.5 * (at[1:] + at[:-1]), self.arc, self.curvature)
        step = np.hypot(np.diff(at) * along, np.diff(aside))
        return at, np.concatenate([[0.0], np.cumsum(step)])

    def compute_extra_length(self, arc: np.ndarray, aside: np.ndarray) -> np.ndarray:
        """Compute the length that an offset adds to the path, counted from the first arc length.

        Args:
            arc: (N,) metres along the original path.
            aside: (A, N) metres to the left.
        Returns:
            (A, N) metres.
        """
        step = np.diff(arc)
        bend = np.interp(0.5 * (arc[1:] + arc[:-1]), self.arc, self.curvature)
        along = step * (1.0 - 0.5 * (aside[:, 1:] + aside[:, :-1]) * bend)
        more = np.where(step > 0.0, np.hypot(along, np.diff(aside, axis=1)) - step, 0.0)
        return np.concatenate([np.zeros((len(aside), 1)), np.cumsum(more, axis=1)], axis=1)

    def compute_offset(self, arc: np.ndarray, detours) -> np.ndarray:
        """Compute the lateral offset (N,) m at arc lengths (N,) m."""
        return compute_closed_offsets(arc, detours, self.length) if self.closed else compute_offsets(arc, detours)

    def _wrap_arc(self, arc, length):
        return arc % length if self.closed and length else np.clip(arc, 0.0, length)
