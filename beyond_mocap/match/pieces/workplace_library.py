"""The library as a worker has it: read once in each process, and the same one everywhere."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

from ...base.errors import InputError
from ...library.build import build
from ...library.library import Library


@dataclass(frozen=True)
class LibrarySource:
    """Where a library is, and which one it is. folder, cache, skeleton, unit: as `build` has them. key: of its content
    and of what it is read with (`Library.kept`); "" where it is not known yet."""

    folder: Path
    cache: Path | None = None
    skeleton: Path | None = None
    unit: float | None = None
    seed: int = 0
    key: str = ""


_lock = threading.Lock()
_held: dict[LibrarySource, Library] = {}


def library_of(source: LibrarySource) -> Library:
    """The library, from memory where this process has read it before; it holds one at a time.

    InputError where what is found there is not the library that the work was ordered with: recordings have been
    changed, or this machine computes with another numpy, so that results would differ.
    """
    with _lock:  # several threads of one worker ask at once
        if source not in _held:
            built = build(
                source.folder, cache_dir=source.cache, skeleton=source.skeleton, unit=source.unit, seed=source.seed
            )
            if source.key and built.kept[1] != source.key:
                raise InputError(
                    source.folder, "another library than the one this work was ordered with",
                    "the same recordings and the same numpy for all workers", "start the command again",
                )
            _held.clear()
            _held[source] = built
        return _held[source]


def hold(source: LibrarySource, library: Library) -> None:
    """Lets work in this process use a library that is read already."""
    with _lock:
        _held.clear()
        _held[source] = library
