"""Files that people name, opened for reading: what is missing, a folder or too large is told alike, as InputError."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from ..base.errors import InputError


def opened(path: str | os.PathLike, kind: str, largest: int | None = None) -> BinaryIO:
    """The file, open for its bytes. kind: what it should be ("a C3D file"). largest: bytes above which it is none."""
    try:
        handle = open(path, "rb")
        size = os.fstat(handle.fileno()).st_size
    except FileNotFoundError:
        raise InputError(path, "no such file", kind, "check the path") from None
    except (OSError, ValueError) as error:
        raise _refused(path, kind, error) from None
    if largest is not None and size > largest:
        handle.close()
        raise InputError(path, f"{size} bytes", f"{kind} of at most {largest}", "choose another file")
    return handle


def content(path: str | os.PathLike, kind: str, largest: int | None = None) -> bytes:
    """All its bytes, as `opened`."""
    with opened(path, kind, largest) as handle:
        try:
            return handle.read()
        except OSError as error:
            raise _refused(path, kind, error) from None


def utf8(path: str | os.PathLike, kind: str, largest: int | None = None) -> str:
    """All its text, a mark at its start taken off, as `opened`. InputError where it is not UTF-8."""
    try:
        return content(path, kind, largest).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "no text in UTF-8", kind, "choose another file, or save it as UTF-8") from None


def _refused(path: str | os.PathLike, kind: str, error: OSError | ValueError) -> InputError:
    if Path(path).is_dir():  # Windows refuses folders as files of others
        return InputError(path, "a folder", kind, "name a file in it")
    return InputError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})", f"{kind} that can be read")
