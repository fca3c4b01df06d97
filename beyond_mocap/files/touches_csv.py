"""Solved touches of the ball as a table."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable

import numpy as np

from .whole import atomic_write

COLUMNS = (
    "time_s", "uncertainty_s", "player", "part", "kind", "x_m", "y_m", "z_m",
    "before_x_m_s", "before_y_m_s", "before_z_m_s", "after_x_m_s", "after_y_m_s", "after_z_m_s", "confidence",
)  # fmt: skip


def write_touches(path: str | os.PathLike, touches: Iterable) -> None:
    """Writes one row for each touch (`ball.tracked.solve.SolvedTouch`), in their order."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for touch in touches:
        numbers = np.concatenate([touch.position, touch.before, touch.after])
        writer.writerow((
            f"{touch.time:.4f}", f"{touch.uncertainty:.4f}", touch.player, touch.part, touch.kind,
            *(f"{value:.3f}" for value in numbers), f"{touch.confidence:.3f}",
        ))  # fmt: skip
    atomic_write(path, out.getvalue())
