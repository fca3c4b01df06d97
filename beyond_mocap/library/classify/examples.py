"""What somebody has said about a few clips, as the classifier learns it: moments and stretches of each act."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...annotation import LOCOMOTION, VOCABULARY, ClipAnnotation, spoken
from ...errors import Cancelled, InputError
from ...motion.humanoid import identify
from ...motion.motion import Motion
from ..proposals import GAITS, Proposal, propose
from .signals import Signals, signals

_COLOURS = frozenset((*LOCOMOTION, *VOCABULARY["modifier"], "low", "middle", "high"))


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
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None
) -> tuple[Example, ...]:
    """The annotated clips below a library's folder, in its order. unit: metres per unit of the BVH files, guessed where
    None. progress(fraction, text). InputError where no clip has words, a file cannot be read or has no legs; Cancelled."""
    read = _clips(folder, True, unit, progress, cache_dir, cancelled)
    out = tuple(Example.of(name, motion, rows) for name, motion, rows in read)
    if not out:
        raise InputError(folder, "no clip with words", "some ten annotated clips", "annotate a few, then learn")
    return out


def without_words(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None
) -> Iterator[tuple[str, Motion]]:
    """The clips of which nobody has said anything yet: path below the folder, and motion. As `examples_of`."""
    for name, motion, _ in _clips(folder, False, unit, progress, cache_dir, cancelled):
        yield name, motion


def _clips(folder, worded: bool, unit, progress, cache_dir, cancelled) -> Iterator[tuple]:
    """(path below the folder, motion, rows) of all clips that have words, or of those that have none."""
    from ...files import bvh
    from .. import cache
    from ..scan import Annotations, readable_clips

    folder = Path(folder)
    paths, conversions, _ = readable_clips(folder, cache.place(folder, cache_dir)[0])
    annotations = Annotations(folder, paths)
    for number, path in enumerate(paths):
        file = conversions.readable(path)
        if cancelled is not None and cancelled():
            raise Cancelled("looking at clips: cancelled")
        if progress is not None:
            progress(number / len(paths), f"Looking at {path.name}")
        if bool(annotations.of(path, 30.0)) == worded:
            motion = bvh.read(file, unit if file == path else None).motion
            try:
                identify(motion.skeleton)
            except InputError as error:  # skeletons do not know their files
                raise InputError(path, str(error)) from None
            yield path.relative_to(folder).as_posix(), motion, annotations.of(path, motion.fps)
