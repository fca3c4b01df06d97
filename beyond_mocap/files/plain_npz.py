"""An .npz as plain arrays and one text, of which nothing is ever executed and no size is believed."""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping

import numpy as np

from ..base.errors import InputError

HEADER = "header"
"""Name of the array that holds a text, as bytes of UTF-8."""

_BROKEN = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, ValueError, KeyError, IndexError, TypeError,
           AttributeError, NotImplementedError, RuntimeError, OverflowError, MemoryError, SyntaxError,
           tokenize.TokenError)  # fmt: skip
"""What zipfile and numpy raise for files that are cut short, damaged or made to harm."""


def plain_arrays(
    data: bytes, kind: str, types: tuple[np.dtype, ...], unpacked: int, others: Mapping[str, str] | None = None
) -> dict[str, np.ndarray]:
    """All arrays of a file's bytes by name, read-only, numbers all finite; and under HEADER its text, as bytes.

    kind: what the file should be, for messages. types: of numbers that it may hold. unpacked: bytes of all its arrays
    together above which it is no such file. others: what a file is instead that has an array of such a name and no
    text. InputError where it is no zip of such arrays."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > unpacked:
                raise InputError("the arrays", f"more than {unpacked:,} bytes", kind, "choose another file")
            names = [member.filename.removesuffix(".npy") for member in members]
            if HEADER not in names:
                found = (what for name, what in (others or {}).items() if name in names)
                raise InputError("the file", next(found, "an .npz of something else"), kind, "choose another file")
            if len(set(names)) < len(names):
                raise InputError("the arrays", "two of one name", kind, "choose another file")
            return {name: _array(archive.read(member), name, types) for name, member in zip(names, members)}
    except InputError:
        raise
    except _BROKEN:
        raise InputError("the file", "damaged, cut short or of something else", kind,
                         "copy it again or choose another file") from None  # fmt: skip


def _array(data: bytes, name: str, types: tuple[np.dtype, ...]) -> np.ndarray:
    """One array out of the bytes of a .npy: plain numbers of exactly the stated count, so that neither an object nor an
    invented size is ever believed."""
    handle = io.BytesIO(data)
    version = np.lib.format.read_magic(handle)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(handle)
    if dtype not in types and not (name == HEADER and dtype == np.uint8):
        expected = ", ".join(str(each) for each in types)
        raise InputError(name[:80], f"values of type {str(dtype)[:40]}", f"one of {expected}")
    values = data[handle.tell() :]
    if any(size < 0 for size in shape) or math.prod(shape) * dtype.itemsize != len(values):
        raise InputError(name[:80], f"{len(values)} bytes for shape {str(shape)[:40]}", "as many as the shape says")
    array = np.frombuffer(values, dtype).reshape(shape, order="F" if fortran else "C")
    if dtype.kind == "f" and not np.isfinite(array).all():
        raise InputError(name[:80], "a value that is no number", "finite numbers", "make the file again")
    return array


def header_text(arrays: dict[str, np.ndarray], page: str) -> str:
    """The text of a file, which is taken out of its arrays. InputError where it is none; `page`: of the docs."""
    header = arrays.pop(HEADER)
    if header.dtype != np.uint8:
        raise InputError("the file", "an .npz of something else", f"a text under {HEADER!r}", f"see {page}")
    try:
        return header.tobytes().decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(HEADER, "no text in UTF-8", "JSON", f"see {page}") from None
