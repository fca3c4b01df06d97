"""Pins as a table `time_s,part,x_m,y_m,z_m,hold_s`: one line per place of a hand, a foot, the gaze or the ball."""

from __future__ import annotations

import csv
import io
import os

from ..annotation import read_text
from ..base.errors import InputError
from ..files.tables import parse_number
from .pin import Pin

COLUMNS = ("time_s", "part", "x_m", "y_m", "z_m", "hold_s")


def read_pins(path: str | os.PathLike) -> tuple[Pin, ...]:
    """Read pins from a CSV file.

    Times are seconds on the track's clock, positions metres in the world, Z up; hold_s may be missing or blank (a
    moment).

    Args:
        path: the file.
    Returns:
        The pins, in the order of the lines.
    Raises:
        InputError: naming the line that does not have this form.
    """
    reader = csv.DictReader(io.StringIO(read_text(path), newline=""))
    try:
        missing = [name for name in COLUMNS[:-1] if name not in (reader.fieldnames or ())]
        if missing:
            raise InputError(f"{path}:1", f"no column {', '.join(missing)}", f"a header with {','.join(COLUMNS)}",
                             "add the columns, or rename them")
        return tuple(_build_pin(row, f"{path}:{reader.line_num}") for row in reader)
    except csv.Error as error:
        place = f"{path}:{reader.line_num}"
        raise InputError(place, str(error), "comma-separated values", "save it as CSV again") from None


def _build_pin(row: dict, place: str) -> Pin:
    """Build the pin of a row."""
    time, x, y, z, hold = (_parse_number(row, name, place) for name in ("time_s", "x_m", "y_m", "z_m", "hold_s"))
    try:
        return Pin(time, (row["part"] or "").strip().lower(), (x, y, z), hold)
    except InputError as error:
        raise InputError(place, str(error)) from None


def _parse_number(row: dict, name: str, place: str) -> float:
    """Parse a number of a row; a blank hold is 0."""
    text = (row.get(name) or "").strip()
    return parse_number(text, name, place) if text or name != "hold_s" else 0.0
