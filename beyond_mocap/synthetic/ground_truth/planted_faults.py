"""What goes wrong while markers are recorded, planted: hidden markers, exchanged labels, stray samples, lost labels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...markers.trial import MarkerTrial

_SHORTEST, _USUAL, _LONGEST = 0.03, 0.15, 1.0  # seconds that a marker stays hidden
_SWAPPED = (0.15, 0.7)  # seconds that two labels stay exchanged
_STRAY = (0.02, 0.12)  # metres by which a stray sample is off
_TRIES = 400


@dataclass(frozen=True)
class Fault:
    """One thing that was done to a trial. kind: "gap", "swap", "jump" or "unlabeled". labels: the marker, or the two
    that are exchanged, or the marker and the label under which it goes on. frames start .. stop-1."""

    kind: str
    labels: tuple[str, ...]
    start: int
    stop: int


class Faults:
    """A trial on which faults are laid, never two on one sample."""

    def __init__(self, trial: MarkerTrial, seed: int):
        self.trial = trial
        self.labels = list(trial.labels)
        self.positions = trial.positions.copy()
        self.free = trial.seen.copy()
        self.rng = np.random.default_rng(seed)
        self.done: list[Fault] = []

    def occlude(self, share: float) -> None:
        """Hides markers for stretches until `share` of all samples is gone; never more than half of them at once."""
        if not 0.0 <= share < 0.5:
            raise InputError("planted markers", f"{share:g} of the samples hidden", "0 up to 0.5")
        wanted = int(share * self.free.size)
        for _ in range(_TRIES * self.free.shape[1]):
            if wanted <= 0:
                return
            seconds = np.clip(self.rng.lognormal(np.log(_USUAL), 0.7), _SHORTEST, _LONGEST)
            marker = int(self.rng.integers(len(self.trial.labels)))
            start, stop = self._stretch(seconds)
            gone = ~np.isfinite(self.positions[start:stop, :, 0])
            if self.free[start:stop, marker].all() and (gone.mean(axis=1) < 0.5).all():
                self.positions[start:stop, marker] = np.nan
                wanted -= stop - start
                self._mark("gap", (marker,), start, stop)

    def swap(self, pairs: list[tuple[str, str]], count: int) -> None:
        """Exchanges the labels of `count` pairs for a stretch each."""
        for _ in range(_TRIES):
            if count <= 0 or not pairs:
                return
            two = [self.labels.index(label) for label in pairs[int(self.rng.integers(len(pairs)))]]
            start, stop = self._stretch(self.rng.uniform(*_SWAPPED))
            if self.free[start:stop, two].all():
                self.positions[start:stop, two] = self.positions[start:stop, two[::-1]]
                count -= 1
                self._mark("swap", two, start, stop)

    def stray(self, count: int) -> None:
        """Throws single samples off by some centimetres."""
        for _ in range(_TRIES):
            if count <= 0:
                return
            marker, frame = (int(self.rng.integers(size)) for size in self.free.shape[::-1])
            if self.free[frame, marker]:
                way = self.rng.normal(size=3)
                self.positions[frame, marker] += way / np.linalg.norm(way) * self.rng.uniform(*_STRAY)
                count -= 1
                self._mark("jump", (marker,), frame, frame + 1)

    def unlabel(self, count: int) -> None:
        """Lets `count` stretches go on as `*1`, `*2` ... while the marker's own label sees nothing."""
        number = 0
        for _ in range(_TRIES):
            if number >= count:
                return
            marker = int(self.rng.integers(len(self.trial.labels)))
            start, stop = self._stretch(self.rng.uniform(*_SWAPPED))
            if self.free[start:stop, marker].all():
                number += 1
                column = np.full((len(self.positions), 1, 3), np.nan)
                column[start:stop, 0] = self.positions[start:stop, marker]
                self.positions[start:stop, marker] = np.nan
                self.positions = np.concatenate([self.positions, column], axis=1)
                self.labels.append(f"*{number}")
                self._mark("unlabeled", (marker, len(self.labels) - 1), start, stop)

    def faulty(self) -> tuple[MarkerTrial, tuple[Fault, ...]]:
        """The trial as it came out, and what was done to it in the order of time."""
        trial = MarkerTrial(labels=tuple(self.labels), positions=self.positions, fps=self.trial.fps,
                            start=self.trial.start, name=self.trial.name, subject=self.trial.subject)
        return trial, tuple(sorted(self.done, key=lambda fault: (fault.start, fault.labels)))

    def _stretch(self, seconds: float) -> tuple[int, int]:
        """Frames of a stretch somewhere in the trial, not at its very ends."""
        length = min(max(int(round(seconds * self.trial.fps)), 1), max(len(self.positions) // 3, 1))
        start = int(self.rng.integers(1, max(len(self.positions) - length, 2)))
        return start, min(start + length, len(self.positions))

    def _mark(self, kind: str, markers, start: int, stop: int) -> None:
        """Keeps a stretch, and some frames around it, from being touched again."""
        around = max(int(0.05 * self.trial.fps), 2)
        own = [marker for marker in markers if marker < self.free.shape[1]]
        self.free[max(start - around, 0) : stop + around, own] = False
        self.done.append(Fault(kind, tuple(self.labels[marker] for marker in markers), start, stop))


def mirrored(trial: MarkerTrial) -> MarkerTrial:
    """The trial as a left-handed system would write it: left and right of the room exchanged, labels kept."""
    return trial.with_positions(trial.positions * [1.0, -1.0, 1.0])
