"""Files of pieces of work: JSON and arrays (never pickled) under a digest, so that altered files count as missing."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.digest import hex_digest
from .atomic import atomic_write

_HEADER, _DIGEST = "header", "digest"


def write_piece_file(path: Path, header: object, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a piece of work.

    Args:
        path: the file.
        header: plain values for JSON.
        arrays: by name, none with dtype object.
    Raises:
        InputError: if the file cannot be written.
    """
    text = json.dumps(header).encode()
    stored = {_HEADER: np.frombuffer(text, np.uint8),
              _DIGEST: np.frombuffer(_compute_digest(text, arrays).encode(), np.uint8)}
    out = io.BytesIO()
    np.savez_compressed(out, **stored, **arrays)
    atomic_write(path, out.getvalue())


def read_piece_file(path: Path) -> tuple | None:
    """Read what `write_piece_file` wrote.

    Args:
        path: the file.
    Returns:
        The header and the arrays by name; None if the file is missing, damaged or altered.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        text, digest = arrays.pop(_HEADER).tobytes(), arrays.pop(_DIGEST).tobytes()
        return (json.loads(text), arrays) if digest == _compute_digest(text, arrays).encode() else None
    except Exception:  # a damaged file can raise any error of zipfile, zlib and numpy
        return None


def _compute_digest(text: bytes, arrays: Mapping[str, np.ndarray]) -> str:
    """Compute the digest of a piece: of its text, and of names, types, shapes and numbers of its arrays."""
    parts = [part for name in sorted(arrays)
             for part in (f"{name} {arrays[name].dtype} {arrays[name].shape} ", arrays[name])]
    return hex_digest(text, *parts)
