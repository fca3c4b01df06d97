"""A library's reference is measured once: it stays in memory as long as the library, and beside the library's cache for
other processes.
"""

from __future__ import annotations

from pathlib import Path
from typing import get_type_hints
from weakref import WeakKeyDictionary

from ...library import cache
from ...library.library import Library
from .packing import pack_values, restore_values
from .reference import LibraryReference, build_reference, find_slowest_speed, select_originals

# raised whenever what is measured of a recording changes, so that old files are not used
VERSION = 3
_KNOWN_WITHOUT = ("fps", "index", "slowest")  # fields that are found at once
_STORED = {name: kind for name, kind in get_type_hints(LibraryReference).items() if name not in _KNOWN_WITHOUT}
_IN_MEMORY: WeakKeyDictionary[Library, dict[float, LibraryReference]] = WeakKeyDictionary()


def load_reference(library: Library, fps: float) -> LibraryReference:
    """Return the library's reference at a frame rate, measured only where neither memory nor the cache has it.

    Args:
        library: the library.
        fps: frames per second.
    Returns:
        The reference.
    """
    by_fps = _IN_MEMORY.setdefault(library, {})
    if fps not in by_fps:
        by_fps[fps] = _read_reference(library, fps) or _build_stored(library, fps)
    return by_fps[fps]


def _find_place(library: Library, fps: float) -> tuple[Path, str, str] | None:
    """Find where the reference is cached: folder, key and name; None for a library that was changed after it was built.

    Synthetic clips are no recordings: with them and without them the library has the same reference.
    """
    if library.index_place is None:
        return None
    place, key, _ = library.index_place
    return place, f"{key} {float(fps)!r} {VERSION}", f"reference-{fps:g}"


def _read_reference(library: Library, fps: float) -> LibraryReference | None:
    """Read the reference from the library's cache; None where it is missing, damaged or of another form."""
    place = _find_place(library, fps)
    arrays = cache.load_arrays(*place) if place else None
    if arrays is None:
        return None
    originals = select_originals(library.clips)[0]
    try:
        known = {name: restore_values(kind, arrays, name)[0] for name, kind in _STORED.items()}
    except (KeyError, ValueError, IndexError, TypeError):
        return None
    if not len(known["courses"]) == len(known["physics"]) == len(known["rate"]) == len(originals):
        return None
    index = {clip.path: number for number, clip in enumerate(originals)}
    return LibraryReference(fps=fps, index=index, slowest=find_slowest_speed(library), **known)


def _build_stored(library: Library, fps: float) -> LibraryReference:
    """Measure the reference, and leave it beside the library's cache."""
    reference = build_reference(library, fps)
    place = _find_place(library, fps)
    if place:
        packed = (pack_values(kind, [getattr(reference, name)], name) for name, kind in _STORED.items())
        cache.save_arrays(*place, {key: array for arrays in packed for key, array in arrays.items()})
    return reference
