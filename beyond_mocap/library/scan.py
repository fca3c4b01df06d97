"""Which recordings lie below a folder, and which words were written about them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from ..annotation import ClipAnnotation, read_annotation_csv, read_clip_annotations
from ..base.errors import InputError
from .converted import FOREIGN, Conversions, is_foreign, told

CACHE_FOLDER = ".beyond_mocap"
TABLE_NAME = "annotations.csv"


def find_clips(folder: str | Path) -> list[Path]:
    """All BVH files below `folder`, sorted by their path below it; symbolic links are followed, loops are not.

    Raises InputError where the folder is missing, holds no BVH file, or one whose name cannot be written into a table.
    """
    found = find_recordings(folder, (".bvh",))
    if not found:
        raise InputError(folder, "no BVH file below it", "at least one .bvh", "copy or link recordings into it")
    return found


def find_recordings(folder: str | Path, endings: tuple[str, ...] = (".bvh", *FOREIGN)) -> list[Path]:
    """All files below `folder` with one of these endings, as `find_clips`, converted or not; none where there are
    none."""
    folder = Path(folder)
    if not folder.is_dir():
        what = "no folder but a file" if folder.is_file() else "no such folder"
        raise InputError(folder, what, "a folder with BVH files", "give the folder of your library")
    found: list[Path] = []
    seen: set[tuple[int, int]] = set()
    for here, folders, files in os.walk(folder, followlinks=True):
        status = os.stat(here)
        if (status.st_dev, status.st_ino) in seen:
            folders.clear()
            continue
        seen.add((status.st_dev, status.st_ino))
        folders[:] = sorted(name for name in folders if name != CACHE_FOLDER)
        found += [Path(here) / name for name in files if name.lower().endswith(endings)]
    for path in found:
        if str(path.relative_to(folder)).encode("utf-8", "replace").decode() != str(path.relative_to(folder)):
            raise InputError(ascii(str(path)), "a name that is not UTF-8", "one that tables can hold", "rename it")
    return sorted(found, key=lambda path: path.relative_to(folder).as_posix())


def own_recordings(folder: str | Path) -> list[Path]:
    """The recordings that are a library's clips, as `find_recordings`: of two of one name (`kick.bvh` beside
    `kick.fbx`) the BVH file."""
    found = find_recordings(folder)
    plain = {path.with_suffix("") for path in found if not is_foreign(path)}
    return [path for path in found if not is_foreign(path) or path.with_suffix("") not in plain]


def readable_clips(folder: str | Path, place: str | Path) -> tuple[list[Path], Conversions, list[str]]:
    """The recordings of a library that can be read now, their conversions, and a line about those that wait for theirs.

    place: the library's cache. InputError where there is none that can be read.
    """
    found, conversions = own_recordings(folder), Conversions(folder, place)
    waiting = conversions.waiting(found)
    late = set(waiting)
    ready = [path for path in found if path not in late]
    if not ready and waiting:
        what = f"no BVH file below it, but {len(waiting)} that only Blender reads ({waiting[0].name})"
        raise InputError(folder, what, "at least one .bvh", "press Build Library in Blender, which converts them")
    if not ready:
        raise InputError(folder, "no BVH file below it", "at least one .bvh", "copy or link recordings into it")
    return ready, conversions, told(waiting)


def find_tables(folder: Path, clips: list[Path]) -> list[Path]:
    """The `annotations.csv` files that may speak about `clips`: from each clip's folder up to the library's top, and
    the one in the folder above that, since a library is often one folder of a larger collection."""
    folder = Path(folder)
    homes = {clip.parent for clip in clips}
    places = {place for home in homes for place in (home, *home.parents) if place == folder or folder in place.parents}
    places |= {folder, _absolute(folder).parent}
    return sorted(place / TABLE_NAME for place in places if (place / TABLE_NAME).is_file())


def _absolute(path: Path) -> Path:
    """The whole path without `..`: where the library is given as `..`, the folder above it is not its last part."""
    return Path(os.path.normpath(path.absolute()))


class Annotations:
    """What was written about the clips of a library, found as ../shared/contract.md describes "Library annotations"."""

    def __init__(self, folder: Path, clips: list[Path], but: Callable[[Mapping], bool] | None = None):
        """Reads every table that may apply, `but` rows as `read_annotation_csv`; InputError where one is broken."""
        tables = find_tables(folder, clips)
        self.tables = {_absolute(table.parent): read_annotation_csv(table, but) for table in tables}

    def of(self, clip: Path, fps: float) -> tuple[ClipAnnotation, ...]:
        """Rows of one clip: NAME.txt beside it, else the nearest table from its folder upward that has rows for it."""
        beside = clip.with_suffix(".txt")
        if beside.is_file():
            return tuple(read_clip_annotations(beside, fps))
        clip = _absolute(clip)
        for place in clip.parents:
            if place in self.tables:
                rows = self.tables[place].get(clip.relative_to(place).as_posix())
                if rows:
                    return tuple(rows)
        return ()

    def sources(self, clips: list[Path]) -> list[Path]:
        """Every file that was or would be read for words: part of what the cache depends on."""
        texts = [clip.with_suffix(".txt") for clip in clips]
        return [path for path in texts if path.is_file()] + [place / TABLE_NAME for place in sorted(self.tables)]
