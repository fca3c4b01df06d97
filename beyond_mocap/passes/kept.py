"""What the hit analysis of a library worked out, kept beside the library's cache as plain `.npz` arrays.

A file that is missing, damaged or of other recordings is not used; a place that cannot be written is left alone.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np

from ..library.library import Library

# raised whenever what is worked out or stored changes
VERSION = 3


def load(library: Library, name: str) -> dict[str, np.ndarray] | None:
    """The arrays kept as `name` for these recordings, or None."""
    if library.kept is None:
        return None
    place, key = library.kept
    try:
        with np.load(Path(place) / f"{name}.npz", allow_pickle=False) as arrays:
            found = {part: arrays[part] for part in arrays.files}
        return found if bytes(found.pop("of").tobytes()) == _of(key) else None
    except Exception:  # a damaged file can fail in any of zipfile's and numpy's own ways
        return None


def save(library: Library, name: str, arrays: dict[str, np.ndarray]) -> None:
    """Keeps arrays (none of them of objects) as `name`, written whole or not at all."""
    if library.kept is None:
        return
    place, key = library.kept
    try:
        Path(place).mkdir(parents=True, exist_ok=True)
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
