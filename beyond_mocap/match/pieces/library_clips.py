"""Edit lists of a library against those that name its clips (`named_edit`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...annotation import KeyMoment
from ...base.errors import InputError
from ...library.keys import Key
from ...library.library import Library
from ...synthesis.search.edit_list import EditList, PlacedKey
from .named_edit import NamedEdit, NamedKey

_EVEN = 1e-6
"""Library frames by which steps within a run may differ."""


def named(library: Library, edit: EditList, moments: Sequence[KeyMoment]) -> NamedEdit:
    """An edit list of `library` by its clips' names; moments: the timeline's key moments by their number in the
    order."""
    local = edit.frame - library.frames.first[edit.clip]
    starts = np.array(_run_starts(edit, local))
    length = np.diff(np.append(starts, len(edit)))
    last = starts + length - 1
    rate = np.where(length > 1, (local[last] - local[starts]) / np.maximum(length - 1, 1), 1.0)
    used = np.unique([*edit.clip[starts], *(placed.key.clip for placed in edit.keys)])
    row = {int(clip): number for number, clip in enumerate(used)}
    clips = tuple((library.clips[clip].path, library.clips[clip].mirrored) for clip in used)
    keys = [_named_key(placed, row, moments[placed.wanted].time) for placed in edit.keys]
    clip = np.array([row[int(clip)] for clip in edit.clip[starts]], int)
    cut = np.isin(starts, edit.seams) | (starts == 0)
    return NamedEdit(clips, clip, local[starts], rate, length, cut, tuple(sorted(keys, key=lambda key: key.time)))


def _run_starts(edit: EditList, local: np.ndarray) -> list[int]:
    """Frames at which another piece begins, or the same one goes on at another rate."""
    starts = []
    for low, high in edit.pieces:
        step = np.diff(local[low:high])
        starts += [low, *(low + 1 + np.flatnonzero(np.abs(np.diff(step)) > _EVEN)).tolist()]
    return starts


def _named_key(placed: PlacedKey, row: dict[int, int], time: float) -> NamedKey:
    key = placed.key
    return NamedKey(time, row[key.clip], key.frame, key.start, key.end, tuple(sorted(key.words)))


def bound(library: Library, edit: NamedEdit, moments: Sequence[KeyMoment] = ()) -> EditList:
    """The edit list of `library` that a named one means; key moments that `moments` have are placed, by their number in
    it. InputError where the library lacks a clip, or it is shorter than what is shown."""
    place = {(clip.path, clip.mirrored): number for number, clip in enumerate(library.clips)}
    for path, mirrored in edit.clips:
        if (path, mirrored) not in place:
            found = f"no clip {path}{' (mirrored)' if mirrored else ''}"
            raise InputError(library.folder, found, "the library that the match was made from", "make the match again")
    number = np.array([place[name] for name in edit.clips], int)
    clip, local = edit.frames()
    pool = library.frames.first[number[clip]] + local
    wanted = {moment.time: index for index, moment in enumerate(moments)}
    keys = [
        PlacedKey(wanted[key.time], Key(int(number[key.clip]), key.frame, key.start, key.end, frozenset(key.words)))
        for key in edit.keys if key.time in wanted
    ]  # fmt: skip
    return EditList(number[clip], pool, edit.seams, tuple(sorted(keys, key=lambda key: key.wanted)))
