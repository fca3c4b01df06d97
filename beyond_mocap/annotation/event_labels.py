"""Convert match events to labels of the vocabulary by a small table that users may replace."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..base.errors import InputError
from .labels import list_labels
from .striking import BODY_PARTS
from .text import read_text
from .timeline import check_labels
from .vocabulary import SIDES, find_similar_labels, list_vocabulary


@dataclass(frozen=True)
class EventKind:
    """What a kind of event says about the ball.

    Attributes:
        name: the kind.
        ball: "sends", "takes" or "".
        touch: whether the player touches the ball: "certain", "possible" or "none".
    """

    name: str
    ball: str = ""
    touch: str = "possible"


EVENT_KINDS = (
    EventKind("pass", "sends", "certain"), EventKind("shot", "sends", "certain"),
    EventKind("clearance", "sends", "certain"), EventKind("receive", "takes"), EventKind("interception"),
    EventKind("tackle"), EventKind("aerial"), EventKind("save", touch="certain"),
    EventKind("catch", "takes", "certain"), EventKind("punch", touch="certain"),
    EventKind("pick-up", "takes", "certain"), EventKind("dribble"), EventKind("take-on"), EventKind("carry"),
    EventKind("touch"), EventKind("deflection"), EventKind("miscontrol"), EventKind("foul", touch="none"),
    EventKind("out", touch="none"), EventKind("other", touch="none"),
)  # fmt: skip
"""The kinds of events and touches, independent of providers."""

KINDS = tuple(kind.name for kind in EVENT_KINDS)

PLACEHOLDERS = {"side": SIDES, "height": list_labels(group="height"), "gait": list_labels(group="pace"),
                "jump": ("jump",), "dive": ("dive",), "duration": ("short_duration", "long_duration")}
"""Placeholders allowed in braces in a row's labels, and the labels that replace each."""

TABLE = Path(__file__).with_name("event_words.csv")
"""The table supplied with the project."""

_COLUMNS = ("kind", "part", "detail", "words")
_NEXT_STEP = "see docs/reference/match-input.md"


@dataclass(frozen=True)
class EventRow:
    """A row of the table.

    Attributes:
        kind: a kind of `KINDS`.
        part: a part of `BODY_PARTS`, "" for any.
        detail: a further property of the event, or "".
        words: the labels, with placeholders in braces.
    """

    kind: str
    part: str
    detail: str
    words: tuple[str, ...]


@dataclass(frozen=True)
class EventLabelTable:
    """The table.

    Attributes:
        rows: in the order of the file.
    """

    rows: tuple[EventRow, ...]

    def find_labels(
        self, kind: str, part: str = "", details: Collection[str] = (), placeholders: Mapping[str, str] | None = None
    ) -> tuple[str, ...]:
        """Find the labels for an event.

        Among the rows that match, a row with a part precedes one without, then a row with a detail one without, then
        the first.

        Args:
            kind: a kind of `KINDS`.
            part: a part of `BODY_PARTS`, "" if unknown.
            details: the known details.
            placeholders: placeholder -> label; missing and empty ones are left out.
        Returns:
            The labels; () if the event makes no key moment.
        """
        matching = [row for row in self.rows if row.kind == kind and row.part in ("", part)]
        matching = [row for row in matching if not row.detail or row.detail in details]
        if not matching:
            return ()
        row = max(matching, key=lambda row: (bool(row.detail), bool(row.part)))
        replacements = {f"{{{name}}}": word for name, word in (placeholders or {}).items()}
        labels = (replacements.get(word, "") if word.startswith("{") else word for word in row.words)
        return tuple(dict.fromkeys(word for word in labels if word))


def read_event_labels(path: str | os.PathLike | None = None, known_labels: Iterable[str] = ()) -> EventLabelTable:
    """Read the table from a CSV file with the columns kind, part, detail and words.

    Lines that begin with # are comments.

    Args:
        path: the file; None for the supplied table.
        known_labels: labels in addition to the vocabulary.
    Returns:
        The table.
    Raises:
        InputError: with the line, for an unknown kind, part or label, or a duplicate row.
    """
    path = TABLE if path is None else path
    known, rows, first_places = list_vocabulary(known_labels), [], {}
    lines = read_text(path).splitlines()
    without_comments = "\n".join("" if line.lstrip().startswith("#") else line for line in lines)
    reader = csv.reader(io.StringIO(without_comments, newline=""))
    header = None
    try:
        for cells in reader:
            cells, place = [cell.strip().lower() for cell in cells], f"{path}:{reader.line_num}"
            if not any(cells):
                continue
            if header is None:
                header = _check_header(cells, place)
                continue
            row = _parse_row(cells, known, place)
            if (same := first_places.setdefault(row[:3], place)) != place:
                description = ", ".join(row[:3])
                raise InputError(place, f"{description} is also in line {same.rpartition(':')[2]}", "each row once",
                                 _NEXT_STEP)
            rows.append(EventRow(*row))
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}", str(error), "comma-separated values") from None
    if not rows:
        raise InputError(path, "the table is empty", ",".join(_COLUMNS), _NEXT_STEP)
    return EventLabelTable(tuple(rows))


def _check_header(cells: list[str], place: str) -> list[str]:
    if tuple(cells) != _COLUMNS:
        raise InputError(place, f"columns {','.join(cells)[:60]!r}", ",".join(_COLUMNS), _NEXT_STEP)
    return cells


def _parse_row(cells: list[str], known: frozenset[str], place: str) -> tuple[str, str, str, tuple[str, ...]]:
    """Check one row's cells; return kind, part, detail and labels."""
    if len(cells) != len(_COLUMNS):
        raise InputError(place, f"{len(cells)} cells", f"{len(_COLUMNS)}: {','.join(_COLUMNS)}", _NEXT_STEP)
    kind, part, detail, text = cells
    if kind not in KINDS:
        raise InputError(place, f"kind {kind!r}", f"one of {', '.join(KINDS)}", _NEXT_STEP)
    if part and part not in BODY_PARTS:
        raise InputError(place, f"part {part!r}", f"one of {', '.join(BODY_PARTS)}, or blank", _NEXT_STEP)
    labels = text.split()
    for label in labels:
        if label.startswith("{"):
            if label[1:-1] not in PLACEHOLDERS or not label.endswith("}"):
                raise InputError(place, f"{label}", "one of " + " ".join(f"{{{name}}}" for name in PLACEHOLDERS),
                                 _NEXT_STEP)
        elif label not in known:
            offers = ", ".join(find_similar_labels(label, known)) or "a label of the vocabulary"
            raise InputError(place, f"the label {label!r} is not in the vocabulary", f"one like {offers}", _NEXT_STEP)
    check_labels((label for label in labels if not label.startswith("{")), place)
    return kind, part, detail, tuple(labels)
