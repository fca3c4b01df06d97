"""What the library's clips are annotated with: `NAME.txt` beside `NAME.bvh`, or rows of an `annotations.csv`."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..base.errors import InputError
from .text import parse_timeline, read_text
from .timeline import KeyMoment, Span, Timeline
from .vocabulary import DISCRETE, TRANSITION

_COLUMNS = ("file", "start_frame", "end_frame", "key_frame", "labels")


@dataclass(frozen=True)
class ClipAnnotation:
    """Words for a stretch of one clip. start, end: 0-based frames in the clip's own rate, end inclusive. key: the frame
    of the key moment (the foot meets the ball), None for none. words: from root to leaf plus modifiers."""

    start: float
    end: float
    key: float | None
    words: tuple[str, ...]


def read_clip_annotations(path: str | os.PathLike, fps: float) -> tuple[ClipAnnotation, ...]:
    """The annotations in a text file beside a clip, in the timelines' text form, ordered by start; InputError as there.

    fps: the clip's rate; times become its nearest frames. A key line belongs to the shortest span around it that names
    the same action, and lends it its words; a key line on its own has no extent. Spans may overlap; spans without words
    or with `transition` say nothing about a clip and are left out."""
    return clip_annotations(parse_timeline(read_text(path), str(path), fps), fps)


def clip_annotations(timeline: Timeline, fps: float) -> tuple[ClipAnnotation, ...]:
    """A clip's timeline (seconds from its first frame) as annotations in frames of the rate `fps`."""
    spans = [span for span in timeline.spans if span.words and span.words != (TRANSITION,)]
    owners = [_owner(key, spans) for key in timeline.keys]
    out = [_annotation(span, None, fps) for span in spans if span not in owners]
    out += [_annotation(owner, key, fps) for key, owner in zip(timeline.keys, owners)]
    return tuple(sorted(out, key=lambda a: (a.start, a.end, -1 if a.key is None else a.key)))


def read_annotation_csv(
    path: str | os.PathLike, but: Callable[[Mapping], bool] | None = None
) -> dict[str, tuple[ClipAnnotation, ...]]:
    """file (as the column spells it) -> its annotations in the table's order.

    Columns file, start_frame, end_frame, key_frame, labels; others are ignored. A blank key_frame means none; rows
    without labels are left out, and those (column -> text) of which `but` is true. InputError names the line of a row
    that is not of this form."""
    reader = csv.DictReader(io.StringIO(read_text(path), newline=""))
    found: dict[str, list[ClipAnnotation]] = {}
    try:
        _check_columns(reader.fieldnames, path)
        for row in reader:
            place = f"{path}:{reader.line_num}"
            words = tuple(dict.fromkeys((row["labels"] or "").lower().split()))
            if words and not (but and but(row)):
                found.setdefault(_file(row, place), []).append(_from_row(row, words, place))
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}", str(error), "comma-separated values") from None
    return {file: tuple(annotations) for file, annotations in found.items()}


def _owner(key: KeyMoment, spans: list[Span]) -> Span | None:
    around = [s for s in spans if s.start <= key.time <= s.end and _actions(key) & _actions(s)]
    return min(around, key=lambda span: span.end - span.start, default=None)


def _actions(item: Span | KeyMoment) -> set[str]:
    """The words that name what is done: App. A's discrete roots, or all words without any ("slide", user words)."""
    words = set(item.words)
    return words & DISCRETE or words


def _annotation(span: Span | None, key: KeyMoment | None, fps: float) -> ClipAnnotation:
    moment = None if key is None else round(key.time * fps)
    words = dict.fromkeys((*(span.words if span else ()), *(key.words if key else ())))
    start, end = (span.start, span.end) if span else (key.time, key.time)
    return ClipAnnotation(round(start * fps), round(end * fps), moment, tuple(words))


def _check_columns(names, path) -> None:
    missing = [name for name in _COLUMNS if name not in (names or ())]
    if missing:
        found = f"no column {', '.join(missing)}" if names else "an empty file"
        raise InputError(f"{path}:1", found, f"a header with {', '.join(_COLUMNS)}")


def _file(row: dict, place: str) -> str:
    name = (row["file"] or "").strip()
    if not name:
        raise InputError(place, "no file", "the clip's path, relative to this table")
    return name


def _from_row(row: dict, words: tuple[str, ...], place: str) -> ClipAnnotation:
    start, end = (_frame(row[name], name, place) for name in ("start_frame", "end_frame"))
    key = _frame(row["key_frame"], "key_frame", place) if (row["key_frame"] or "").strip() else None
    if end < start:
        raise InputError(place, f"end_frame {end} before start_frame {start}", "start_frame <= end_frame")
    if key is not None and not start <= key <= end:
        raise InputError(place, f"key_frame {key} outside {start} .. {end}", "a key frame within its row")
    return ClipAnnotation(start, end, key, words)


def _frame(text: str | None, name: str, place: str) -> int:
    try:
        value = float(text or "")
        if not (value >= 0 and value == int(value)):
            raise ValueError
    except (ValueError, OverflowError):
        raise InputError(place, f"{name} {text!r}", "a whole number from 0") from None
    return int(value)
