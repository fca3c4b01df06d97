"""Read an .npz as plain arrays and one text; nothing in it is executed, and stated sizes are verified before it is
unpacked.
"""

from __future__ import annotations

import io
import math
import os
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..base.content import open_file
from ..base.errors import InputError
from ..base.memory import check_memory
from .json_values import describe_value, parse_json

HEADER = "header"
"""Name of the array that holds a text as UTF-8 bytes."""

_WHOLE = "the file"  # place of errors that concern all of it, for readers that know only its bytes
_READ_ERRORS = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, ValueError, KeyError, IndexError,
                TypeError, AttributeError, NotImplementedError, RuntimeError, OverflowError, MemoryError, SyntaxError,
                tokenize.TokenError)  # fmt: skip
"""Errors of zipfile and numpy for truncated, damaged or malicious files."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Those of numpy; zipfile unpacks bzip2 and LZMA whole, of whatever size, before it looks at a limit."""
_BLOCK = 1 << 18  # bytes that are unpacked at once
_LARGE, _BYTES_PER_BYTE = 1e8, 2.0  # bytes of arrays; of memory for a byte of them: they are unpacked, and converted
_MAX_START = 1 << 14  # bytes before an array's values; numpy's own limit is 10,000 and some
_OWN_KINDS = "biufU"  # kinds of types in arrays of the program's own files


def read_plain_arrays(
    data: bytes, kind: str, types: tuple[np.dtype, ...], max_bytes: int, other_kinds: Mapping[str, str] | None = None
) -> dict[str, np.ndarray]:
    """Read all arrays of a file, with finite numbers only.

    Args:
        data: the file's bytes.
        kind: what it should be, for messages.
        types: number types that it may hold.
        max_bytes: largest total size of its arrays.
        other_kinds: array name -> what a file with that array and without a text is instead.
    Returns:
        Name -> read-only array; under HEADER its text as bytes.
    Raises:
        InputError: if it is not a zip of such arrays.
    """
    with _open_archive(io.BytesIO(data), kind, max_bytes) as archive:
        members = archive.infolist()
        names = [member.filename.removesuffix(".npy") for member in members]
        if HEADER not in names:
            found = (what for name, what in (other_kinds or {}).items() if name in names)
            raise InputError(_WHOLE, next(found, "an .npz with other content"), kind, "choose another file")
        if len(set(names)) < len(names):
            raise InputError("the arrays", "two have the same name", kind, "choose another file")
        return {name: _read_array(_unpack(archive, member), name, types) for name, member in zip(names, members)}


def read_named_arrays(path: Path, kind: str, types: tuple[np.dtype, ...], max_bytes: int,
                      names: Collection[str], is_finite: bool = True) -> dict[str, np.ndarray]:
    """Read some arrays of a file; what else it holds is not looked at.

    Args:
        path: the file.
        kind, types, max_bytes: see `read_plain_arrays`.
        names: of the arrays.
        is_finite: whether NaN and infinite values are refused.
    Returns:
        Name -> read-only array, of those that the file has.
    Raises:
        InputError: if it is not a zip, or one of these arrays is damaged or of another type.
    """
    with open_file(path, kind) as file, _open_archive(file, kind, max_bytes, str(path)) as archive:
        found = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
        return {name: _read_array(_unpack(archive, found[name]), f"{path}: {name}", types, is_finite)
                for name in names if name in found}


def read_own_arrays(source: Path | bytes, kind: str, max_bytes: int | None = None) -> dict[str, np.ndarray]:
    """Read all arrays of a file that this program wrote: numbers, also NaN, and texts.

    Args:
        source: the file, or its bytes.
        kind: what it should be, for messages.
        max_bytes: largest total size of its arrays; None where they are stored as they are: that of the file.
    Returns:
        Name -> read-only array.
    Raises:
        InputError: if it is missing, damaged or no zip of such arrays.
    """
    place = _WHOLE if isinstance(source, bytes) else str(source)
    with io.BytesIO(source) if isinstance(source, bytes) else open_file(source, kind) as file:
        size = file.seek(0, os.SEEK_END) if max_bytes is None else max_bytes
        with _open_archive(file, kind, size, place) as archive:
            return {name: _read_array(_unpack(archive, member), name, is_finite=False)
                    for member in archive.infolist() for name in [member.filename.removesuffix(".npy")]}


def list_arrays(path: Path) -> frozenset[str]:
    """List the names of a file's arrays; none where it is not a zip of them."""
    if not path.is_file():
        return frozenset()
    try:
        with zipfile.ZipFile(path) as archive:
            return frozenset(name.removesuffix(".npy") for name in archive.namelist())
    except _READ_ERRORS:
        return frozenset()


@contextmanager
def name_file(path: str | os.PathLike) -> Iterator[None]:
    """Context manager: errors of a file's bytes, arrays or header get the file's name in front.

    Args:
        path: the file.
    Raises:
        InputError: one line that begins with the file's name.
    """
    try:
        yield
    except InputError as error:
        raise InputError(path, str(error).removeprefix(f"{_WHOLE}: ")) from None


@contextmanager
def _open_archive(source, kind: str, max_bytes: int, place: str = _WHOLE) -> Iterator[zipfile.ZipFile]:
    """Open a zip whose members have a limited size, for which memory is free, and translate what goes wrong while it is
    read.
    """
    try:
        with zipfile.ZipFile(source) as archive:
            total = sum(member.file_size for member in archive.infolist())
            if total > max_bytes:
                raise InputError(place, f"its arrays have more than {max_bytes:,} bytes", kind, "choose another file")
            if total > _LARGE:
                check_memory(place, _BYTES_PER_BYTE * total, "cut it into shorter ones")
            yield archive
    except InputError:
        raise
    except _READ_ERRORS:
        raise InputError(place, "damaged, truncated or of another kind", kind,
                         "copy it again or choose another file") from None  # fmt: skip


def _unpack(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """Unpack a member to read-only bytes (N,), never more than its stated size N: where it has others, its checksum
    differs.
    """
    if member.compress_type not in _METHODS:
        raise NotImplementedError(f"compressed by method {member.compress_type}")
    data, place = np.empty(member.file_size, np.uint8), 0
    with archive.open(member) as file:
        while block := file.read(min(_BLOCK, len(data) - place)):  # without a number, zipfile unpacks all at once
            data[place : place + len(block)] = np.frombuffer(block, np.uint8)
            place += len(block)
    data.setflags(write=False)
    return data[:place]


def _read_array(data: np.ndarray, name: str, types: tuple[np.dtype, ...] | None = None,
                is_finite: bool = True) -> np.ndarray:
    """Read one array from the bytes of a .npy, without a copy; types: None for those of the program's own files.

    Only plain values of exactly the stated count are accepted, so neither objects nor false sizes are trusted.
    """
    handle = io.BytesIO(data[:_MAX_START].tobytes())
    version = np.lib.format.read_magic(handle)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(handle)
    is_known = dtype.kind in _OWN_KINDS and dtype.isnative if types is None else dtype in types
    if not is_known and not (name == HEADER and dtype == np.uint8):
        expected = f"one of {', '.join(map(str, types))}" if types else "numbers or text"
        raise InputError(name[-200:], f"values of type {str(dtype)[:40]}", expected)
    start = handle.tell()
    count = len(data) - start
    if any(size < 0 for size in shape) or math.prod(shape) * dtype.itemsize != count:
        raise InputError(name[-200:], f"{count} bytes for shape {str(shape)[:40]}", "the shape's number of bytes")
    array = np.frombuffer(data, dtype, offset=start).reshape(shape, order="F" if fortran else "C")
    if is_finite and dtype.kind == "f" and not np.isfinite(array).all():
        raise InputError(name[-200:], "NaN or infinite values", "finite numbers", "create the file again")
    return array


def take_header(arrays: dict[str, np.ndarray], *, form: str, version: int, kind: str, page: str,
                remedy: str) -> dict:
    """Take the JSON object of a file out of its arrays.

    Args:
        arrays: from `read_plain_arrays`; HEADER is removed.
        form: "Beyond Mocap ...", its "format".
        version: its "version".
        kind: what the file should be, for messages.
        page: page of the docs that describes the file.
        remedy: what to do with a file of another version.
    Returns:
        The object.
    Raises:
        InputError: if it is no object of that format and version.
    """
    header = parse_json(_take_text(arrays, page), HEADER, page)
    if not isinstance(header, dict) or header.get("format") != form:
        raise InputError(HEADER, f"not a {form.removeprefix('Beyond Mocap ')}", kind, "choose another file")
    if header.get("version") != version:
        raise InputError("version", describe_value(header.get("version")), str(version), remedy)
    return header


def _take_text(arrays: dict[str, np.ndarray], page: str) -> str:
    """Take the text of a file, which `page` of the docs describes, out of its arrays; InputError if it is none."""
    header = arrays.pop(HEADER)
    if header.dtype != np.uint8:
        raise InputError(_WHOLE, "an .npz with other content", f"a text under {HEADER!r}", f"see {page}")
    try:
        return header.tobytes().decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(HEADER, "is not UTF-8 text", "JSON", f"see {page}") from None
