"""What is written into a library's folder: clips, and words where it reads them: `NAME.txt` beside the clip, or the
rows of an `annotations.csv`.

Files are written beside their place and renamed, so that none is ever found half-written. Nothing that is there is
replaced unless the caller says so.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path

from ..annotation import ClipAnnotation, KeyMoment, Span, Timeline, read_annotation_csv
from ..annotation.text import read_text
from ..annotation.timeline import checked_words
from ..annotation.vocabulary import vocabulary_words
from ..base.errors import InputError
from ..files.bvh import bvh
from ..files.whole import atomic_write
from ..motion.motion import Motion
from .scan import TABLE_NAME, Annotations
from .word_sources import Sources, cells, comment, sources_in_table, sources_in_text

TEXT, TABLE = "TEXT", "TABLE"


def as_timeline(rows: Sequence[ClipAnnotation], fps: float) -> Timeline:
    """A clip's rows in the form in which words are edited: seconds from its first frame. A row of one frame that is a
    key moment is that moment alone."""
    spans = [
        Span(row.start / fps, max(row.end, row.start + 0.5) / fps, row.words)
        for row in rows if row.key is None or row.end > row.start
    ]
    return Timeline(tuple(spans), tuple(KeyMoment(row.key / fps, row.words) for row in rows if row.key is not None))


def within(rows: Sequence[ClipAnnotation], count: int) -> tuple[ClipAnnotation, ...]:
    """Rows cut to a clip of `count` frames; those that lie outside are left out."""
    out = []
    for row in rows:
        start, end = max(0, row.start), min(count - 1, row.end)
        if start <= end and (row.key is None or start <= row.key <= end):
            out.append(ClipAnnotation(start, end, row.key, row.words))
    return tuple(out)


def read_words(clip: Path, folder: Path, fps: float) -> tuple[ClipAnnotation, ...]:
    """What a library in `folder` reads about one clip; InputError where that is broken."""
    return Annotations(folder, [clip]).of(clip, fps)


def read_sources(clip: Path, folder: Path, rows: tuple[ClipAnnotation, ...], fps: float) -> Sources:
    """Who said the rows that `read_words` gave; those that a person has written have no source."""
    form, target = place(clip, folder)
    if not target.is_file():
        return {}
    if form == TEXT:
        return sources_in_text(target, rows, fps)
    return sources_in_table(target, _name_in(target, clip), rows)


def place(clip: Path, folder: Path) -> tuple[str, Path]:
    """Where the words of a clip belong: TEXT and `NAME.txt`, or TABLE and the table that speaks of it. A text that is
    there counts most, then a table with rows for it, then one that stands in its folder."""
    beside = clip.with_suffix(".txt")
    if beside.is_file():
        return TEXT, beside
    tables = Annotations(folder, [clip]).tables
    absolute = Path(os.path.normpath(clip.absolute()))
    for parent in absolute.parents:
        if parent in tables and tables[parent].get(absolute.relative_to(parent).as_posix()):
            return TABLE, parent / TABLE_NAME
    return (TABLE, absolute.parent / TABLE_NAME) if absolute.parent in tables else (TEXT, beside)


def text_of(rows: Sequence[ClipAnnotation], sources: Sources | None = None) -> str:
    """The rows in the text form, in frames of the clip; behind those of `sources` who said it."""
    lines = []
    for row in rows:
        words = " ".join(row.words) + comment(row, sources or {})
        if row.key is None or row.end > row.start:
            lines.append((row.start, f"{row.start}f {max(row.end, row.start + 1)}f {words}"))
        if row.key is not None:
            lines.append((row.key, f"{row.key}f {words}"))
    return "".join(line + "\n" for _, line in sorted(lines, key=lambda line: line[0]))


def keep(
    clip: Path, folder: Path, rows: Sequence[ClipAnnotation], fps: float, overwrite: bool = False,
    sources: Sources | None = None,
) -> Path:
    """Write a clip's rows where they belong (`place`); returns the file. sources: who said those that no person did.

    InputError where words that differ are there and `overwrite` is not set, or where the file cannot be written."""
    form, target = place(clip, folder)
    if has_words(clip, folder, fps) and not overwrite:
        what = "has other words for this clip already"
        raise InputError(target, what, "a clip without words", "say that they may be overwritten")
    if form == TEXT:
        atomic_write(target, text_of(rows, sources))
    else:
        atomic_write(target, _table(target, _name_in(target, clip), rows, fps, sources or {}))
    return target


def _name_in(table: Path, clip: Path) -> str:
    """How a table's column `file` spells a clip."""
    return Path(os.path.normpath(clip.absolute())).relative_to(table.parent).as_posix()


def has_words(clip: Path, folder: Path, fps: float) -> bool:
    """Whether anything is written about a clip where its words belong; a text that cannot be read counts too."""
    form, target = place(clip, folder)
    if form == TEXT:
        return target.is_file() and bool(target.read_bytes().strip())
    return bool(read_words(clip, folder, fps))


def _table(table: Path, name: str, rows: Sequence[ClipAnnotation], fps: float, sources: Sources) -> str:
    """The table's text with these rows in place of those of the clip; other rows and columns stay as they are."""
    read_annotation_csv(table)  # one that is broken is told, not made worse
    text = read_text(table)
    reader = csv.DictReader(io.StringIO(text, newline=""))
    out = io.StringIO(newline="")
    ending = "\r\n" if "\r\n" in text else "\n"
    writer = csv.DictWriter(out, reader.fieldnames, restval="", extrasaction="ignore", lineterminator=ending)
    writer.writeheader()
    old = list(reader)
    first = next((number for number, row in enumerate(old) if row["file"].strip() == name), len(old))
    kept = [row for row in old if row["file"].strip() != name]
    new = [{"file": name, "fps": f"{fps:g}", "start_frame": row.start, "end_frame": row.end,
            "key_frame": "" if row.key is None else row.key, "labels": " ".join(row.words),
            **cells(row, sources)} for row in rows]
    before = len([row for row in old[:first] if row["file"].strip() != name])
    writer.writerows([*kept[:before], *new, *kept[before:]])
    return out.getvalue()


def plain_words(words: Sequence[str]) -> tuple[str, ...]:
    """The words of an annotation as they are written, also of several in one text. InputError for one that is none."""
    return checked_words(" ".join(words).split(), "words")


def free_place(folder: Path, name: str) -> Path:
    """Where a clip of that name goes. InputError where the folder is none, the name is none, or it is taken."""
    if not folder.is_dir():
        raise InputError(folder, "is not a folder", "a library's folder", "make the folder first")
    if not name.strip() or Path(name).name != name:
        raise InputError(repr(name), "is no name for a clip", "a file name without a folder", "choose another name")
    clip = folder / f"{name}.bvh"
    if clip.exists():
        raise InputError(clip, "is there already", "a name that is free", "rename the trial or the clip")
    return clip


def add_clip(
    folder: Path, name: str, motion: Motion, words: Sequence[str] = (), key_seconds: float | None = None
) -> list[str]:
    """Writes NAME.bvh into a library's folder and, where there are words, NAME.txt; returns lines for people.

    words: of the annotation; with key_seconds, from the motion's first frame, they name that moment, else the whole
    motion. Nothing that is there is replaced. InputError where it cannot be written, for no word, or a key outside."""
    clip, words = free_place(folder, name), plain_words(words)
    key = None if key_seconds is None else round(key_seconds * motion.fps)
    if key is not None and not 0 <= key < len(motion):
        raise InputError(clip, f"its key lies at {key_seconds:.3f} s", f"0 to {motion.duration:.3f} s")
    rows = [ClipAnnotation(key, key, key, words)] if key is not None else []
    if words and key is None:
        rows = [ClipAnnotation(0, len(motion) - 1, None, words)]
    if words and has_words(clip, folder, motion.fps):
        raise InputError(clip.with_suffix(".txt"), "has words already", "a name that is free", "rename the clip")
    bvh.write(clip, motion)
    if words:
        keep(clip, folder, rows, motion.fps)
    strangers = sorted(set(words) - vocabulary_words())
    told = [f"{clip}: {' '.join(words) or 'without words'}"]
    return [*told, *(f"{word}: a word of this library's own" for word in strangers)]
