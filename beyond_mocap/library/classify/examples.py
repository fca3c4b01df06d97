"""Annotated clips as the classifier's training examples: moments and stretches of each act."""

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
    """An annotated clip.

    Attributes:
        name: for messages, and to keep clips apart.
        signals: of its motion.
        rows: all its annotations.
        rule_proposals: what the rules propose for it.
    """

    name: str
    signals: Signals
    rows: tuple[ClipAnnotation, ...]
    ruled: tuple[Proposal, ...]

    @classmethod
    def of(cls, name: str, motion: Motion, rows: Sequence[ClipAnnotation], gaits=GAITS) -> "Example":
        """Build an example from a motion and its rows; InputError where the skeleton has no legs."""
        return cls(name, signals(motion), tuple(rows), propose(motion, gaits))

    def rows_of(self, act: str, moment: bool) -> list[ClipAnnotation]:
        """Select the rows of one act that have a key moment, or that have none."""
        return [row for row in self.rows if act_of(row) == act and (row.key is not None) == moment]

    def seconds(self) -> np.ndarray:
        """List the times (N,) in seconds of the signals' samples."""
        return self.signals.frames / self.signals.fps


def act_of(row: ClipAnnotation) -> str:
    """Find the act of a row: the first of its labels as spoken that is no modifier; "" where it only describes
    locomotion.
    """
    return next((word for word in spoken(row.words) if word not in _COLOURS), "")


def examples_of(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None, note=None
) -> tuple[Example, ...]:
    """Read the annotated clips below a library's folder, in its order.

    Proposed rows of a table that no person has accepted (`label_sources.is_unreviewed`) are no examples.

    Args:
        folder: the library's.
        unit: metres per unit of the BVH files, guessed where None.
        progress: called with a fraction and a text.
        cache_dir: of the library.
        cancelled: called often; True stops the work.
        on_note: called with a text about skipped rows.
    Returns:
        The examples.
    Raises:
        InputError: if no clip has labels, a file cannot be read or has no legs.
        Cancelled: if `cancelled` returns True.
    """
    clips = _Clips(folder, cache_dir)
    read = clips.read(True, unit, progress, cancelled)
    out = tuple(Example.of(name, motion, rows) for name, motion, rows in read)
    if not out:
        found = "no clip with labels" + (f" ({clips.told()})" if clips.open else "")
        raise InputError(folder, found, "some ten annotated clips", "annotate a few clips, then learn")
    if clips.open and note is not None:
        note(clips.told())
    return out


def without_words(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None
) -> Iterator[tuple[str, Motion]]:
    """Iterate over the clips without labels: path below the folder, and motion. Arguments as `read_examples`."""
    for name, motion, _ in _Clips(folder, cache_dir).read(False, unit, progress, cancelled):
        yield name, motion


class _Clips:
    """A library's recordings and their annotations.

    Attributes:
        unreviewed_count: number of rows of tables that are proposals only.
    """

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
        """Describe how many rows are left out."""
        what = "1 proposed row is" if self.open == 1 else f"{self.open} proposed rows are"
        return f"{what} not used until you accept {'it' if self.open == 1 else 'them'}"

    def read(self, worded: bool, unit, progress, cancelled) -> Iterator[tuple]:
        """Iterate over (path below the folder, motion, rows) of all clips that have labels, or of those that have none.
        """
        from ...files.bvh import bvh

        for number, path in enumerate(self._paths):
            file = self._conversions.readable(path)
            if cancelled is not None and cancelled():
                raise Cancelled("reading clips: cancelled")
            if progress is not None:
                progress(number / len(self._paths), f"Reading {path.name}")
            if bool(self._said.of(path, 30.0)) != worded:
                continue
            motion = bvh.read(file, unit if file == path else None).motion
            try:
                identify(motion.skeleton)
            except InputError as error:  # a skeleton does not know its file
                raise InputError(path, str(error)) from None
            yield path.relative_to(self._folder).as_posix(), motion, self._said.of(path, motion.fps)
