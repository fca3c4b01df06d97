"""Files and folders that are written whole or not at all: beside their place first, then renamed, so that nobody ever
sees half of one."""

from __future__ import annotations

import contextlib
import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

from ..base.errors import InputError


@contextlib.contextmanager
def beside(path: str | os.PathLike, ending: str = ".part") -> Iterator[Path]:
    """A path beside `path` to write to. It takes the place of `path` when the block ends well, else it is gone.

    ending: of that path's name, for writers that go by it. A link stays one: the file that it leads to is written.
    InputError where the folder is missing or cannot be written, and for devices and pipes.
    """
    path = Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)
    if path.exists() and not path.is_file() and not path.is_dir():  # renamed over, a device would be gone
        raise InputError(path, "a device or a pipe", "a file name", "choose another place")
    part = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}{ending}")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        what = f"cannot be written ({error.strerror or error})"
        raise InputError(path, what, "a folder that can be written", "choose another place") from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


@contextlib.contextmanager
def whole_folder(path: str | os.PathLike) -> Iterator[Path]:
    """A hidden folder in `path`, which has to be new or empty, to write to. All that is in it moves up into `path` when
    the block ends well, and is gone, with `path` where it was new, when it does not. Folders above are made. InputError
    where `path` has files, of another run too, or cannot be written."""
    path = Path(path)
    part, new = path / f".{os.getpid()}.{threading.get_ident()}.part", not path.exists()
    if not new and not path.is_dir():
        raise InputError(path, "a file", "an empty or a new folder", "choose another place")
    if not new and (found := next(path.iterdir(), None)):
        what = f"a folder that is not empty ({found.name})"
        raise InputError(path, what, "an empty or a new one", "choose another place")
    try:
        part.mkdir(parents=True)
        yield part
        for one in sorted(part.iterdir()):
            os.replace(one, path / one.name)
    except OSError as error:
        what = f"cannot be written ({error.strerror or error})"
        raise InputError(path, what, "a folder that can be written", "choose another place") from None
    except InputError as error:  # of a file in it, which has its name from now on
        where, _, rest = str(error).replace(str(part), str(path)).partition(": ")
        raise InputError(where, rest) from None
    finally:
        shutil.rmtree(part, ignore_errors=True)
        if new:
            with contextlib.suppress(OSError):  # not empty: all is well
                path.rmdir()


def atomic_write(path: str | os.PathLike, content: str | bytes) -> None:
    """Write a whole file: text as UTF-8 with line ends as given, and halves of characters, which JSON and names of
    files may have and UTF-8 has not, as JSON escapes them. InputError as for `beside`."""
    with beside(path) as part:
        part.write_bytes(content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content)
