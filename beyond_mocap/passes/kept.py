"""Cache of a library's hit analysis, stored as plain `.npz` arrays beside the library's own cache.

A file that is missing, damaged or computed from other recordings is ignored; a folder that cannot be written is left
alone.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np

from ..library.library import Library

# raised whenever the analysis or the stored arrays change
VERSION = 3


def load(library: Library, name: str) -> dict[str, np.ndarray] | None:
    """Load the arrays stored as `name` for the recordings of a library.

    Args:
        library: the library; its `kept` attribute gives the cache folder and the key of its recordings.
        name: file name without `.npz`.
    Returns:
        The arrays by name, or None if there is no valid file.
    """
    if library.kept is None:
        return None
    place, key = library.kept
    try:
        with np.load(Path(place) / f"{name}.npz", allow_pickle=False) as arrays:
            found = {part: arrays[part] for part in arrays.files}
        return found if bytes(found.pop("of").tobytes()) == _of(key) else None
    except Exception:  # a damaged file can raise any error of zipfile and numpy
        return None


def save(library: Library, name: str, arrays: dict[str, np.ndarray]) -> None:
    """Save arrays as `name`; the file is written completely or not at all.

    Args:
        library: the library; nothing is saved if it has no cache folder.
        name: file name without `.npz`.
        arrays: arrays by name, none with dtype object.
    """
    if library.kept is None:
        return
    place, key = library.kept
    try:
        Path(place).mkdir(parents=True, exist_ok=True)
        # write to a temporary file in the same folder, then rename: readers never see half a file
        handle, beside = tempfile.mkstemp(suffix=".part", dir=place)
    except OSError:
        return
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, of=np.frombuffer(_of(key), np.uint8), **arrays)
        os.replace(beside, Path(place) / f"{name}.npz")
    except OSError:
        Path(beside).unlink(missing_ok=True)


def _of(key: str) -> bytes:
    return f"{VERSION} {key}".encode()
