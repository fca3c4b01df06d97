"""A name for what a value holds, by which work that was done already is found again: the same content has the same
name in every process and on every machine."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

_LENGTH = 20  # bytes of a digest


def digest_of(*values: object) -> str:
    """Hex digits that stand for the content of `values`: plain values, arrays, and dataclasses, tuples and mappings of
    such, however deep. TypeError for anything else, which has no content that could be told."""
    hashed = hashlib.blake2b(digest_size=_LENGTH)
    _feed(hashed, values)
    return hashed.hexdigest()


def digest_of_file(path: str | os.PathLike) -> str:
    """The same for the bytes of a file; OSError where it cannot be read."""
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=_LENGTH)).hexdigest()


def _feed(hashed, value: object) -> None:
    """Every value begins with its kind and ends its text with a zero, so that no two contents give the same bytes."""
    if isinstance(value, np.ndarray):
        hashed.update(f"array {value.dtype.str} {value.shape}\0".encode())
        hashed.update(np.ascontiguousarray(value).tobytes())
    elif value is None or isinstance(value, (bool, int, float, str, bytes, np.generic)):
        value = value.item() if isinstance(value, np.generic) else value
        hashed.update(f"{type(value).__name__} {value!r}\0".encode())
    elif isinstance(value, Path):
        hashed.update(f"path {value.as_posix()}\0".encode())
    else:
        _feed_parts(hashed, value)


def _feed_parts(hashed, value: object) -> None:
    if is_dataclass(value) and not isinstance(value, type):
        parts = [(field.name, getattr(value, field.name)) for field in fields(value)]
        kind = type(value).__name__
    elif isinstance(value, Mapping):
        parts, kind = sorted(value.items()), "mapping"
    elif isinstance(value, (set, frozenset)):
        parts, kind = sorted(value), "set"
    elif isinstance(value, (tuple, list)):
        parts, kind = value, "row"
    else:
        raise TypeError(f"{type(value).__name__} has no content that could be told")
    hashed.update(f"{kind} {len(parts)}\0".encode())
    for part in parts:
        _feed(hashed, part)
