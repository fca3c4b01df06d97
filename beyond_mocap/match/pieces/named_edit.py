"""An edit list that names its clips by path and counts their own frames, so that it fits the library whenever that is
built again, and is as small as it can be: runs of frames that follow each other evenly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...motion.skeleton import frozen_array

CONTINUES = 0.05
"""Library frames by which the next frame may miss its place and still goes on without a cut."""

_FIELDS = (("clip", int), ("first", float), ("rate", float), ("length", int), ("cut", bool))

ClipName = tuple[str, bool]
"""A clip's path below the library, and whether it is mirrored."""


@dataclass(frozen=True)
class NamedKey:
    """A key moment of the timeline, asked for at `time` s, is served by a key moment of a clip: clip of the table;
    frame, start and end in the clip's own rate; words that it carries there."""

    time: float
    clip: int
    frame: float
    start: float
    end: float
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class NamedEdit:
    """R runs of T frames in all, at the library's rate.

    clips: table of clips. clip (R,) index into it; first (R,) frame of the clip, at the library's rate from its
    beginning, that a run begins with (beyond the clip's ends a little, where these are held); rate (R,) frames that it
    goes on by; length (R,) frames; cut (R,) bool: whether it begins another piece or goes on with the run before. keys:
    in the order of time.
    """

    clips: tuple[ClipName, ...]
    clip: np.ndarray
    first: np.ndarray
    rate: np.ndarray
    length: np.ndarray
    cut: np.ndarray
    keys: tuple[NamedKey, ...] = ()

    def __post_init__(self):
        for name, kind in _FIELDS:
            object.__setattr__(self, name, frozen_array(getattr(self, name), kind))

    def __len__(self) -> int:
        return int(self.length.sum())

    @property
    def starts(self) -> np.ndarray:
        """(R,) frame at which each run begins."""
        return np.cumsum(self.length) - self.length

    @property
    def seams(self) -> np.ndarray:
        """(S,) frames that begin another piece, but for the first."""
        return self.starts[1:][self.cut[1:]]

    def frames(self) -> tuple[np.ndarray, np.ndarray]:
        """Clip of the table (T,) and frame of it (T,) that every frame shows."""
        run = np.repeat(np.arange(len(self.clip)), self.length)
        return self.clip[run], self.first[run] + self.rate[run] * (np.arange(len(run)) - self.starts[run])


def part(edit: NamedEdit, low: int, high: int) -> NamedEdit:
    """Frames low .. high of an edit list, with all of its keys."""
    starts = edit.starts
    begin, end = np.maximum(starts, low), np.minimum(starts + edit.length, high)
    kept = end > begin
    first = edit.first + edit.rate * (begin - starts)
    cut = np.where(begin == low, True, edit.cut)
    return NamedEdit(
        edit.clips, edit.clip[kept], first[kept], edit.rate[kept], (end - begin)[kept], cut[kept], edit.keys
    )


def chained(parts: Sequence[NamedEdit], keys: Sequence[NamedKey]) -> NamedEdit:
    """One edit list after the other, cut in between unless the next goes on with the clip where the one before leaves
    it; `keys` by the names of the clips in the joint table: see `retabled`."""
    clips = table(parts)
    parts = [retabled(each, clips) for each in parts]
    clip, first, rate, length, cut = (np.concatenate([getattr(each, name) for each in parts]) for name, _ in _FIELDS)
    for join in np.cumsum([len(each.clip) for each in parts])[:-1]:
        goes_on = first[join - 1] + rate[join - 1] * length[join - 1]
        cut[join] = clip[join] != clip[join - 1] or abs(first[join] - goes_on) > CONTINUES
    return NamedEdit(clips, clip, first, rate, length, cut, tuple(sorted(keys, key=lambda key: key.time)))


def table(parts: Sequence[NamedEdit]) -> tuple[ClipName, ...]:
    """All clips of some edit lists, each once."""
    return tuple(sorted({name for each in parts for name in each.clips}))


def retabled(edit: NamedEdit, clips: tuple[ClipName, ...]) -> NamedEdit:
    """The edit list with another table, which has all of its clips."""
    place = {name: number for number, name in enumerate(clips)}
    number = np.array([place[name] for name in edit.clips], int)
    keys = tuple(replace(key, clip=int(number[key.clip])) for key in edit.keys)
    return replace(edit, clips=clips, clip=number[edit.clip], keys=keys)
