"""What lives as long as Blender runs: built libraries and takes, under names that a file's settings can keep.

Settings follow undo, this store does not: an undone step finds the take of before still here. A file opened again finds
nothing, and the panel says which step to press.
"""

from __future__ import annotations

import itertools
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the library's modules are slow to import, and switching the extension on has to be quick
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.synthesis.plan import Plan
    from ...beyond_mocap.synthesis.take import Take

KEPT_TAKES = 200
KEPT_LIBRARIES = 3

_numbers = itertools.count(1)
_session = uuid.uuid4().hex[:8]  # part of every name, so that no take of another session is taken for one of this
_libraries: dict[tuple[str, float | None], "Library"] = {}
_takes: dict[str, "Made"] = {}


@dataclass(frozen=True, eq=False)
class Made:
    """What was asked, what came of it, and how good it is: the report, where one was made."""

    plan: "Plan"
    take: "Take"
    report: dict | None = None


def keep_library(library: "Library", unit: float | None) -> None:
    """Keep a built library under its folder and the unit (metres, None where guessed) that its clips were read with."""
    _keep(_libraries, (str(Path(library.folder).resolve()), unit), library, KEPT_LIBRARIES)


def library(folder: str, unit: float | None) -> "Library | None":
    """The library built from `folder` with that unit in this session, or None."""
    return _libraries.get((str(Path(folder).resolve()), unit))


def keep_take(plan: "Plan", take: "Take", report: dict | None = None) -> str:
    """Keep a take with its plan and its report; returns its name."""
    name = f"take-{_session}-{next(_numbers)}"
    _keep(_takes, name, Made(plan, take, report), KEPT_TAKES)
    return name


def made(name: str) -> Made | None:
    """The take of that name with its plan, or None where this session has not made it."""
    return _takes.get(name)


def clear() -> None:
    """Forget everything."""
    _libraries.clear()
    _takes.clear()


def _keep(store: dict, name, value, limit: int) -> None:
    store.pop(name, None)
    store[name] = value
    while len(store) > limit:
        store.pop(next(iter(store)))
