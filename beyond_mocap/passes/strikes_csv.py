"""The strikes of a passing scene as a table."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping

from ..files.whole import atomic_write

COLUMNS = (
    "time_s", "frame", "player", "kind", "part", "side", "clip", "clip_frame", "mirrored", "x_m", "y_m", "z_m",
    "speed_in_m_s", "speed_out_m_s", "travel_s", "bounces", "facing_deg", "contact_gap_m", "outcome",
)  # fmt: skip


def write_strikes(path: str | os.PathLike, strikes: Iterable[Mapping]) -> None:
    """Writes one row for each strike, in their order; a strike has every one of COLUMNS, None for an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in strikes:
        writer.writerow([_cell(one[name]) for name in COLUMNS])
    atomic_write(path, out.getvalue())


def _cell(value) -> str:
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return "" if value != value else f"{value:.6g}"
    return "" if value is None else str(value)
