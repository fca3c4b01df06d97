"""An edit list that names its clips by path and counts their own frames.

It stays valid when the library is built again, and it is compact: it stores runs of evenly spaced frames.
`to_named_edit` converts a library's own edit list, `to_library_edit` the other way round.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import KeyMoment
from ...base.errors import InputError
from ...library.keys import Key
from ...library.library import Library
from ...motion.skeleton import freeze_array
from ...synthesis.search.edit_list import EditList, PlacedKey

CONTINUITY_TOLERANCE = 0.05
"""Library frames: a run that starts this close to where the previous one ends continues it without a cut."""

_FIELDS = (("clip", int), ("first", float), ("rate", float), ("length", int), ("cut", bool))

ClipName = tuple[str, bool]
"""A clip's path below the library, and whether it is mirrored."""

_RATE_TOLERANCE = 1e-6
"""Library frames by which the steps within a run may differ."""


@dataclass(frozen=True, kw_only=True)
class NamedKey:
    """A key moment of a clip that serves a key moment of the timeline.

    Attributes:
        time: s, the requested key moment.
        clip: index into the table of clips.
        frame: of the key moment, at the clip's own rate.
        start: first frame, at the clip's own rate.
        end: last frame, at the clip's own rate.
        words: labels the clip has there.
    """

    time: float
    clip: int
    frame: float
    start: float
    end: float
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class NamedEdit:
    """R runs of T frames in all, at the library's rate.

    Attributes:
        clips: table of clips.
        clip: (R,) index into the table.
        first: (R,) first frame of each run, at the library's rate from the start of the clip; slightly beyond the
            clip's ends where these are held.
        rate: (R,) clip frames per output frame.
        length: (R,) output frames.
        cut: (R,) bool, the run starts another piece; else it continues the run before.
        keys: in order of time.
    Raises:
        InputError: if the runs' arrays differ in length, a run has no frame, a number is NaN or infinite, or a clip is
            not in the table.
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
            object.__setattr__(self, name, freeze_array(getattr(self, name), kind))
        shapes = {getattr(self, name).shape for name, _ in _FIELDS}
        if shapes != {(self.clip.size,)} or np.any(self.length < 1):
            raise InputError("edit list", f"runs of shape {', '.join(map(str, shapes))}", "(R,), a frame or more each")
        if not (np.isfinite(self.first) & np.isfinite(self.rate)).all():
            raise InputError("edit list", "NaN or infinite values", "finite numbers")
        used = [self.clip.min(initial=0), self.clip.max(initial=-1), *(key.clip for key in self.keys)]
        if min(used[0], *used[2:], 0) < 0 or max(used[1:]) >= len(self.clips):
            raise InputError("edit list", "a clip that is not in the table", f"0 to {len(self.clips) - 1}")

    def __len__(self) -> int:
        return int(self.length.sum())

    @property
    def starts(self) -> np.ndarray:
        """(R,) frame at which each run starts."""
        return np.cumsum(self.length) - self.length

    @property
    def seams(self) -> np.ndarray:
        """(S,) frames of the transitions: those that start another piece, except the first."""
        return self.starts[1:][self.cut[1:]]

    def frames(self) -> tuple[np.ndarray, np.ndarray]:
        """Give the clip of the table (T,) and the clip's frame (T,) of every frame."""
        run = np.repeat(np.arange(len(self.clip)), self.length)
        return self.clip[run], self.first[run] + self.rate[run] * (np.arange(len(run)) - self.starts[run])


def cut_named_edit(edit: NamedEdit, low: int, high: int) -> NamedEdit:
    """Cut the frames low .. high out of an edit list; it keeps all keys."""
    starts = edit.starts
    begin, end = np.maximum(starts, low), np.minimum(starts + edit.length, high)
    rows = end > begin
    first = edit.first + edit.rate * (begin - starts)
    cut = np.where(begin == low, True, edit.cut)
    return NamedEdit(clips=edit.clips, clip=edit.clip[rows], first=first[rows], rate=edit.rate[rows],
                     length=(end - begin)[rows], cut=cut[rows], keys=edit.keys)


def join_named_edits(parts: Sequence[NamedEdit], keys: Sequence[NamedKey]) -> NamedEdit:
    """Join edit lists one after the other.

    There is a cut in between unless the next one continues the clip where the one before leaves it.

    Args:
        parts: in order.
        keys: with clips numbered as in the joint table (`renumber_clips`).
    Returns:
        One edit list.
    """
    clips = list_clips(parts)
    parts = [renumber_clips(each, clips) for each in parts]
    clip, first, rate, length, cut = (np.concatenate([getattr(each, name) for each in parts]) for name, _ in _FIELDS)
    for join in np.cumsum([len(each.clip) for each in parts])[:-1]:
        goes_on = first[join - 1] + rate[join - 1] * length[join - 1]
        cut[join] = clip[join] != clip[join - 1] or abs(first[join] - goes_on) > CONTINUITY_TOLERANCE
    return NamedEdit(clips=clips, clip=clip, first=first, rate=rate, length=length, cut=cut,
                     keys=tuple(sorted(keys, key=lambda key: key.time)))


def list_clips(parts: Sequence[NamedEdit]) -> tuple[ClipName, ...]:
    """List all clips of some edit lists, each once, sorted."""
    return tuple(sorted({name for each in parts for name in each.clips}))


def renumber_clips(edit: NamedEdit, clips: tuple[ClipName, ...]) -> NamedEdit:
    """Renumber the clips of an edit list for another table that has all of them."""
    place = {name: number for number, name in enumerate(clips)}
    number = np.array([place[name] for name in edit.clips], int)
    keys = tuple(replace(key, clip=int(number[key.clip])) for key in edit.keys)
    return replace(edit, clips=clips, clip=number[edit.clip], keys=keys)


def to_named_edit(library: Library, edit: EditList, moments: Sequence[KeyMoment]) -> NamedEdit:
    """Convert a library's edit list to one with named clips.

    Args:
        library: the library.
        edit: its edit list.
        moments: the timeline's key moments, by their index in the plan.
    Returns:
        The named edit list.
    """
    local = edit.frame - library.frames.first[edit.clip]
    starts = np.array(_find_run_starts(edit, local))
    length = np.diff(np.append(starts, len(edit)))
    last = starts + length - 1
    rate = np.where(length > 1, (local[last] - local[starts]) / np.maximum(length - 1, 1), 1.0)
    used = np.unique([*edit.clip[starts], *(placed.key.clip for placed in edit.keys)])
    row = {int(clip): number for number, clip in enumerate(used)}
    clips = tuple((library.clips[clip].path, library.clips[clip].mirrored) for clip in used)
    keys = [_to_named_key(placed, row, moments[placed.number].time) for placed in edit.keys]
    clip = np.array([row[int(clip)] for clip in edit.clip[starts]], int)
    cut = np.isin(starts, edit.transitions) | (starts == 0)
    return NamedEdit(clips=clips, clip=clip, first=local[starts], rate=rate, length=length, cut=cut,
                     keys=tuple(sorted(keys, key=lambda key: key.time)))


def _find_run_starts(edit: EditList, local: np.ndarray) -> list[int]:
    """Find the frames at which another piece starts, or the same one continues at another rate."""
    starts = []
    for low, high in edit.pieces:
        step = np.diff(local[low:high])
        starts += [low, *(low + 1 + np.flatnonzero(np.abs(np.diff(step)) > _RATE_TOLERANCE)).tolist()]
    return starts


def _to_named_key(placed: PlacedKey, row: dict[int, int], time: float) -> NamedKey:
    key = placed.key
    return NamedKey(time=time, clip=row[key.clip], frame=key.frame, start=key.start, end=key.end,
                    words=tuple(sorted(key.labels)))


def to_library_edit(library: Library, edit: NamedEdit, moments: Sequence[KeyMoment] = ()) -> EditList:
    """Convert a named edit list to one of `library`.

    Args:
        library: the library.
        edit: the named edit list.
        moments: key moments; those the edit list serves are placed, by their index.
    Returns:
        The library's edit list.
    Raises:
        InputError: if the library lacks a clip, or a clip is shorter than what is used of it.
    """
    place = {(clip.path, clip.mirrored): number for number, clip in enumerate(library.clips)}
    for path, mirrored in edit.clips:
        if (path, mirrored) not in place:
            found = f"no clip {path}{' (mirrored)' if mirrored else ''}"
            raise InputError(library.folder, found, "the library of this match", "run the match again")
    number = np.array([place[name] for name in edit.clips], int)
    clip, local = edit.frames()
    pool = library.frames.first[number[clip]] + local
    wanted = {moment.time: index for index, moment in enumerate(moments)}
    keys = [PlacedKey(wanted[key.time], Key(int(number[key.clip]), key.frame, key.start, key.end, frozenset(key.words)))
            for key in edit.keys if key.time in wanted]  # fmt: skip
    return EditList(number[clip], pool, edit.seams, tuple(sorted(keys, key=lambda key: key.number)))
