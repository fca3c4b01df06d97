"""Open and read files that users name; missing files, folders and files that are too large raise the same InputErrors.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from ..base.errors import InputError


def opened(path: str | os.PathLike, kind: str, largest: int | None = None) -> BinaryIO:
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
    except FileNotFoundError:
        raise InputError(path, "no such file", kind, "check the path") from None
    except (OSError, ValueError) as error:
        raise _refused(path, kind, error) from None
    if largest is not None and size > largest:
        handle.close()
        raise InputError(path, f"has {size} bytes", f"{kind} of at most {largest}", "choose another file")
    return handle


def content(path: str | os.PathLike, kind: str, largest: int | None = None) -> bytes:
    """Read all bytes of a file.

    Args:
        path, kind, max_bytes: see `open_file`.
    Returns:
        The bytes.
    Raises:
        InputError: if it cannot be read or is too large.
    """
    with opened(path, kind, largest) as handle:
        try:
            return handle.read()
        except OSError as error:
            raise _refused(path, kind, error) from None


def utf8(path: str | os.PathLike, kind: str, largest: int | None = None) -> str:
    """Read all text of a UTF-8 file, without a byte order mark.

    Args:
        path, kind, max_bytes: see `open_file`.
    Returns:
        The text.
    Raises:
        InputError: if it cannot be read, is too large or is not UTF-8.
    """
    try:
        return content(path, kind, largest).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "is not UTF-8 text", kind, "choose another file, or save it as UTF-8") from None


def _refused(path: str | os.PathLike, kind: str, error: OSError | ValueError) -> InputError:
    if Path(path).is_dir():  # Windows reports a folder as a permission error
        return InputError(path, "is a folder", kind, "choose a file in it")
    return InputError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})", f"{kind} that is readable")
