"""Names that files may have on every system, and which names are of one file."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path

_MAX_NAME = 100  # characters of a file name
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)


def avoid_reserved_name(name: str) -> str:
    """Put an underscore before a name that Windows keeps for devices, such as CON; other names stay.

    Args:
        name: of a file, with or without its ending.
    Returns:
        A name that every system can have.
    """
    return f"_{name}" if _RESERVED.match(name) else name


def identify_file(path: str | Path) -> tuple[int, int] | str:
    """Identify an existing file or folder, the same for all links to it.

    Args:
        path: of the file.
    Returns:
        Its device and its number there; its resolved path on file systems that number no files, such as some network
        shares on Windows.
    Raises:
        OSError: if there is none.
    """
    status = os.stat(path)
    return (status.st_dev, status.st_ino) if status.st_ino else os.path.normcase(os.path.realpath(path))


def build_file_names(ids: Iterable[str]) -> dict[str, str]:
    """Build the file name of each player from their id; see `choose_file_name`.

    Args:
        ids: of the players.
    Returns:
        Name by id.
    """
    used: set[str] = set()
    return {player: choose_file_name(player, used) for player in ids}


def choose_file_name(player: str, used: set[str]) -> str:
    """Choose a file name for a player's id, and add it to those that are used, in lower case.

    Characters other than letters, digits, dot, minus and underscore are replaced; no two names are equal, ignoring
    case.

    Args:
        player: the id.
        used: names that are taken.
    Returns:
        The name.
    """
    base = re.sub(r"[^\w.-]", "_", player, flags=re.ASCII).strip(".")[:_MAX_NAME] or "player"
    base = avoid_reserved_name(base)
    name, number = base, 2
    while name.lower() in used:
        name, number = f"{base}-{number}", number + 1
    used.add(name.lower())
    return name
