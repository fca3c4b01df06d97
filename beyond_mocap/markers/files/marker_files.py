"""Read files of optical markers in either form, C3D or TRC."""

from __future__ import annotations

import os
from pathlib import Path

from ...base.errors import InputError
from ..trial import MarkerTrial
from .c3d import read_c3d
from .trc import read_trc

ENDINGS = (".c3d", ".trc")
_READERS = dict(zip(ENDINGS, (read_c3d, read_trc)))


def read_markers(path: str | os.PathLike, unit: float | str | None = None, subject: str | None = None,
                 up: str | None = None) -> MarkerTrial:  # fmt: skip
    """Read the trial in a .c3d or .trc file.

    Args:
        path: the file.
        unit: metres per unit or a name; None for the file's own.
        subject: whose markers, if the file contains several bodies.
        up: the file's axis that points up ("Z", "-Y"); None to detect it.
    Returns:
        The trial, metres, Z up.
    Raises:
        InputError: if the ending is unknown, and as `read_c3d` and `read_trc`.
    """
    reader = _READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise InputError(path, f"ending {Path(path).suffix!r}", " or ".join(ENDINGS), "export it as C3D or TRC")
    return reader(path, unit, subject, up)
