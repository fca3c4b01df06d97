"""What is stored in memory while Blender runs: built libraries and takes, under names that a file's settings keep.

Settings follow undo, this store does not: after an undo the earlier take is still here. After a file is opened again
the store has nothing for it, and the panel says which step to run.
"""

from __future__ import annotations

import itertools
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the library's modules are slow to import, and enabling the extension must be quick
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.synthesis.plan import Plan
    from ...beyond_mocap.synthesis.take import Take

KEPT_TAKES = 200
KEPT_LIBRARIES = 3

_numbers = itertools.count(1)
# Part of every name, so that takes of another session are not confused with those of this one.
_session = uuid.uuid4().hex[:8]
_libraries: dict[tuple[str, float | None], "Library"] = {}
_takes: dict[str, "Made"] = {}


@dataclass(frozen=True, eq=False)
class Made:
    """A stored take.

    Attributes:
        plan: what was requested.
        take: the result.
        report: its evaluation, where there is one.
    """

    plan: "Plan"
    take: "Take"
    report: dict | None = None


def keep_library(library: "Library", unit: float | None) -> None:
    """Store a built library under its folder and the unit (metres, None where guessed) its clips were read with."""
    _keep(_libraries, (str(Path(library.folder).resolve()), unit), library, KEPT_LIBRARIES)


def library(folder: str, unit: float | None) -> "Library | None":
    """Return the library built from a folder with that unit in this session, or None."""
    return _libraries.get((str(Path(folder).resolve()), unit))


def keep_take(plan: "Plan", take: "Take", report: dict | None = None) -> str:
    """Store a take with its plan and its report; return its name."""
    name = f"take-{_session}-{next(_numbers)}"
    _keep(_takes, name, Made(plan, take, report), KEPT_TAKES)
    return name


def made(name: str) -> Made | None:
    """Return the take of that name with its plan; None if it is not of this session."""
    return _takes.get(name)


def clear() -> None:
    """Clear the store."""
    _libraries.clear()
    _takes.clear()


def _keep(store: dict, name, value, limit: int) -> None:
    store.pop(name, None)
    store[name] = value
    while len(store) > limit:
        store.pop(next(iter(store)))
