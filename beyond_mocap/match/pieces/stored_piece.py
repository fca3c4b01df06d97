"""The result of a window in a file (never pickled): saved, loaded, and compared with the window and the library.

What is not in the expected form, or shows what the library cannot show, counts as missing and is searched again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np

from ...base.errors import InputError, TimedMessage, line_spans
from ...files.json_values import (
    check_bool,
    check_list,
    check_names,
    check_number,
    check_numbers,
    check_text,
    check_texts,
    check_whole_number,
    describe_value,
)
from ...files.piece_file import check_array, load_piece_file, write_piece_file
from ...library.clip import Clip
from ...library.features import FPS
from ...library.library import Library
from ...library.missing_actions import find_action_clip
from .named_edit import ClipName, NamedEdit, NamedKey
from .units import Unit, count_frames
from .windows import Piece

_ARRAYS = {"clip": np.int64, "first": np.float64, "rate": np.float64, "length": np.int64, "cut": np.bool_}
_PLACE = ("player", "stretch", "number", "first", "own")
_NAMES = (*_PLACE, "seconds", "hurried", "warnings", "clips", "keys")
_KEY_NAMES = tuple(field.name for field in fields(NamedKey))
_HELD_SECONDS = 1.0  # s beyond a clip's ends that an edit list may show: there the end is held
_MAX_FRAMES = 10_000_000


def save_piece(path: Path, piece: Piece) -> None:
    """Save a piece; InputError if it cannot be written."""
    header = {name: getattr(piece, name) for name in (*_PLACE, "seconds")}
    header |= {"hurried": piece.hurried_from, "warnings": [[str(line), line_spans(line)] for line in piece.warnings]}
    header |= {"clips": piece.edit.clips, "keys": [asdict(key) for key in piece.edit.keys]}
    write_piece_file(path, header, {name: getattr(piece.edit, name) for name in _ARRAYS})


def load_piece(path: Path) -> Piece | None:
    """Load the piece that `save_piece` wrote; None if there is no complete file of that form."""
    return load_piece_file(path, _parse_piece)


def fits_window(piece: Piece, unit: Unit, clips: Mapping[ClipName, Clip], library: Library) -> bool:
    """Say whether a stored piece can be the result of a window.

    Args:
        piece: the piece.
        unit: the window.
        clips: of the library with its synthetic clips (`list_library_clips`).
        library: the recordings, for synthetic actions.
    """
    edit, count = piece.edit, count_frames(unit.plan)
    if any(getattr(piece, name) != getattr(unit, name) for name in _PLACE) or len(edit) != count:
        return False
    moments = {moment.time for moment in unit.plan.timeline.keys}
    if not 0 <= (piece.hurried_from or 0) <= count or not moments.issuperset(key.time for key in edit.keys):
        return False
    shown = [clips.get((path, mirrored)) or find_action_clip(library, path) for path, mirrored in edit.clips]
    known = [clip for clip in shown if clip is not None]
    return len(known) == len(shown) and _is_within_clips(edit, known)


def list_library_clips(library: Library) -> dict[ClipName, Clip]:
    """List the clips of a library and its synthetic clips by path and side, without actions."""
    return {(clip.path, clip.mirrored): clip for clip in library.with_synthetic_clips.clips}


def _is_within_clips(edit: NamedEdit, clips: list[Clip]) -> bool:
    """Return whether the runs and key moments of an edit list lie within its `clips`, as far as their ends are held."""
    last = np.array([clip.motion.duration for clip in clips])
    ends = np.array([edit.first, edit.first + edit.rate * (edit.length - 1)]) / FPS
    at = np.array([key.frame / clips[key.clip].motion.fps for key in edit.keys])
    shown = np.array([key.clip for key in edit.keys], int)
    return bool(np.all((ends >= -_HELD_SECONDS) & (ends <= last[edit.clip] + _HELD_SECONDS))
                and np.all((at >= -_HELD_SECONDS) & (at <= last[shown] + _HELD_SECONDS)))


def _parse_piece(header, arrays: dict[str, np.ndarray]) -> Piece:
    """Parse what a file holds; InputError if it is in another form."""
    check_names(header, "header", _NAMES, _NAMES)
    clip = check_array(arrays, "clip", _ARRAYS["clip"], (None,))
    runs = {name: check_array(arrays, name, kind, clip.shape) for name, kind in _ARRAYS.items()}
    if not len(clip) or np.any(runs["length"] < 1) or np.any(runs["length"] > _MAX_FRAMES):
        raise InputError("length", f"{len(clip)} runs", f"one or more, each of 1 to {_MAX_FRAMES} frames")
    edit = NamedEdit(clips=tuple(_parse_clip(row) for row in check_list(header["clips"], "clips")), **runs,
                     keys=tuple(_parse_key(row) for row in check_list(header["keys"], "keys")))
    hurried, (low, high) = header["hurried"], check_numbers(header["own"], "own", 2, "[first, end]")
    stretch, number, first = (check_whole_number(header[name], name) for name in ("stretch", "number", "first"))
    return Piece(
        player=check_text(header["player"], "player"), stretch=stretch, number=number, first=first,
        own=(check_whole_number(low, "own"), check_whole_number(high, "own")), edit=edit,
        seconds=check_number(header["seconds"], "seconds"),
        warnings=tuple(_parse_warning(row) for row in check_list(header["warnings"], "warnings")),
        hurried_from=None if hurried is None else check_whole_number(hurried, "hurried"),
    )  # fmt: skip


def _parse_pair(row, where: str) -> list:
    if len(check_list(row, where)) != 2:
        raise InputError(where, describe_value(row), "two values")
    return row


def _parse_clip(row) -> ClipName:
    path, mirrored = _parse_pair(row, "clips")
    return check_text(path, "clips"), check_bool(mirrored, "clips")


def _parse_warning(row) -> TimedMessage:
    text, spans = _parse_pair(row, "warnings")
    times = [check_numbers(span, "warnings", 2, "[first, last]") for span in check_list(spans, "warnings")]
    return TimedMessage(check_text(text, "warnings"), *times)


def _parse_key(row) -> NamedKey:
    check_names(row, "keys", _KEY_NAMES, _KEY_NAMES)
    times = {name: check_number(row[name], "keys") for name in ("time", "frame", "start", "end")}
    if not times["start"] <= times["frame"] <= times["end"]:
        raise InputError("keys", describe_value(row), "start, frame and end in order")
    return NamedKey(clip=check_whole_number(row["clip"], "keys"), words=check_texts(row["words"], "keys"), **times)
