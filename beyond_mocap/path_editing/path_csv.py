"""A path as a table: `x_m,y_m[,z_m]`, its points from the first to the last."""

from __future__ import annotations

import os

import numpy as np

from ..base.errors import InputError
from ..files.tables import number, read_rows

COLUMNS = ("x_m", "y_m", "z_m")
_SHORT = {name[0]: name for name in COLUMNS}
_SAME, _LONGEST = 1e-6, 1e5  # metres


def read_curve(path: str | os.PathLike) -> np.ndarray:
    """(N, 3) metres, N >= 2: the points of a CSV file in the order of its rows, in the pitch's frame, z 0 where the
    column is missing; other columns are ignored. The columns may also be named x, y and z, and be separated by
    semicolons or tabs; then numbers may have decimal commas.

    InputError, with the line, where a cell is no number or lies beyond 10 km; where fewer than two different points are
    given, or more than 100 km in all.
    """
    names, points = COLUMNS[:2], []
    for place, row in read_rows(path, names, _SHORT, ",;\t"):
        if not points:
            names = COLUMNS if "z_m" in row else names
        points.append([number(row[name], name, place) for name in names])
    line = np.zeros((len(points), 3))
    if points:
        line[:, : len(names)] = points
    if not len(line) or np.ptp(line, axis=0).max() < _SAME:
        what = f"{len(line)} points, all at one place" if len(line) > 1 else f"{len(line)} points"
        raise InputError(path, what, "at least two rows under x_m,y_m[,z_m] that lie apart", "add points")
    if (length := np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) > _LONGEST:
        most = f"at most {_LONGEST / 1000:.0f} km"
        raise InputError(path, f"a path of {length / 1000:.0f} km", most, "check the unit")
    return line
