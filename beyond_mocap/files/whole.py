"""Files that are written whole or not at all: beside their place first, then renamed, so that nobody ever sees half a
file."""

from __future__ import annotations

import contextlib
import os
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


def atomic_write(path: str | os.PathLike, content: str | bytes) -> None:
    """Write a whole file: text as UTF-8 with line ends as given. InputError as for `beside`."""
    with beside(path) as part:
        part.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
