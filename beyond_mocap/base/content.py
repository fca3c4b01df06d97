"""Open and read files that users name; missing files, folders, files that are too large and pipes into which nothing is
written raise the same InputErrors.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import select
import stat
import threading
from collections.abc import Iterator
from typing import BinaryIO

from .errors import InputError, build_read_error

MAX_STREAM_BYTES = 1_000_000_000
"""Largest content of a pipe, which does not say its size and may have no end."""
MAX_DEVICE_BYTES = 1 << 24
"""Largest content of a device such as a terminal."""
_BLOCK = 1 << 20
PIPE_SECONDS = 5.0
"""Seconds until a pipe that no program writes to is refused; opening it like a file would wait for ever."""
SILENT_SECONDS = 30.0
"""Seconds without a byte after which a pipe that a program has opened to write, or a terminal, is refused."""
_waiting = threading.Event()


def open_file(path: str | os.PathLike, kind: str, max_bytes: int | None = None) -> BinaryIO:
    """Open a file for reading bytes; of a pipe, such as `<(...)` in a shell, or a device the whole content.

    Args:
        path: the file.
        kind: what it should be, such as "a C3D file".
        max_bytes: largest valid size; None for any.
    Returns:
        The open file.
    Raises:
        InputError: if it cannot be opened or is too large, or is a disk, or a pipe or device that gives nothing.
    """
    handle: BinaryIO
    try:
        mode = os.stat(path).st_mode
        if stat.S_ISBLK(mode):
            raise InputError(path, "is a disk", kind, "name a file")
        if stat.S_ISFIFO(mode) or stat.S_ISCHR(mode):
            limit = MAX_STREAM_BYTES if stat.S_ISFIFO(mode) else MAX_DEVICE_BYTES
            most = min(max_bytes or limit, limit)
            content = _read_stream(path, kind, most + 1)
            if len(content) > most:
                raise InputError(path, f"has no end within {most} bytes", f"{kind}, which is shorter", "name a file")
            handle, size = io.BytesIO(content), len(content)
        else:
            handle = open(path, "rb")
            size = os.fstat(handle.fileno()).st_size
    except (OSError, ValueError) as error:
        raise build_read_error(path, kind, error) from None
    if max_bytes is not None and size > max_bytes:
        handle.close()
        raise InputError(path, f"has {size} bytes", f"{kind} of at most {max_bytes}", "choose another file")
    return handle


def _read_stream(path: str | os.PathLike, kind: str, most: int) -> bytes:
    """Read a pipe, or a device such as a terminal, up to its end or `most` bytes.

    InputError if no program opens a pipe to write within PIPE_SECONDS, or writes nothing for SILENT_SECONDS. Opened
    without waiting, a pipe gives None while its writer has written nothing yet, and nothing without a writer.
    """
    if not hasattr(select, "poll"):  # Windows has no such pipes
        with open(path, "rb") as device:
            return device.read(most)
    with _wait_for_pipe(), open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb", buffering=0) as stream:
        poller = select.poll()
        poller.register(stream, select.POLLIN)
        is_begun = bool(poller.poll(1000.0 * PIPE_SECONDS))
        begin = b"" if is_begun else stream.read(1)
        if not is_begun and begin == b"":
            raise InputError(path, "is not a regular file but a pipe, into which no program writes", kind,
                             "name a file, or start the program that writes")
        content = bytearray(begin or b"")
        while len(content) < most:
            if not poller.poll(1000.0 * SILENT_SECONDS):
                raise InputError(path, f"is a pipe or a device that gave nothing for {SILENT_SECONDS:g} s", kind,
                                 "write its content into a file and choose that")
            block = stream.read(min(_BLOCK, most - len(content)))
            if block == b"":
                break
            content += block or b""
        return bytes(content)


@contextlib.contextmanager
def _wait_for_pipe() -> Iterator[None]:
    """Context manager: `is_waiting_for_pipe` is true in it."""
    _waiting.set()
    try:
        yield
    finally:
        _waiting.clear()


def is_waiting_for_pipe() -> bool:
    """Say whether a pipe is being read: its writer may never write, and nothing asks for cancellation meanwhile."""
    return _waiting.is_set()


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
    """Read all text of a UTF-8 file, or of a UTF-16 one with a byte order mark, without the mark.

    Args:
        path, kind, max_bytes: see `open_file`.
    Returns:
        The text.
    Raises:
        InputError: if it cannot be read, is too large or is not UTF-8.
    """
    try:
        return decode_text(read_bytes(path, kind, max_bytes))
    except UnicodeDecodeError:
        raise InputError(path, "is not UTF-8 text", kind, "choose another file, or save it as UTF-8") from None


def decode_text(data: bytes) -> str:
    """Decode UTF-8, or UTF-16 where a byte order mark says so, without the mark.

    Args:
        data: the bytes.
    Returns:
        The text.
    Raises:
        UnicodeDecodeError: if it is neither.
    """
    return data.decode("utf-16" if is_utf16(data) else "utf-8-sig")


def is_utf16(data: bytes) -> bool:
    """Return whether a text begins with a byte order mark of UTF-16, which some table programs write."""
    return data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
