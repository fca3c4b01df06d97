"""Where the table with the ball of a recording lies."""

from __future__ import annotations

from pathlib import Path

ENDING = ".ball.csv"
"""Of the table with a recording's ball, in place of the recording's own ending."""


def find_ball_table(path: Path, file: Path) -> Path | None:
    """Find the table with the ball of a recording.

    Args:
        path: the recording.
        file: what is read in its place (`scan.Conversions`).
    Returns:
        The table beside the recording, else that of its conversion, else None.
    """
    tables = (path.with_suffix(ENDING), file.with_suffix(ENDING))
    return next((table for table in tables if table.is_file()), None)
