"""Writing into a library's folder: clips, and labels where the library reads them: `NAME.txt` beside the clip, or the
rows of an `annotations.csv`.

Files are written under another name and renamed, so that none is ever half-written. Existing files are replaced only
at the caller's request.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path

from ...annotation import ClipAnnotation, KeyMoment, Span, Timeline, read_annotation_csv
from ...annotation.text import read_text
from ...annotation.timeline import check_labels
from ...annotation.vocabulary import list_vocabulary
from ...base.errors import InputError
from ...files.atomic import atomic_write
from ...files.bvh import bvh
from ...files.tables import write_ball
from ...motion.motion import Motion
from ...motion.track.ball_path import BallPath
from ..recorded_ball.ball_table import ENDING
from .annotations import TABLE_NAME, Annotations
from .label_sources import Sources, format_cells, format_comment, read_table_sources, read_text_sources

TEXT, TABLE = "TEXT", "TABLE"


def to_timeline(rows: Sequence[ClipAnnotation], fps: float) -> Timeline:
    """Convert a clip's rows to the form in which labels are edited: seconds from its first frame.

    A row of one frame that is a key moment becomes that moment alone.
    """
    spans = [
        Span(row.start / fps, max(row.end, row.start + 0.5) / fps, row.words)
        for row in rows if row.key is None or row.end > row.start
    ]
    return Timeline(tuple(spans), tuple(KeyMoment(row.key / fps, row.words) for row in rows if row.key is not None))


def limit_rows(rows: Sequence[ClipAnnotation], count: int) -> tuple[ClipAnnotation, ...]:
    """Cut rows to a clip of `count` frames; those that lie outside are left out."""
    out = []
    for row in rows:
        start, end = max(0, row.start), min(count - 1, row.end)
        if start <= end and (row.key is None or start <= row.key <= end):
            out.append(ClipAnnotation(start, end, row.key, row.words))
    return tuple(out)


def read_labels(clip: Path, folder: Path, fps: float) -> tuple[ClipAnnotation, ...]:
    """Read a clip's rows as a library in `folder` does; InputError where a file is broken."""
    return Annotations(folder, [clip]).read_rows(clip, fps)


def read_sources(clip: Path, folder: Path, rows: tuple[ClipAnnotation, ...], fps: float) -> Sources:
    """Read the sources of the rows from `read_labels`; rows that a person wrote have none."""
    form, target = find_label_file(clip, folder)
    if not target.is_file():
        return {}
    if form == TEXT:
        return read_text_sources(target, rows, fps)
    return read_table_sources(target, _build_table_name(target, clip), rows)


def find_label_file(clip: Path, folder: Path) -> tuple[str, Path]:
    """Find where the labels of a clip belong.

    An existing text has priority, then a table with rows for the clip, then a table in the clip's folder.

    Args:
        clip: the BVH file.
        folder: the library's.
    Returns:
        TEXT and `NAME.txt`, or TABLE and the table.
    """
    text_file = clip.with_suffix(".txt")
    if text_file.is_file():
        return TEXT, text_file
    tables = Annotations(folder, [clip]).tables
    absolute = Path(os.path.normpath(clip.absolute()))
    for parent in absolute.parents:
        if parent in tables and tables[parent].get(absolute.relative_to(parent).as_posix()):
            return TABLE, parent / TABLE_NAME
    return (TABLE, absolute.parent / TABLE_NAME) if absolute.parent in tables else (TEXT, text_file)


def format_rows(rows: Sequence[ClipAnnotation], sources: Sources | None = None) -> str:
    """Format rows as text, in frames of the clip, with a comment behind those in `sources`."""
    lines = []
    for row in rows:
        words = " ".join(row.words) + format_comment(row, sources or {})
        if row.key is None or row.end > row.start:
            lines.append((row.start, f"{row.start}f {max(row.end, row.start + 1)}f {words}"))
        if row.key is not None:
            lines.append((row.key, f"{row.key}f {words}"))
    return "".join(line + "\n" for _, line in sorted(lines, key=lambda line: line[0]))


def write_labels(
    clip: Path, folder: Path, rows: Sequence[ClipAnnotation], fps: float, overwrite: bool = False,
    sources: Sources | None = None,
) -> Path:
    """Write a clip's rows where they belong (`find_label_file`).

    Args:
        clip: the BVH file.
        folder: the library's.
        rows: the annotations.
        fps: of the clip.
        overwrite: replace different labels.
        sources: of the rows that no person wrote.
    Returns:
        The file.
    Raises:
        InputError: if there are different labels and `overwrite` is not set, or if the file cannot be written.
    """
    form, target = find_label_file(clip, folder)
    if has_labels(clip, folder, fps) and not overwrite:
        what = "already has other labels for this clip"
        raise InputError(target, what, "a clip without labels", "allow overwriting")
    if form == TEXT:
        atomic_write(target, format_rows(rows, sources))
    else:
        atomic_write(target, _format_table(target, _build_table_name(target, clip), rows, fps, sources or {}))
    return target


def _build_table_name(table: Path, clip: Path) -> str:
    """Build the clip's name as a table's column `file` spells it."""
    return Path(os.path.normpath(clip.absolute())).relative_to(table.parent).as_posix()


def has_labels(clip: Path, folder: Path, fps: float) -> bool:
    """Whether anything is written about a clip where its labels belong; a text that cannot be read counts too."""
    form, target = find_label_file(clip, folder)
    if form == TEXT:
        return target.is_file() and bool(target.read_bytes().strip())
    return bool(read_labels(clip, folder, fps))


def _format_table(table: Path, name: str, rows: Sequence[ClipAnnotation], fps: float, sources: Sources) -> str:
    """Format the table with these rows in place of those of the clip; other rows and columns stay as they are."""
    read_annotation_csv(table)  # raises InputError for a broken table instead of damaging it further
    text = read_text(table)
    reader = csv.DictReader(io.StringIO(text, newline=""))
    out = io.StringIO(newline="")
    ending = "\r\n" if "\r\n" in text else "\n"
    writer = csv.DictWriter(out, reader.fieldnames, restval="", extrasaction="ignore", lineterminator=ending)
    writer.writeheader()
    old = list(reader)
    first = next((number for number, row in enumerate(old) if row["file"].strip() == name), len(old))
    other_rows = [row for row in old if row["file"].strip() != name]
    new = [{"file": name, "fps": f"{fps:g}", "start_frame": row.start, "end_frame": row.end,
            "key_frame": "" if row.key is None else row.key, "labels": " ".join(row.words),
            **format_cells(row, sources)} for row in rows]
    before = len([row for row in old[:first] if row["file"].strip() != name])
    writer.writerows([*other_rows[:before], *new, *other_rows[before:]])
    return out.getvalue()


def parse_labels(words: Sequence[str]) -> tuple[str, ...]:
    """Parse the labels of an annotation, also of several in one text. InputError for an invalid one."""
    return check_labels(" ".join(words).split(), "words")


def find_free_file(folder: Path, name: str) -> Path:
    """Find the file for a new clip. InputError if the folder is missing, or the name is invalid or taken."""
    if not folder.is_dir():
        raise InputError(folder, "is not a folder", "a library's folder", "create the folder first")
    if not name.strip() or Path(name).name != name:
        raise InputError(repr(name), "is not a valid clip name", "a file name without a folder", "choose another name")
    clip = folder / f"{name}.bvh"
    if clip.exists():
        raise InputError(clip, "already exists", "a new name", "rename the trial or the clip")
    return clip


def add_clip(
    folder: Path, name: str, motion: Motion, words: Sequence[str] = (), key_seconds: float | None = None,
    ball: BallPath | None = None,
) -> list[str]:
    """Write NAME.bvh into a library's folder and, if there are labels or a ball, NAME.txt and NAME.ball.csv. Nothing is
    replaced.

    Args:
        folder: the library's.
        name: of the clip.
        motion: its motion.
        words: labels of the annotation.
        key_seconds: seconds from the first frame of the key moment that they name; None labels the whole motion.
        ball: of the recording, from its first frame at 0 s.
    Returns:
        Lines for people.
    Raises:
        InputError: if a file cannot be written, for an invalid label, or a key outside the motion.
    """
    clip, words = find_free_file(folder, name), parse_labels(words)
    key = None if key_seconds is None else round(key_seconds * motion.fps)
    if key is not None and not 0 <= key < len(motion):
        raise InputError(clip, f"a key moment at {key_seconds:.3f} s", f"0 to {motion.duration:.3f} s")
    rows = [ClipAnnotation(key, key, key, words)] if key is not None else []
    if words and key is None:
        rows = [ClipAnnotation(0, len(motion) - 1, None, words)]
    if words and has_labels(clip, folder, motion.fps):
        raise InputError(clip.with_suffix(".txt"), "already has labels", "a new name", "rename the clip")
    if ball is not None and clip.with_suffix(ENDING).exists():
        raise InputError(clip.with_suffix(ENDING), "already there", "a new name", "rename the clip")
    bvh.write_bvh(clip, motion)
    if ball is not None:
        write_ball(clip.with_suffix(ENDING), ball)
    if words:
        write_labels(clip, folder, rows, motion.fps)
    unknown = sorted(set(words) - list_vocabulary())
    lines = [f"{clip}: {' '.join(words) or 'no labels'}"]
    return [*lines, *(f"{word}: a label of this library only" for word in unknown)]
