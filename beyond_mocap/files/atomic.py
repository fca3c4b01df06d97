"""Write files and folders completely or not at all: to a temporary place first, then renamed."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from ..base.digest import byte_digest
from ..base.errors import InputError, describe_no_folder

ABANDONED_SECONDS = 3600.0
"""Age, in seconds, from which on no running process writes what is temporary."""
_TEMPORARY = re.compile(r"\..+\.\d+\.\d+\.part")  # names that `atomic_path` gives
_TEMPORARY_FOLDER = re.compile(r"\.(\d+)\.\d+\.part")  # names that `atomic_folder` gives
FULL = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of the errors that a full disk or quota gives."""
_LEAST_FREE = 65536  # bytes on a disk below which a file written by another program may be cut off


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike, ending: str = ".part") -> Iterator[Path]:
    """Context manager: a temporary path beside `path` to write to, which replaces `path` if the block succeeds.

    If the block fails, the temporary file is removed. A symbolic link stays; the file that it points to is written.

    Args:
        path: the file.
        ending: suffix of the temporary path, for writers that depend on it.
    Raises:
        InputError: if the folder is missing or not writable, or its disk full, and for devices and pipes.
    """
    path = Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)
    if os.path.exists(path) and not path.is_file() and not path.is_dir():  # renaming would replace a device
        raise InputError(path, "is a device or a pipe", "a regular file", "choose another file")
    name = f"{path.name[:16]}-{byte_digest(os.fsencode(path.name)).hex()[:8]}"  # short, since names have a limit
    temporary = path.with_name(f".{name}.{os.getpid()}.{threading.get_ident()}{ending}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise build_write_error(path, error) from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def build_write_error(path: Path, error: OSError) -> InputError:
    """Build the error for a file or folder that cannot be written.

    Args:
        path: the file or folder.
        error: what writing it raised.
    Returns:
        The error, with the next step for a full disk, for a name that is too long, or for a folder.
    """
    expected, step = "a writable folder", "choose another place"
    if error.errno in FULL:
        expected, step = "free space on its disk", "make room, or choose another folder"
    elif error.errno == errno.ENAMETOOLONG:
        expected, step = "a name that the disk allows", "choose a shorter one"
    return InputError(path, f"cannot be written ({error.strerror or error})", expected, step)


def remove_abandoned(folder: Path) -> None:
    """Remove temporary files that killed processes left in a folder, or in one below it, an hour ago or more.

    Args:
        folder: where `atomic_path` wrote.
    """
    outdated = time.time() - ABANDONED_SECONDS
    for pattern in (".*.part", "*/.*.part"):
        for path in folder.glob(pattern):
            with contextlib.suppress(OSError):
                if _TEMPORARY.fullmatch(path.name) and path.is_file() and path.stat().st_mtime < outdated:
                    path.unlink()


def check_disk(path: Path) -> None:
    """Check after another program has written a file that its disk is not full: some leave a file cut off and succeed.

    Args:
        path: the file.
    Raises:
        OSError: if there is no space left.
    """
    if shutil.disk_usage(path.parent).free < _LEAST_FREE:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def check_new_folder(path: Path, besides: Path | None = None) -> None:
    """Check that a folder is new or empty, but for what killed processes left.

    Args:
        path: the folder.
        besides: what may be in it.
    Raises:
        InputError: if it is not.
    """
    if path.exists() and not path.is_dir():
        raise InputError(path, describe_no_folder(path), "a new or empty folder", "choose another place")
    inside = path.iterdir() if path.is_dir() else ()
    if found := sorted(one.name for one in inside if one != besides and not _is_left_over(one)):
        raise InputError(path, f"the folder is not empty ({found[0]})", "a new or empty folder",
                         "choose another place")


def _is_left_over(path: Path) -> bool:
    """Tell whether a folder is a temporary one of another process, which may have been killed."""
    found = _TEMPORARY_FOLDER.fullmatch(path.name)
    return found is not None and int(found[1]) != os.getpid() and path.is_dir()


def _has_content(path: Path) -> bool:
    """Return whether there is more in a folder than what is left over."""
    try:
        return not all(map(_is_left_over, path.iterdir()))
    except OSError:
        return False


@contextlib.contextmanager
def atomic_folder(path: str | os.PathLike) -> Iterator[Path]:
    """Context manager: a hidden folder in `path` to write to; its content moves up into `path` if the block succeeds.

    If the block fails, the content is removed, and `path` too if it was new. Parent folders are created. Of two that
    write to one folder the first to end does; what killed ones left there is removed then.

    Args:
        path: a new or empty folder.
    Raises:
        InputError: if `path` is not empty or cannot be written.
    """
    path = Path(path)
    check_new_folder(path)
    temporary, is_new = path / f".{os.getpid()}.{threading.get_ident()}.part", not path.exists()
    try:
        temporary.mkdir(parents=True)
        yield temporary
        check_new_folder(path, temporary)
        for one in sorted(temporary.iterdir()):
            os.replace(one, path / one.name)
        for left in filter(_is_left_over, list(path.iterdir())):
            shutil.rmtree(left, ignore_errors=True)
    except (OSError, InputError) as error:
        if not temporary.exists() and _has_content(path):
            raise InputError(path, "another command has written to this folder meanwhile", "a folder for each command",
                             "choose another place") from None
        if isinstance(error, OSError):
            raise build_write_error(path, error) from None
        # name the file by its final path
        where, _, message = str(error).replace(str(temporary), str(path)).partition(": ")
        raise InputError(where, message) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if is_new:
            with contextlib.suppress(OSError):  # not empty: the block succeeded
                path.rmdir()


def atomic_write(path: str | os.PathLike, content: str | bytes) -> None:
    """Write a whole file.

    Text is written as UTF-8 with its line ends unchanged; lone surrogates, which JSON and file names may contain, are
    written as escapes.

    Args:
        path: the file.
        content: text or bytes.
    Raises:
        InputError: see `atomic_path`.
    """
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content)
