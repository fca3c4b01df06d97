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
    from ..match.load import MatchSection

MAX_TAKES = 200
MAX_LIBRARIES = 3
MAX_SECTIONS = 2

_numbers = itertools.count(1)
# Part of every name, so that takes of another session are not confused with those of this one.
_session = uuid.uuid4().hex[:8]
_libraries: dict[tuple[str, float | None], "Library"] = {}
_takes: dict[str, "StoredTake"] = {}
_sections: dict[str, "tuple[MatchSection, int]"] = {}


@dataclass(frozen=True, eq=False)
class StoredTake:
    """A stored take.

    Attributes:
        plan: what was requested.
        take: the result.
        report: its evaluation, where there is one.
    """

    plan: "Plan"
    take: "Take"
    report: dict | None = None


def store_library(library: "Library", unit: float | None) -> None:
    """Store a built library under its folder and the unit (metres, None where guessed) its clips were read with."""
    _store_limited(_libraries, (str(Path(library.folder).resolve()), unit), library, MAX_LIBRARIES)


def find_library(folder: str, unit: float | None) -> "Library | None":
    """Return the library built from a folder with that unit in this session, or None."""
    return _libraries.get((str(Path(folder).resolve()), unit))


def open_library(order, progress, cancelled) -> "Library":
    """Return the library of an order; build it if it is not loaded. Does not use bpy.

    Args:
        order: with `library`, `folder`, `unit` and `build`, further arguments of `build_library`.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    """
    from ...beyond_mocap.library.build import build_library

    if order.library is not None:
        return order.library
    return build_library(order.folder, unit=order.unit, **order.build, progress=progress, cancelled=cancelled)


def store_take(plan: "Plan", take: "Take", report: dict | None = None) -> str:
    """Store a take with its plan and its report; return its name."""
    name = f"take-{_session}-{next(_numbers)}"
    _store_limited(_takes, name, StoredTake(plan, take, report), MAX_TAKES)
    return name


def find_take(name: str) -> StoredTake | None:
    """Return the take of that name with its plan; None if it is not of this session."""
    return _takes.get(name)


def store_section(section: "MatchSection", first: int) -> str:
    """Store a section of a match that is shown from scene frame `first` on; return its name."""
    name = f"section-{_session}-{next(_numbers)}"
    _store_limited(_sections, name, (section, first), MAX_SECTIONS)
    return name


def find_section(name: str) -> "tuple[MatchSection, int] | None":
    """Return the section of that name with its first frame; None if it is not of this session."""
    return _sections.get(name)


def clear_session() -> None:
    """Clear the store."""
    _libraries.clear()
    _takes.clear()
    _sections.clear()


def _store_limited(store: dict, name, value, limit: int) -> None:
    store.pop(name, None)
    store[name] = value
    while len(store) > limit:
        store.pop(next(iter(store)))
