"""Write and read tables: the ball and its touches as CSV, and the JSON report.

Every writer writes a temporary file and renames it, so that no incomplete file is visible.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from ..base.content import decode_text, read_bytes
from ..base.errors import InputError, format_count
from ..motion.skeleton import freeze_array
from ..motion.track.ball_path import BallPath
from .atomic import atomic_write

BALL_COLUMNS = ("time_s", "x_m", "y_m", "z_m", "measured")
_MAX_BYTES = 2_000_000_000  # bytes of a file
_MAX_METRES = 1e4  # metres; larger coordinates are in a wrong unit
_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", ":": "colons", " ": "spaces"}
_WITH_COMMA = re.compile(r"^([+-]?\d*),(\d*(?:[eE][+-]?\d+)?)$")
_MAX_SECONDS = 1e11  # seconds: feeds count from kick-off, some from 1970

TOUCH_COLUMNS = (
    "time_s", "uncertainty_s", "player", "part", "kind", "x_m", "y_m", "z_m",
    "before_x_m_s", "before_y_m_s", "before_z_m_s", "after_x_m_s", "after_y_m_s", "after_z_m_s", "confidence",
)  # fmt: skip


def write_ball(path: str | os.PathLike, ball: BallPath) -> None:
    """Write `time_s,x_m,y_m,z_m,measured`; an unknown position has empty cells.

    Args:
        path: the file.
        ball: the ball's trajectory.
    """
    rows = zip(ball.times, *np.asarray(ball.positions).T, np.asarray(ball.measured).astype(int))
    text = format_csv(BALL_COLUMNS, ((f"{t:.6f}", _format_metres(x), _format_metres(y), _format_metres(z), m) for t, x,
                                     y, z, m in rows))
    atomic_write(path, text)


def read_ball(path: str | os.PathLike) -> BallPath:
    """Read a table that `write_ball` wrote; without the column `measured` all is measured.

    Args:
        path: the file.
    Returns:
        The ball's trajectory.
    Raises:
        InputError: with the line, if a row is invalid.
    """
    rows = list(read_rows(path, BALL_COLUMNS[:4]))
    positions = np.column_stack([parse_column(rows, name, blank=True) for name in BALL_COLUMNS[1:4]])
    times = parse_column(rows, "time_s")
    has_flags = bool(rows) and "measured" in rows[0][1]
    measured = parse_flags(rows, "measured") if has_flags else np.ones(len(rows), dtype=bool)
    return BallPath(freeze_array(times), freeze_array(positions), freeze_array(measured, bool))


def write_touches(path: str | os.PathLike, touches: Iterable) -> None:
    """Write one row for each touch, in their order.

    Args:
        path: the file.
        touches: `ball.tracked.solve.SolvedTouch` objects.
    """
    rows = (
        (f"{touch.time:.4f}", f"{touch.uncertainty:.4f}", touch.player, touch.part, touch.kind,
         *(f"{value:.3f}" for value in np.concatenate([touch.position, touch.before, touch.after])),
         f"{touch.confidence:.3f}") for touch in touches
    )  # fmt: skip
    atomic_write(path, format_csv(TOUCH_COLUMNS, rows))


def write_report(path: str | os.PathLike, report: dict) -> None:
    """Write a report as JSON; NaN and infinity become null, numpy arrays and tuples become lists.

    Args:
        path: the file.
        report: the report.
    """
    atomic_write(path, json.dumps(to_plain(report), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def to_plain(value):
    """Convert a value to JSON's own types.

    Args:
        value: a report or a part of it.
    Returns:
        The same with arrays, tuples and sets as lists, numpy numbers as numbers, NaN and infinity as None.
    """
    if isinstance(value, dict):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return to_plain(value.tolist())
    if isinstance(value, (list, tuple, set, frozenset)):
        return [to_plain(item) for item in (sorted(value) if isinstance(value, (set, frozenset)) else value)]
    if isinstance(value, np.generic):
        return to_plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


def read_rows(
    path: str | os.PathLike, required: Sequence[str], others: Mapping[str, str] = MappingProxyType({}),
    separators: str = ",",
) -> Iterable[tuple[str, dict[str, str]]]:
    """Iterate over the rows of a CSV file, without empty ones; names and cells are stripped.

    Args:
        path: the file.
        required: the columns that it must have.
        others: alternative column name -> required or further column.
        separators: allowed separators; the first that gives the required header is used. Without a comma as separator,
            a comma in a number is its decimal point.
    Returns:
        (place, row) of each row; place is `file:line`.
    Raises:
        InputError: if the file is missing, binary or empty, lacks a column, or a row has too few cells.
    """
    text = _read_text(path)
    separator = next((one for one in separators if not _find_missing(_parse_header(text, one, others), required)), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        names = _normalize_names(next(reader, []), others)
        _check_header(names, required, path)
        for cells in reader:
            place = f"{path}:{reader.line_num}"
            if not any(cell.strip() for cell in cells):
                continue
            if len(cells) < len(names):
                expected = f"{len(names)}, like the header"
                raise InputError(place, format_count(len(cells), "cell"), expected, "complete or delete the row")
            cells = [cell.strip() for cell in cells]
            if separator != ",":
                cells = [_WITH_COMMA.sub(r"\1.\2", cell) for cell in cells]
            yield place, dict(zip(names, cells))
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}", str(error), "comma-separated values") from None


def parse_number(text: str, name: str, place: str, blank: bool = False) -> float:
    """Parse a finite number from a cell.

    Args:
        text: the cell.
        name: its column.
        place: its line, for errors.
        blank: whether a blank cell is allowed.
    Returns:
        The number; NaN for a blank cell.
    Raises:
        InputError: if the cell is not a number, or beyond 10 km or the latest possible time.
    """
    if blank and text.lower() in ("", "nan"):
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(place, f"{name} {text!r}", "a number", "correct the cell" + " or leave it blank" * blank)
    if name.endswith("_m") and abs(value) > _MAX_METRES:
        raise InputError(place, f"{name} {text}", "metres from the pitch's centre", "check the unit")
    if name == "time_s" and abs(value) > _MAX_SECONDS:
        raise InputError(place, f"{name} {text}", "seconds", "check the unit")
    return value


def _read_text(path: str | os.PathLike) -> str:
    data = read_bytes(path, "a CSV file", _MAX_BYTES)
    if not data.strip():
        raise InputError(path, "the file is empty", "a CSV file with a header", "export it again")
    try:
        text = decode_text(data)
        found = "binary content" if "\0" in text else ""
    except ValueError:
        found = "binary content" if b"\0" in data else "is not UTF-8 text"
    if found:
        raise InputError(path, found, "a CSV file", "export it as UTF-8 text")
    return text


def _parse_header(text: str, separator: str, others: Mapping[str, str]) -> list[str]:
    """Parse the names of the columns with this separator."""
    try:
        return _normalize_names(next(csv.reader(io.StringIO(text, newline=""), delimiter=separator), []), others)
    except csv.Error:
        return []


def _normalize_names(names: Sequence[str], others: Mapping[str, str]) -> list[str]:
    """Strip the names of columns; one of `others` becomes its alternative unless that exists itself."""
    names = [name.strip() for name in names]
    return [others[name] if name in others and others[name] not in names else name for name in names]


def _find_missing(names: Sequence[str], required: Sequence[str]) -> list[str]:
    return [name for name in required if name not in names]


def _check_header(names: list[str], required: Sequence[str], path) -> None:
    if missing := _find_missing(names, required):
        listed = ",".join(names)[:80]
        found, next_step = f"no column {', '.join(missing)} in {listed!r}", "rename the columns, use commas"
        if len(names) == 1 and (separator := next((one for one in _SEPARATORS if one in names[0]), None)):
            found += f", which is separated by {_SEPARATORS[separator]}"
            if not _find_missing([name.strip() for name in names[0].split(separator)], required):
                next_step = "write commas between the cells, and points in numbers"
        raise InputError(f"{path}:1", found, f"a header with {','.join(required)}", next_step)
    if any(names.count(name) > 1 for name in required):
        raise InputError(f"{path}:1", "a column is repeated", "each column once")


def parse_column(rows, name: str, blank: bool = False) -> np.ndarray:
    """Parse a column of numbers.

    Args:
        rows: (place, row) from `read_rows`.
        name: the column.
        blank: whether blank cells are allowed.
    Returns:
        (N,), NaN for blank cells.
    Raises:
        InputError: with the line, if a cell is invalid.
    """
    return np.array([parse_number(row[name], name, place, blank) for place, row in rows], dtype=float)


def parse_flags(rows, name: str) -> np.ndarray:
    """Parse a column of 0 and 1.

    Args:
        rows: (place, row) from `read_rows`.
        name: the column.
    Returns:
        (N,) bool.
    Raises:
        InputError: with the line, for any other cell.
    """
    for place, row in rows:
        if row[name] not in ("0", "1"):
            raise InputError(place, f"{name} {row[name]!r}", "0 or 1")
    return np.array([row[name] == "1" for _, row in rows], dtype=bool)


def _format_metres(value: float) -> str:
    return f"{value:.4f}" if math.isfinite(value) else ""


def format_csv(header: Sequence[str], rows: Iterable[Sequence]) -> str:
    """Format a table as CSV.

    Args:
        header: names of the columns.
        rows: the cells of each row.
    Returns:
        The text.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()
