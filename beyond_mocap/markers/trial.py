"""A trial: one recording of optical markers, the type that all readers return and all reconstruction steps take.

Some systems expose at whole milliseconds and write the nominal rate (`estimate_frame_times`). At 360 Hz the steps are
then 3, 3, 3, 2, 3, 3, 3, 3, 2 ms instead of 2.78 ms, and every marker of the body seems 28 % slower in one frame of
four or five and 8 % faster in the others. A filter on one marker cannot separate this from movement; all markers
together can.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.errors import InputError

MIN_FPS, MAX_FPS = 1.0, 20000.0  # frames per second that a trial may have

TICK = 1e-3  # seconds, the clock period to which exposures are rounded
_SMOOTHING_FRAMES = 19  # frames over which a marker's step is smoothed, several times the length of the jitter pattern
_MIN_CORRELATION = 0.8  # minimum correlation of the markers' common jitter with the jitter of the clock
_PHASE_COUNT = 36  # phases of the clock that are tried


@dataclass(frozen=True)
class MarkerEvent:
    """An event that the recording itself names.

    Attributes:
        seconds: time on the trial's clock (as `MarkerTrial.start`).
        label: as written in the file, for instance "Foot Strike".
        side: "left", "right" or "".
    """

    seconds: float
    label: str
    side: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class MarkerTrial:
    """The positions of M markers over T frames. Arrays are read-only copies.

    Attributes:
        labels: M unique names without the subject's prefix.
        positions: (T, M, 3) metres, Z up, right-handed, NaN where a marker is not visible.
        fps: frames per second.
        residuals: (T, M) metres by which the cameras disagree, NaN where not visible; None where the file has none.
        events: sorted by time.
        start: seconds of frame 0.
        name: file name without its ending.
        subject: whose markers these are, "" where the file does not say.
        notes: messages on decisions made while reading (unit, up axis, labels left out).
    Raises:
        InputError: if shapes do not match, a label is empty or repeated, the rate is out of range, or a coordinate is
            infinite.
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
        values = {"labels": tuple(self.labels), "positions": _freeze_array(self.positions, self.name, "positions"),
                  "fps": float(self.fps), "residuals": None if self.residuals is None
                  else _freeze_array(self.residuals, self.name, "residuals"),
                  "events": tuple(sorted(self.events, key=lambda event: event.seconds)), "start": float(self.start),
                  "notes": tuple(self.notes)}
        for name, value in values.items():
            object.__setattr__(self, name, value)
        self._check()

    def _check(self) -> None:
        """Raise InputError for shapes, labels, rates and coordinates that are not valid."""
        shape = self.positions.shape
        if len(shape) != 3 or shape[1:] != (len(self.labels), 3):
            raise InputError(self.name, f"positions of shape {shape}", f"(frames, {len(self.labels)} labels, 3)")
        if self.residuals is not None and self.residuals.shape != shape[:2]:
            raise InputError(self.name, f"residuals of shape {self.residuals.shape}", f"{shape[:2]}")
        if twice := find_duplicates(self.labels):
            raise InputError(self.name, f"duplicate label {twice[0]!r}", "unique labels", "rename one of them")
        if not all(isinstance(label, str) and label.strip() for label in self.labels):
            raise InputError(self.name, "a marker without a label", "unique labels", "give it a label")
        if not MIN_FPS <= self.fps <= MAX_FPS:
            raise InputError(self.name, f"{self.fps:g} frames per second", f"{MIN_FPS:g} to {MAX_FPS:g}")
        if not np.isfinite(self.start):
            raise InputError(self.name, f"starts at {self.start:g} s", "a number of seconds")
        if np.isinf(self.positions).any():
            raise InputError(self.name, "an infinite coordinate", "numbers, or NaN where a marker is not seen")

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def visibility(self) -> np.ndarray:
        """(T, M) bool, where a marker is visible."""
        seen = np.isfinite(self.positions).all(axis=-1)
        seen.setflags(write=False)
        return seen

    @property
    def seconds(self) -> np.ndarray:
        """(T,) seconds of the frames on the trial's clock."""
        return self.start + np.arange(len(self)) / self.fps

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
        return max(len(self) - 1, 0) / self.fps

    def index_of(self, label: str) -> int:
        """Return the index of the marker with this label.

        Raises:
            InputError: if no marker has this label; the message lists the labels.
        """
        try:
            return self.labels.index(label)
        except ValueError:
            known = ", ".join(self.labels[:12]) + (", ..." if len(self.labels) > 12 else "")
            raise InputError(self.name, f"no marker {label!r}", f"one of {known}", "check the spelling") from None

    def select_markers(self, labels: Iterable[str]) -> MarkerTrial:
        """Select markers.

        Args:
            labels: the markers to keep, in the new order.
        Returns:
            The trial with these markers alone.
        Raises:
            InputError: if a label is missing.
        """
        chosen = [self.index_of(label) for label in labels]
        residuals = None if self.residuals is None else self.residuals[:, chosen]
        return replace(self, labels=tuple(self.labels[i] for i in chosen), positions=self.positions[:, chosen],
                       residuals=residuals)

    def select_frames(self, first: int, end: int) -> MarkerTrial:
        """Select frames.

        Args:
            first: index of the first frame.
            end: index after the last frame.
        Returns:
            The trial with these frames on the same clock; events outside are left out.
        """
        first, end, _ = slice(first, end).indices(len(self))
        start, last = self.start + first / self.fps, self.start + (end - 1) / self.fps
        near = 0.5 / self.fps
        inside = tuple(event for event in self.events if start - near <= event.seconds <= last + near)
        residuals = None if self.residuals is None else self.residuals[first:end]
        return replace(self, positions=self.positions[first:end], residuals=residuals, start=start, events=inside)

    def rename_labels(self, names: Mapping[str, str]) -> MarkerTrial:
        """Return the trial with other labels.

        Args:
            names: {old label: new label}; other labels stay.
        Raises:
            InputError: if a new label exists already.
        """
        return replace(self, labels=tuple(names.get(label, label) for label in self.labels))

    def with_positions(self, positions: np.ndarray) -> MarkerTrial:
        """Return the trial with other positions, (T, M, 3) metres.

        Residuals stay if the number of frames and markers is unchanged; otherwise they are dropped.
        """
        keeps_residuals = self.residuals is not None and np.shape(positions)[:2] == self.residuals.shape
        return replace(self, positions=positions, residuals=self.residuals if keeps_residuals else None)


def find_duplicates(labels: Iterable[str]) -> list[str]:
    """Return the labels that occur more than once, each once, in the order of their second occurrence."""
    known, twice = set(), []
    for label in labels:
        if label in known and label not in twice:
            twice.append(label)
        known.add(label)
    return twice


def _freeze_array(values, where: str, what: str) -> np.ndarray:
    """Return a read-only float array; raise InputError where the values are not numbers."""
    try:
        out = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(where, f"{what} that are not numbers", "an array of numbers") from None
    out.setflags(write=False)
    return out


def estimate_frame_times(trial: MarkerTrial) -> np.ndarray | None:
    """Estimate when the frames were exposed, for systems whose clock ticks in whole milliseconds.

    The steps of all markers, each against its own smoothed steps, give one common jitter per frame. It is correlated
    with the jitter that a clock of whole milliseconds would cause, at every phase.

    Args:
        trial: the recorded markers, T frames.
    Returns:
        (T,) seconds on the trial's clock; None where the frames are evenly spaced, or no phase correlates by more than
        0.8.
    """
    step = 1.0 / (trial.fps * TICK)
    if abs(step - round(step)) < 1e-3 or step < 1.5 or len(trial) < 3 * _SMOOTHING_FRAMES:
        return None
    common, weight = _measure_common_jitter(trial.positions)
    if not np.sum(weight * common**2) > 0.0:
        return None
    best, found = _MIN_CORRELATION, None
    # the clock's ticks (T,) at each phase, and the relative jitter (T-1,) of the steps between them
    for phase in np.arange(_PHASE_COUNT) / _PHASE_COUNT:
        ticks = np.floor(np.arange(len(trial)) * step + phase + 1e-9)
        jitter = np.diff(ticks) / step - 1.0
        size = np.sqrt(np.sum(weight * common**2) * np.sum(weight * jitter**2))
        correlation = np.sum(weight * common * jitter) / max(size, 1e-300)
        if correlation > best:
            best, found = correlation, ticks
    if found is None:
        return None
    times = found * TICK
    return trial.start + times - np.mean(times - np.arange(len(trial)) / trial.fps)


def resample_evenly(trial: MarkerTrial) -> MarkerTrial:
    """Resample a trial to evenly spaced frames.

    Args:
        trial: the recorded markers.
    Returns:
        The resampled trial, or the trial itself where its frames are even. Markers that are not visible stay so.
    """
    times = estimate_frame_times(trial)
    if times is None:
        return trial
    note = f"frames were recorded at whole milliseconds, not every {1000.0 / trial.fps:.2f} ms: resampled evenly"
    return replace(trial, positions=_interpolate_at_even_times(trial, times), notes=(*trial.notes, note))


def _measure_common_jitter(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure by what share (T-1,) all markers' steps exceed their smoothed steps, and the weight (T-1,) of each."""
    from scipy.signal import savgol_filter

    steps = np.diff(positions, axis=0)
    known = np.isfinite(steps).all(axis=-1)
    filled = np.where(known[..., None], steps, 0.0)
    smooth = savgol_filter(filled, _SMOOTHING_FRAMES, 3, axis=0)
    gap = np.apply_along_axis(np.convolve, 0, ~known, np.ones(_SMOOTHING_FRAMES), "same") > 0.5
    # steps within half a window of a gap are smoothed with zeros; they get no weight
    smooth[gap] = 0.0
    weight = np.einsum("tmc,tmc->t", smooth, smooth)
    shared = np.einsum("tmc,tmc->t", filled - smooth, smooth)
    return np.where(weight > 0.0, shared / np.maximum(weight, 1e-300), 0.0), weight


def _interpolate_at_even_times(trial: MarkerTrial, times: np.ndarray) -> np.ndarray:
    """Interpolate (T, M, 3) metres by cubic splines, one for all markers that are visible in the same frames."""
    from scipy.interpolate import CubicSpline

    out = np.array(trial.positions)
    patterns, which = np.unique(trial.visibility, axis=1, return_inverse=True)
    for number, seen in enumerate(patterns.T):
        if np.count_nonzero(seen) < 4:
            continue
        markers = np.flatnonzero(which.ravel() == number)
        trajectory = CubicSpline(times[seen], trial.positions[seen][:, markers])
        at = np.clip(trial.seconds[seen], times[seen][0], times[seen][-1])
        out[np.ix_(seen, markers)] = trajectory(at)
    return out
