"""Annotations of library clips: `NAME.txt` beside `NAME.bvh`, or rows of an `annotations.csv`."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from ..base.errors import InputError
from .text import parse_timeline, read_text
from .timeline import KeyMoment, Span, Timeline
from .vocabulary import DISCRETE, TRANSITION

_COLUMNS = ("file", "start_frame", "end_frame", "key_frame", "labels")


@dataclass(frozen=True)
class ClipAnnotation:
    """Labels for a span of one clip.

    Attributes:
        start, end: 0-based frames at the clip's own rate, end included.
        key: frame of the key moment (such as ball contact), None without one.
        words: the labels, from root to leaf, then modifiers.
        place: file:line that it was read from, for messages only; "" if unknown.
    """

    start: float
    end: float
    key: float | None
    words: tuple[str, ...]
    place: str = field(default="", compare=False, repr=False)


def read_clip_annotations(path: str | os.PathLike, fps: float) -> tuple[ClipAnnotation, ...]:
    """Read the annotations in a text file beside a clip, in the text form of timelines.

    A key line belongs to the shortest span around it that names the same action, and adds its labels to that span; a
    key line without a span has no extent. Spans may overlap; spans without labels or with `transition` are skipped.

    Args:
        path: the file.
        fps: the clip's frame rate; times become the nearest frames.
    Returns:
        The annotations, ordered by start.
    Raises:
        InputError: if the file cannot be read or a line is invalid.
    """
    rows = build_clip_annotations(parse_timeline(read_text(path), str(path), fps), fps)
    return tuple(replace(row, place=f"{path}:{row.place}") for row in rows)


def build_clip_annotations(timeline: Timeline, fps: float) -> tuple[ClipAnnotation, ...]:
    """Convert a clip's timeline to annotations in frames.

    Args:
        timeline: seconds from the clip's first frame.
        fps: the clip's frame rate.
    Returns:
        The annotations, ordered by start, their place the line alone; see `read_clip_annotations`.
    """
    spans = [span for span in timeline.spans if span.words and span.words != (TRANSITION,)]
    owners = [_find_owner(key, spans) for key in timeline.keys]
    out = [_build_annotation(span, None, fps) for span in spans if span not in owners]
    out += [_build_annotation(owner, key, fps) for key, owner in zip(timeline.keys, owners)]
    return tuple(sorted(out, key=lambda a: (a.start, a.end, -1 if a.key is None else a.key)))


def read_annotation_csv(
    path: str | os.PathLike, skip_row: Callable[[Mapping], bool] | None = None
) -> dict[str, tuple[ClipAnnotation, ...]]:
    """Read a table of annotations.

    The columns are file, start_frame, end_frame, key_frame and labels; others are ignored. A blank key_frame means no
    key moment. Rows without labels are skipped.

    Args:
        path: the file.
        skip_row: receives a row (column -> text) and returns whether to skip it too.
    Returns:
        file, as spelled in the table -> its annotations in the table's order.
    Raises:
        InputError: with the line, if a row is invalid.
    """
    reader = csv.DictReader(io.StringIO(read_text(path), newline=""))
    by_file: dict[str, list[ClipAnnotation]] = {}
    try:
        _check_columns(reader.fieldnames, path)
        for row in reader:
            place = f"{path}:{reader.line_num}"
            labels = tuple(dict.fromkeys((row["labels"] or "").lower().split()))
            if labels and not (skip_row and skip_row(row)):
                by_file.setdefault(_parse_file(row, place), []).append(_parse_row(row, labels, place))
    except csv.Error as error:
        place = f"{path}:{reader.line_num}"
        raise InputError(place, str(error), "comma-separated values", "save it as CSV again") from None
    return {file: tuple(annotations) for file, annotations in by_file.items()}


def _find_owner(key: KeyMoment, spans: list[Span]) -> Span | None:
    """Find the shortest span around a key moment that names the same action."""
    around = [s for s in spans if s.start <= key.time <= s.end and _list_actions(key) & _list_actions(s)]
    return min(around, key=lambda span: span.end - span.start, default=None)


def _list_actions(item: Span | KeyMoment) -> set[str]:
    """List the labels that name the action: Appendix A's discrete roots, or without any all labels ("slide", user
    labels)."""
    labels = set(item.words)
    return labels & DISCRETE or labels


def _build_annotation(span: Span | None, key: KeyMoment | None, fps: float) -> ClipAnnotation:
    """Build the annotation of a span, of a key moment, or of both."""
    moment = None if key is None else round(key.time * fps)
    labels = dict.fromkeys((*(span.words if span else ()), *(key.words if key else ())))
    start, end = (span.start, span.end) if span else (key.time, key.time)
    line = (span or key).line
    return ClipAnnotation(round(start * fps), round(end * fps), moment, tuple(labels), str(line or ""))


def _check_columns(names, path) -> None:
    missing = [name for name in _COLUMNS if name not in (names or ())]
    if missing:
        found = f"no column {', '.join(missing)}" if names else "an empty file"
        raise InputError(f"{path}:1", found, f"a header with {', '.join(_COLUMNS)}",
                         "add the columns, or rename them")


def _parse_file(row: dict, place: str) -> str:
    name = (row["file"] or "").strip()
    if not name:
        raise InputError(place, "the file is blank", "the clip's path, relative to this table", "add it")
    return name


def _parse_row(row: dict, labels: tuple[str, ...], place: str) -> ClipAnnotation:
    start, end = (_parse_frame(row[name], name, place) for name in ("start_frame", "end_frame"))
    key = _parse_frame(row["key_frame"], "key_frame", place) if (row["key_frame"] or "").strip() else None
    if end < start:
        raise InputError(place, f"end_frame {end} before start_frame {start}", "start_frame <= end_frame",
                         "correct the frames")
    if key is not None and not start <= key <= end:
        raise InputError(place, f"key_frame {key} outside {start} .. {end}", "a key frame within its row",
                         "correct the frames")
    return ClipAnnotation(start, end, key, labels, place)


def _parse_frame(text: str | None, name: str, place: str) -> int:
    try:
        value = float(text or "")
        if not (value >= 0 and value == int(value)):
            raise ValueError
    except (ValueError, OverflowError):
        raise InputError(place, f"{name} {text!r}", "a whole number from 0", "correct the frame") from None
    return int(value)
