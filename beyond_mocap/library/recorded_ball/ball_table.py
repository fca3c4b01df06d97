"""Where the table with the ball of a recording lies."""

from __future__ import annotations

import os
from pathlib import Path

ENDING = ".ball.csv"
"""Of the table with a recording's ball, in place of the recording's own ending."""


def find_ball_table(path: Path, file: Path) -> Path | None:
    """Find the table with the ball of a recording.

    Args:
        path: the recording.
        file: what is read in its place (`conversions.Conversions`).
    Returns:
        The table beside the recording, else that of its conversion, else None.
    """
    for recording in (path,) if file == path else (path, file):
        table = os.path.splitext(recording)[0] + ENDING  # a path object for each of thousands takes longer
        if os.path.isfile(table):
            return Path(table)
    return None
