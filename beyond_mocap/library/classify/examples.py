"""What somebody has said about a few clips, as the classifier learns it: moments and stretches of each act."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...annotation import LOCOMOTION, VOCABULARY, ClipAnnotation, spoken
from ...annotation.labels import list_labels
from ...base.errors import Cancelled, InputError
from ...motion.humanoid import identify
from ...motion.motion import Motion
from ..proposals import GAITS, propose
from ..word_sources import Proposal, is_open
from .signals import Signals, signals

_COLOURS = frozenset((*LOCOMOTION, *VOCABULARY["modifier"], *list_labels(group="height")))


@dataclass(frozen=True, eq=False)
class Example:
    """An annotated clip. name: for messages and for whose it is; signals: its own; rows: all that is said about it;
    ruled: what the rules propose for it."""

    name: str
    signals: Signals
    rows: tuple[ClipAnnotation, ...]
    ruled: tuple[Proposal, ...]

    @classmethod
    def of(cls, name: str, motion: Motion, rows: Sequence[ClipAnnotation], gaits=GAITS) -> "Example":
        """From a motion and its rows; InputError where the skeleton has no legs."""
        return cls(name, signals(motion), tuple(rows), propose(motion, gaits))

    def rows_of(self, act: str, moment: bool) -> list[ClipAnnotation]:
        """The rows of one act that have a key moment, or that have none."""
        return [row for row in self.rows if act_of(row) == act and (row.key is not None) == moment]

    def seconds(self) -> np.ndarray:
        """(N,) of the signals' samples."""
        return self.signals.frames / self.signals.fps


def act_of(row: ClipAnnotation) -> str:
    """What a row says is done: the first of its words as one speaks them; "" where it only says how a body goes."""
    return next((word for word in spoken(row.words) if word not in _COLOURS), "")


def examples_of(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None, note=None
) -> tuple[Example, ...]:
    """The annotated clips below a library's folder, in its order. What a table has as proposed, and nobody has accepted
    (`word_sources.is_open`), is no example: note(text) tells how many rows these are. unit: metres per unit of the BVH
    files, guessed where None. progress(fraction, text). InputError where no clip has words, a file cannot be read or
    has no legs; Cancelled."""
    clips = _Clips(folder, cache_dir)
    read = clips.read(True, unit, progress, cancelled)
    out = tuple(Example.of(name, motion, rows) for name, motion, rows in read)
    if not out:
        found = "no clip with words" + (f" ({clips.told()})" if clips.open else "")
        raise InputError(folder, found, "some ten annotated clips", "annotate a few, then learn")
    if clips.open and note is not None:
        note(clips.told())
    return out


def without_words(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None
) -> Iterator[tuple[str, Motion]]:
    """The clips of which nobody has said anything yet: path below the folder, and motion. As `examples_of`."""
    for name, motion, _ in _Clips(folder, cache_dir).read(False, unit, progress, cancelled):
        yield name, motion


class _Clips:
    """A library's recordings, and what people have said of them. open: rows of tables that were proposed only."""

    def __init__(self, folder: str | Path, cache_dir):
        from .. import cache
        from ..scan import Annotations, readable_clips

        self._folder, self.open = Path(folder), 0
        place = cache.place(self._folder, cache_dir)[0]
        self._paths, self._conversions, _ = readable_clips(self._folder, place)
        self._said = Annotations(self._folder, self._paths, self._is_open)

    def _is_open(self, row) -> bool:
        self.open += is_open(row)
        return is_open(row)

    def told(self) -> str:
        """How many rows are left out."""
        what = "1 proposed row is" if self.open == 1 else f"{self.open} proposed rows are"
        return f"{what} no example, for nobody has accepted {'it' if self.open == 1 else 'them'}"

    def read(self, worded: bool, unit, progress, cancelled) -> Iterator[tuple]:
        """(path below the folder, motion, rows) of all clips that have words, or of those that have none."""
        from ...files.bvh import bvh

        for number, path in enumerate(self._paths):
            file = self._conversions.readable(path)
            if cancelled is not None and cancelled():
                raise Cancelled("looking at clips: cancelled")
            if progress is not None:
                progress(number / len(self._paths), f"Looking at {path.name}")
            if bool(self._said.of(path, 30.0)) != worded:
                continue
            motion = bvh.read(file, unit if file == path else None).motion
            try:
                identify(motion.skeleton)
            except InputError as error:  # skeletons do not know their files
                raise InputError(path, str(error)) from None
            yield path.relative_to(self._folder).as_posix(), motion, self._said.of(path, motion.fps)
