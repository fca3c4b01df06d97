"""Annotated clips as the classifier's training examples: moments and stretches of each act."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...annotation import LOCOMOTION, VOCABULARY, ClipAnnotation, sort_labels
from ...annotation.labels import list_labels
from ...base.errors import InputError, UserCancelledError
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion
from ..folder.label_sources import Proposal, is_unreviewed
from ..proposals import propose_labels
from .signals import Signals, build_signals

_MODIFIERS = frozenset((*LOCOMOTION, *VOCABULARY["modifier"], *list_labels(group="height")))


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
    rule_proposals: tuple[Proposal, ...]

    @classmethod
    def from_clip(cls, name: str, motion: Motion, rows: Sequence[ClipAnnotation]) -> "Example":
        """Build an example from a motion and its rows; InputError where the skeleton has no legs."""
        return cls(name, build_signals(motion), tuple(rows), propose_labels(motion))

    def select_rows(self, act: str, moment: bool) -> list[ClipAnnotation]:
        """Select the rows of one act that have a key moment, or that have none."""
        return [row for row in self.rows if find_act(row) == act and (row.key is not None) == moment]

    def list_sample_times(self) -> np.ndarray:
        """List the times (N,) in seconds of the signals' samples."""
        return self.signals.frames / self.signals.fps


def find_act(row: ClipAnnotation) -> str:
    """Find the act of a row: the first of its labels as spoken that is no modifier; "" where it only describes
    locomotion.
    """
    return next((word for word in sort_labels(row.words) if word not in _MODIFIERS), "")


def read_examples(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None, on_note=None
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
        UserCancelledError: if `cancelled` returns True.
    """
    clips = _ClipReader(folder, cache_dir)
    read = clips.iter_clips(True, unit, progress, cancelled)
    out = tuple(Example.from_clip(name, motion, rows) for name, motion, rows in read)
    if not out:
        found = "no clip with labels" + (f" ({clips.describe_unreviewed()})" if clips.unreviewed_count else "")
        raise InputError(folder, found, "some ten annotated clips", "annotate a few clips, then learn")
    if clips.unreviewed_count and on_note is not None:
        on_note(clips.describe_unreviewed())
    return out


def iter_unlabelled_clips(
    folder: str | Path, unit: float | None = None, progress=None, cache_dir=None, cancelled=None
) -> Iterator[tuple[str, Motion]]:
    """Iterate over the clips without labels: path below the folder, and motion. Arguments as `read_examples`."""
    for name, motion, _ in _ClipReader(folder, cache_dir).iter_clips(False, unit, progress, cancelled):
        yield name, motion


class _ClipReader:
    """A library's recordings and their annotations.

    Attributes:
        unreviewed_count: number of rows of tables that are proposals only.
    """

    def __init__(self, folder: str | Path, cache_dir):
        from .. import cache
        from ..folder.annotations import Annotations
        from ..folder.conversions import find_readable_clips

        self._folder, self.unreviewed_count = Path(folder), 0
        place = cache.find_cache_folder(self._folder, cache_dir)[0]
        self._paths, self._conversions, _ = find_readable_clips(self._folder, place)
        self._annotations = Annotations(self._folder, self._paths, self._skip_unreviewed)

    def _skip_unreviewed(self, row) -> bool:
        self.unreviewed_count += is_unreviewed(row)
        return is_unreviewed(row)

    def describe_unreviewed(self) -> str:
        """Describe how many rows are left out."""
        what = "1 proposed row is" if self.unreviewed_count == 1 else f"{self.unreviewed_count} proposed rows are"
        return f"{what} not used until you accept {'it' if self.unreviewed_count == 1 else 'them'}"

    def iter_clips(self, has_labels: bool, unit, progress, cancelled) -> Iterator[tuple]:
        """Iterate over (path below the folder, motion, rows) of all clips that have labels, or of those that have none.
        """
        from ...files.clip_file import read_clip

        for number, path in enumerate(self._paths):
            file = self._conversions.find_readable_file(path)
            if cancelled is not None and cancelled():
                raise UserCancelledError("reading clips: cancelled")
            if progress is not None:
                progress(number / len(self._paths), f"Reading {path.name}")
            if bool(self._annotations.read_rows(path, 30.0)) != has_labels:
                continue
            motion = read_clip(file, unit if file == path else None).motion
            try:
                identify_joints(motion.skeleton)
            except InputError as error:  # a skeleton does not know its file
                raise InputError(path, str(error)) from None
            yield path.relative_to(self._folder).as_posix(), motion, self._annotations.read_rows(path, motion.fps)
