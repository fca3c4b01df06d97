"""Cache of a library's hit analysis, stored as plain `.npz` arrays beside the library's own cache.

A file that is missing, damaged or computed from other recordings is ignored; a folder that cannot be written is left
alone.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..files.atomic import atomic_write
from ..files.plain_npz import read_own_arrays
from ..library.library import Library

# raised whenever the analysis or the stored arrays change
VERSION = 3


def load_arrays(library: Library, name: str) -> dict[str, np.ndarray] | None:
    """Load the arrays stored as `name` for the recordings of a library.

    Args:
        library: the library; its `cache_location` gives the cache folder and the key of its recordings.
        name: file name without `.npz`.
    Returns:
        The arrays by name, or None if there is no valid file.
    """
    if library.cache_location is None:
        return None
    folder, key = library.cache_location
    try:
        stored = read_own_arrays(Path(folder) / f"{name}.npz", "hits of a library")
        return stored if stored.pop("of").tobytes() == _encode_key(key) else None
    except (InputError, KeyError):
        return None


def save_arrays(library: Library, name: str, arrays: dict[str, np.ndarray]) -> None:
    """Save arrays as `name`; the file is written completely or not at all.

    Args:
        library: the library; nothing is saved if it has no cache folder.
        name: file name without `.npz`.
        arrays: arrays by name, none with dtype object.
    """
    if library.cache_location is None:
        return
    folder, key = library.cache_location
    content = io.BytesIO()
    np.savez(content, of=np.frombuffer(_encode_key(key), np.uint8), **arrays)
    with contextlib.suppress(OSError, InputError):
        Path(folder).mkdir(parents=True, exist_ok=True)
        atomic_write(Path(folder) / f"{name}.npz", content.getvalue())


def _encode_key(key: str) -> bytes:
    return f"{VERSION} {key}".encode()
