"""Labels that no person wrote: proposals, and how a clip's annotations record each row's source and confidence.

In a text file they follow a line as a comment, `156f kick right low  # learned 0.93`; in a table they are in the
columns `source` and `confidence`, where it has them. Only learning reads them; a row that a person has changed has
none. A table of proposals has the reason in a third column, `why`, which is emptied when a person accepts the row.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...annotation import ClipAnnotation, build_clip_annotations, parse_timeline
from ...annotation.text import read_text

RULES, LEARNED = "rules", "learned"

FoundSources = dict[ClipAnnotation, tuple[str, float]]
Sources = Mapping[ClipAnnotation, tuple[str, float]]
"""A row -> its source (RULES or LEARNED) and its confidence from 0 to 1."""

_COMMENT = re.compile(rf"#\s*({RULES}|{LEARNED})\s+([01](?:\.\d+)?)\s*$")
COLUMNS = ("source", "confidence")
_ROW = ("start_frame", "end_frame", "key_frame", "labels")


@dataclass(frozen=True)
class Proposal:
    """Proposed labels for a stretch of a recording.

    Attributes:
        annotation: the row, in the recording's own frames.
        confidence: 0 to 1.
        why: the reason, for people.
        source: RULES, or LEARNED from annotated clips.
    """

    annotation: ClipAnnotation
    confidence: float
    why: str
    source: str = RULES


def format_comment(row: ClipAnnotation, sources: Sources) -> str:
    """Format the comment behind a row's lines; empty where a person wrote the row."""
    found = sources.get(row)
    return f"  # {found[0]} {found[1]:.2f}" if found else ""


def format_cells(row: ClipAnnotation, sources: Sources) -> dict[str, str]:
    """Format a table's cells in COLUMNS."""
    source, confidence = sources.get(row, ("", 0.0))
    return {"source": source, "confidence": f"{confidence:.2f}" if source else ""}


def is_unreviewed(row: Mapping) -> bool:
    """Whether a table's row (column -> text) was proposed and not accepted yet."""
    return (row.get("source") or "").strip() in (RULES, LEARNED) and bool((row.get("why") or "").strip())


def read_text_sources(path: Path, rows: tuple[ClipAnnotation, ...], fps: float) -> FoundSources:
    """Read the sources of rows in a text file; of a row with two lines the key moment's counts.

    Args:
        path: the file.
        rows: the rows that were read from it.
        fps: the clip's rate.
    Returns:
        The sources by row.
    Raises:
        InputError: if the file cannot be read.
    """
    comments = {}
    for line in read_text(path).splitlines():
        found = _COMMENT.search(line)
        for row in build_clip_annotations(parse_timeline(line, str(path), fps), fps) if found else ():
            comments[(row.start, row.end) if row.key is None else row.key, frozenset(row.words)] = found
    out = {}
    for row in rows:
        found = comments.get((row.key if row.key is not None else (row.start, row.end), frozenset(row.words)))
        if found:
            out[row] = (found[1], min(1.0, float(found[2])))
    return out


def read_table_sources(path: Path, name: str, rows: tuple[ClipAnnotation, ...]) -> FoundSources:
    """Read the sources of a clip's rows in a table that has the columns; `name` as its column `file` spells it."""
    rows_by_text: dict[tuple, ClipAnnotation] = {
        (str(row.start), str(row.end), "" if row.key is None else str(row.key), " ".join(row.words)): row
        for row in rows
    }
    out = {}
    for line in csv.DictReader(io.StringIO(read_text(path), newline="")):
        file, source, sure, *cells = ((line.get(column) or "").strip() for column in ("file", *COLUMNS, *_ROW))
        if file == name and source and re.fullmatch(r"[01](\.\d+)?", sure) and tuple(cells) in rows_by_text:
            out[rows_by_text[tuple(cells)]] = (source, min(1.0, float(sure)))
    return out
