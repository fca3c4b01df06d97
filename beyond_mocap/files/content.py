"""Open and read files that users name; missing files, folders and files that are too large raise the same InputErrors.
"""

from __future__ import annotations

import os
from typing import BinaryIO

from ..base.errors import InputError, build_read_error


def open_file(path: str | os.PathLike, kind: str, max_bytes: int | None = None) -> BinaryIO:
    """Open a file for reading bytes.

    Args:
        path: the file.
        kind: what it should be, such as "a C3D file".
        max_bytes: largest valid size; None for any.
    Returns:
        The open file.
    Raises:
        InputError: if it cannot be opened or is too large.
    """
    try:
        handle = open(path, "rb")
        size = os.fstat(handle.fileno()).st_size
    except (OSError, ValueError) as error:
        raise build_read_error(path, kind, error) from None
    if max_bytes is not None and size > max_bytes:
        handle.close()
        raise InputError(path, f"has {size} bytes", f"{kind} of at most {max_bytes}", "choose another file")
    return handle


def read_bytes(path: str | os.PathLike, kind: str, max_bytes: int | None = None) -> bytes:
    """Read all bytes of a file.

    Args:
        path, kind, max_bytes: see `open_file`.
    Returns:
        The bytes.
    Raises:
        InputError: if it cannot be read or is too large.
    """
    with open_file(path, kind, max_bytes) as handle:
        try:
            return handle.read()
        except OSError as error:
            raise build_read_error(path, kind, error) from None


def read_utf8(path: str | os.PathLike, kind: str, max_bytes: int | None = None) -> str:
    """Read all text of a UTF-8 file, without a byte order mark.

    Args:
        path, kind, max_bytes: see `open_file`.
    Returns:
        The text.
    Raises:
        InputError: if it cannot be read, is too large or is not UTF-8.
    """
    try:
        return read_bytes(path, kind, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "is not UTF-8 text", kind, "choose another file, or save it as UTF-8") from None
