"""Heading keys as a table `time_s,heading_deg,x_m,y_m,hold_s`: one line per heading, or per place that is faced."""

from __future__ import annotations

import os

import numpy as np

from ..base.errors import InputError
from ..files.tables import parse_number, read_rows
from .heading_request import HeadingKey

COLUMNS = ("time_s", "heading_deg", "x_m", "y_m", "hold_s")


def read_heading_keys(path: str | os.PathLike) -> tuple[HeadingKey, ...]:
    """Read heading keys from a CSV file.

    Times are seconds on the track's clock. A line has either heading_deg, degrees counterclockwise from +x, or x_m and
    y_m, metres in the world. The columns that no line uses may be missing; hold_s may be blank (a moment).

    Args:
        path: the file.
    Returns:
        The keys, in the order of the lines.
    Raises:
        InputError: naming the line that does not have this form.
    """
    rows = list(read_rows(path, COLUMNS[:1]))
    unknown = [name for _, row in rows[:1] for name in row if name not in COLUMNS]
    if unknown:
        raise InputError(f"{path}:1", f"unknown column {', '.join(unknown)}", f"some of {','.join(COLUMNS)}",
                         "rename or remove it")
    return tuple(_build_key(row, place) for place, row in rows)


def _build_key(row: dict[str, str], place: str) -> HeadingKey:
    """Build the key of a row."""
    time, hold = (parse_number(row.get(name, ""), name, place, name != "time_s") for name in ("time_s", "hold_s"))
    degrees, x, y = (parse_number(row.get(name, ""), name, place, True) for name in COLUMNS[1:4])
    if np.isnan(x) != np.isnan(y) or np.isnan(degrees) == np.isnan(x):
        given = ", ".join(name for name, value in zip(COLUMNS[1:4], (degrees, x, y)) if not np.isnan(value))
        raise InputError(place, given or "no heading", "either heading_deg, or x_m and y_m", "correct the row")
    direction = {"target": (x, y)} if np.isnan(degrees) else {"heading": float(np.radians(degrees))}
    try:
        return HeadingKey(time, hold=0.0 if np.isnan(hold) else hold, **direction)
    except InputError as error:
        raise InputError(place, str(error)) from None
