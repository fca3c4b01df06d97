"""Files of pieces of work: JSON and arrays (never pickled) under a digest, so that altered files count as missing, and
so do those whose content is not in the expected form.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..base.digest import hex_digest
from ..base.errors import InputError
from .atomic import atomic_write
from .plain_npz import HEADER, read_own_arrays

_DIGEST = "digest"
_MAX_BYTES = 256 * 1024 * 1024  # of a piece's arrays; a larger one counts as missing

Result = TypeVar("Result")


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
    stored = {HEADER: np.frombuffer(text, np.uint8),
              _DIGEST: np.frombuffer(_compute_digest(text, arrays).encode(), np.uint8)}
    out = io.BytesIO()
    np.savez_compressed(out, **stored, **arrays)
    atomic_write(path, out.getvalue())


def load_piece_file(path: Path, parse: Callable[[Any, dict[str, np.ndarray]], Result]) -> Result | None:
    """Load a piece of work.

    Args:
        path: the file.
        parse: makes the result of the header and the arrays by name; InputError where they are not in its form.
    Returns:
        The result; None if the file is missing, damaged or altered, or its content is in another form.
    """
    found = read_piece_file(path)
    try:
        return None if found is None else parse(*found)
    except InputError:
        return None


def check_array(arrays: Mapping[str, np.ndarray], name: str, kind: type, shape: tuple[int | None, ...]) -> np.ndarray:
    """Check that a piece has an array of finite numbers.

    Args:
        arrays: of the piece, by name.
        name: of the array.
        kind: number type that holds all of its numbers.
        shape: None where any length is right.
    Returns:
        The array.
    Raises:
        InputError: if there is none of that type and shape, or a number is NaN or infinite.
    """
    values = arrays.get(name)
    if values is None or values.ndim != len(shape) or not np.can_cast(values.dtype, kind) or not np.isfinite(
            values).all() or any(count not in (None, size) for count, size in zip(shape, values.shape)):
        found = "no such array" if values is None else f"{values.dtype} {values.shape}"
        raise InputError(name, found, f"finite {np.dtype(kind)} {shape}")
    return values


def read_piece_file(path: Path) -> tuple | None:
    """Read what `write_piece_file` wrote.

    Args:
        path: the file.
    Returns:
        The header and the arrays by name; None if the file is missing, damaged or altered.
    """
    try:
        arrays = read_own_arrays(path, "a piece of work", _MAX_BYTES)
        text, digest = arrays.pop(HEADER).tobytes(), arrays.pop(_DIGEST).tobytes()
        return (json.loads(text), arrays) if digest == _compute_digest(text, arrays).encode() else None
    except (InputError, KeyError, ValueError, RecursionError):  # no text, or none of JSON
        return None


def _compute_digest(text: bytes, arrays: Mapping[str, np.ndarray]) -> str:
    """Compute the digest of a piece: of its text, and of names, types, shapes and numbers of its arrays."""
    parts = [part for name in sorted(arrays)
             for part in (f"{name} {arrays[name].dtype} {arrays[name].shape} ", arrays[name])]
    return hex_digest(text, *parts)
