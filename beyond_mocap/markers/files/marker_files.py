"""Files of optical markers, whichever of the two forms: C3D and TRC."""

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
    """The trial in a .c3d or .trc file: metres, Z up.

    unit: metres per unit or a name, None for the file's own. subject: whose markers, where several bodies are in the
    file. up: the file's axis that points up ("Z", "-Y"), None to find it. InputError as `read_c3d` and `read_trc`."""
    reader = _READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise InputError(path, f"ending {Path(path).suffix!r}", " or ".join(ENDINGS), "export it as C3D or TRC")
    return reader(path, unit, subject, up)
