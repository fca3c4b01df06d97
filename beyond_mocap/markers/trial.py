"""A trial: one recording of markers, as every reader gives it and every step of the way to a skeleton takes it.

Some systems expose at whole milliseconds and write the nominal rate (`frame_times`). At 360 Hz the steps then are 3, 3,
3, 2, 3, 3, 3, 3, 2 ms instead of 2.78, and every marker of the body seems 28 % slower in one frame of four or five and
8 % faster in the others. No filter of one marker tells this from movement; all markers together do.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.errors import InputError

FEWEST_FPS, MOST_FPS = 1.0, 20000.0

TICK = 1e-3  # seconds: the clock that the exposures are bound to
_SMOOTH = 19  # frames over which a marker's step is smoothed, several times the pattern's length
_LEAST_ALIKE = 0.8  # correlation of the markers' common unsteadiness with the clock's
_PHASES = 36


@dataclass(frozen=True)
class MarkerEvent:
    """A moment that the recording itself names.

    seconds: on the trial's clock (as `MarkerTrial.start`). label: as written, for instance "Foot Strike". side: "left",
    "right" or ""."""

    seconds: float
    label: str
    side: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class MarkerTrial:
    """Markers over time: T frames of M markers.

    labels: M unique names without the subject's prefix. positions: (T, M, 3) metres, Z up, right-handed, NaN where a
    marker is not seen. fps: frames per second. residuals: (T, M) metres, what the cameras disagree by, NaN where not
    seen; None where the file does not say. events: in the order of time. start: seconds of frame 0. name: the file's,
    without its ending. subject: whose markers these are, "" where the file does not say. notes: lines for people on
    what was decided on reading (unit, up axis, labels left out). Arrays are read-only copies.

    InputError where shapes do not fit, a label comes twice or is empty, the rate is none, or a coordinate is infinite.
    """

    labels: tuple[str, ...]
    positions: np.ndarray
    fps: float
    residuals: np.ndarray | None = None
    events: tuple[MarkerEvent, ...] = ()
    start: float = 0.0
    name: str = "trial"
    subject: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        kept = {"labels": tuple(self.labels), "positions": _frozen(self.positions, self.name, "positions"),
                "fps": float(self.fps),
                "residuals": None if self.residuals is None else _frozen(self.residuals, self.name, "residuals"),
                "events": tuple(sorted(self.events, key=lambda event: event.seconds)), "start": float(self.start),
                "notes": tuple(self.notes)}
        for name, value in kept.items():
            object.__setattr__(self, name, value)
        self._check()

    def _check(self) -> None:
        shape = self.positions.shape
        if len(shape) != 3 or shape[1:] != (len(self.labels), 3):
            raise InputError(self.name, f"positions of shape {shape}", f"(frames, {len(self.labels)} labels, 3)")
        if self.residuals is not None and self.residuals.shape != shape[:2]:
            raise InputError(self.name, f"residuals of shape {self.residuals.shape}", f"{shape[:2]}")
        if twice := repeated(self.labels):
            raise InputError(self.name, f"label {twice[0]!r} twice", "unique labels", "rename one of them")
        if not all(isinstance(label, str) and label.strip() for label in self.labels):
            raise InputError(self.name, "a marker without a label", "unique labels", "name it")
        if not FEWEST_FPS <= self.fps <= MOST_FPS:
            raise InputError(self.name, f"{self.fps:g} frames per second", f"{FEWEST_FPS:g} to {MOST_FPS:g}")
        if not np.isfinite(self.start):
            raise InputError(self.name, f"starts at {self.start:g} s", "a number of seconds")
        if np.isinf(self.positions).any():
            raise InputError(self.name, "an infinite coordinate", "numbers, or NaN where a marker is not seen")

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def seen(self) -> np.ndarray:
        """(T, M) bool: where a marker has a place."""
        seen = np.isfinite(self.positions).all(axis=-1)
        seen.setflags(write=False)
        return seen

    @property
    def seconds(self) -> np.ndarray:
        """(T,) seconds of the frames, on the trial's clock."""
        return self.start + np.arange(len(self)) / self.fps

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
        return max(len(self) - 1, 0) / self.fps

    def index(self, label: str) -> int:
        """Which marker this label is. InputError where there is none, with what there is."""
        try:
            return self.labels.index(label)
        except ValueError:
            there = ", ".join(self.labels[:12]) + (", ..." if len(self.labels) > 12 else "")
            raise InputError(self.name, f"no marker {label!r}", f"one of {there}", "check the spelling") from None

    def only(self, labels: Iterable[str]) -> MarkerTrial:
        """The trial with these markers alone, in this order. InputError where one is missing."""
        chosen = [self.index(label) for label in labels]
        residuals = None if self.residuals is None else self.residuals[:, chosen]
        return replace(self, labels=tuple(self.labels[i] for i in chosen), positions=self.positions[:, chosen],
                       residuals=residuals)

    def frames(self, first: int, end: int) -> MarkerTrial:
        """The frames from `first` up to, not with, `end`, on the same clock; events outside are left out."""
        first, end, _ = slice(first, end).indices(len(self))
        start, last = self.start + first / self.fps, self.start + (end - 1) / self.fps
        near = 0.5 / self.fps
        inside = tuple(event for event in self.events if start - near <= event.seconds <= last + near)
        residuals = None if self.residuals is None else self.residuals[first:end]
        return replace(self, positions=self.positions[first:end], residuals=residuals, start=start, events=inside)

    def renamed(self, names: Mapping[str, str]) -> MarkerTrial:
        """The trial with other labels: {old: new}; labels that are not named stay. InputError where a new one is there
        already."""
        return replace(self, labels=tuple(names.get(label, label) for label in self.labels))

    def with_positions(self, positions: np.ndarray) -> MarkerTrial:
        """The trial with other places, (T, M, 3) m; residuals stay where the frames are as many, and go otherwise."""
        keeps = self.residuals is not None and np.shape(positions)[:2] == self.residuals.shape
        return replace(self, positions=positions, residuals=self.residuals if keeps else None)


def list_some(names: Sequence[str], most: int = 6) -> str:
    """The first of many names, and how many more there are."""
    shown = ", ".join(name or "(no name)" for name in names[:most])
    return shown + (f" and {len(names) - most} more" if len(names) > most else "")


def repeated(labels: Iterable[str]) -> list[str]:
    """Labels that come more than once, each told once, in the order of their second coming."""
    met, twice = set(), []
    for label in labels:
        if label in met and label not in twice:
            twice.append(label)
        met.add(label)
    return twice


def _frozen(values, where: str, what: str) -> np.ndarray:
    try:
        out = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(where, f"{what} that are no numbers", "an array of numbers") from None
    out.setflags(write=False)
    return out


def frame_times(trial: MarkerTrial) -> np.ndarray | None:
    """Seconds (T,) on the trial's clock at which the frames were taken, or None where they stand evenly.

    The steps of all markers, each against its own smooth course, give one common unsteadiness per frame; it is compared
    with the one that a clock of whole milliseconds would make, at every phase, and believed where both correlate by
    more than 0.8."""
    step = 1.0 / (trial.fps * TICK)
    if abs(step - round(step)) < 1e-3 or step < 1.5 or len(trial) < 3 * _SMOOTH:
        return None
    common, weight = _common_unsteadiness(trial.positions)
    if not np.sum(weight * common**2) > 0.0:
        return None
    best, found = _LEAST_ALIKE, None
    for phase in np.arange(_PHASES) / _PHASES:
        ticks = np.floor(np.arange(len(trial)) * step + phase + 1e-9)
        jitter = np.diff(ticks) / step - 1.0
        size = np.sqrt(np.sum(weight * common**2) * np.sum(weight * jitter**2))
        alike = np.sum(weight * common * jitter) / max(size, 1e-300)
        if alike > best:
            best, found = alike, ticks
    if found is None:
        return None
    times = found * TICK
    return trial.start + times - np.mean(times - np.arange(len(trial)) / trial.fps)


def evenly(trial: MarkerTrial) -> MarkerTrial:
    """The trial as it would be with evenly spaced frames; itself where it has them. What is not seen stays so."""
    times = frame_times(trial)
    if times is None:
        return trial
    note = f"the frames were taken at whole milliseconds, not every {1000.0 / trial.fps:.2f} ms: put at even times"
    return replace(trial, positions=_at_even_times(trial, times), notes=(*trial.notes, note))


def _common_unsteadiness(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By what share (T-1,) the steps of all markers are longer than their smooth course, and how much it weighs."""
    from scipy.signal import savgol_filter

    steps = np.diff(positions, axis=0)
    known = np.isfinite(steps).all(axis=-1)
    filled = np.where(known[..., None], steps, 0.0)
    smooth = savgol_filter(filled, _SMOOTH, 3, axis=0)
    gap = np.apply_along_axis(np.convolve, 0, ~known, np.ones(_SMOOTH), "same") > 0.5
    smooth[gap] = 0.0
    weight = np.einsum("tmc,tmc->t", smooth, smooth)
    shared = np.einsum("tmc,tmc->t", filled - smooth, smooth)
    return np.where(weight > 0.0, shared / np.maximum(weight, 1e-300), 0.0), weight


def _at_even_times(trial: MarkerTrial, times: np.ndarray) -> np.ndarray:
    """(T, M, 3) m by cubic splines through what is seen, one for all markers that are seen in the same frames."""
    from scipy.interpolate import CubicSpline

    out = np.array(trial.positions)
    patterns, which = np.unique(trial.seen, axis=1, return_inverse=True)
    for number, seen in enumerate(patterns.T):
        if np.count_nonzero(seen) < 4:
            continue
        markers = np.flatnonzero(which.ravel() == number)
        course = CubicSpline(times[seen], trial.positions[seen][:, markers])
        at = np.clip(trial.seconds[seen], times[seen][0], times[seen][-1])
        out[np.ix_(seen, markers)] = course(at)
    return out
