"""Files and folders that are written whole or not at all: beside their place first, then renamed, so that nobody ever
sees half of one."""

from __future__ import annotations

import contextlib
import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError


@contextlib.contextmanager
def beside(path: str | os.PathLike, ending: str = ".part") -> Iterator[Path]:
    """A path beside `path` to write to. It takes the place of `path` when the block ends well, and is gone when it does
    not.

    ending: of that path's name, for writers that go by it. InputError where the folder is missing or cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}{ending}")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        found = f"cannot be written ({error.strerror or error})"
        raise InputError(path, found, "a folder that can be written", "choose another place") from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


@contextlib.contextmanager
def whole_folder(path: str | os.PathLike) -> Iterator[Path]:
    """A new folder beside `path` to write to, as `beside`: it becomes `path` when the block ends well, and is gone with
    all that is in it when it does not. Folders above are made. InputError where `path` is there and not empty, or cannot
    be written."""
    path = Path(os.path.abspath(path))  # "." and "..", which have no name to stand beside
    part = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}.part")
    try:
        _check_free(path)
        part.mkdir(parents=True)
        yield part
        _check_free(path)
        with contextlib.suppress(FileNotFoundError):
            path.rmdir()
        os.replace(part, path)
    except OSError as error:
        found = f"cannot be written ({error.strerror or error})"
        raise InputError(path, found, "a folder that can be written", "choose another place") from None
    except InputError as error:  # of a file in it, which has its name from now on
        where, _, rest = str(error).replace(str(part), str(path)).partition(": ")
        raise InputError(where, rest) from None
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _check_free(path: Path) -> None:
    """InputError where a place is taken."""
    if path.is_dir() and any(path.iterdir()):
        raise InputError(path, "a folder that is not empty", "an empty or a new one", "choose another place")
    if path.exists() and not path.is_dir():
        raise InputError(path, "a file", "an empty or a new folder", "choose another place")


def atomic_write(path: str | os.PathLike, content: str | bytes) -> None:
    """Write a whole file: text as UTF-8 with line ends as given. InputError as for `beside`."""
    with beside(path) as part:
        part.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
