"""Recordings in forms that only Blender reads (FBX, glTF, USD), converted once to BVH and kept beside the cache.

`CACHE/converted/` mirrors the library's folders: `kicks/low.fbx` becomes `CACHE/converted/kicks/low.fbx.bvh`. A table
of each source's size and time says whether a conversion still stands for it; one that does not is never read. Blender
converts (the extension's Build Library does it first); the command line reads what has been converted.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

from ..base.errors import InputError
from ..files.whole import atomic_write

FOREIGN = (".fbx", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")
_TABLE = "converted.json"


def is_foreign(path: Path) -> bool:
    """Whether a recording has to be converted before it can be read."""
    return path.suffix.lower() in FOREIGN


class Conversions:
    """Which recordings below a library's folder have been converted, and where that is kept.

    folder: the library's; place: its cache (`cache.place`).
    """

    def __init__(self, folder: str | Path, place: str | Path):
        """Reads the table; a damaged one counts as empty."""
        self.folder, self.room = Path(folder), Path(place) / "converted"
        try:
            table = json.loads((self.room / _TABLE).read_text("utf-8"))
            self._stamps = {str(name): list(stamp) for name, stamp in table.items()}
        except (OSError, ValueError, AttributeError, TypeError):
            self._stamps = {}

    def readable(self, path: Path) -> Path:
        """The BVH file to read for a recording: itself, or its conversion."""
        if not is_foreign(path):
            return path
        return self.room / (self._name(path) + ".bvh")

    def stands(self, path: Path) -> bool:
        """Whether a recording can be read as it is now."""
        if not is_foreign(path):
            return True
        return self._stamps.get(self._name(path)) == stamp_of(path) and self.readable(path).is_file()

    def waiting(self, paths: Sequence[Path]) -> list[Path]:
        """Those of `paths` that are still to be converted."""
        return [path for path in paths if not self.stands(path)]

    def prepare(self, path: Path) -> Path:
        """Makes the folder for a conversion and returns the file to write; InputError where that cannot be done."""
        target = self.readable(path)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            found = f"cannot be written ({error.strerror})"
            raise InputError(
                target.parent, found, "a folder for converted clips", "choose another cache folder"
            ) from None
        return target

    def keep(self, path: Path, stamp: list[int]) -> None:
        """Notes that a recording has been converted as it was when its `stamp` was taken."""
        self._stamps[self._name(path)] = stamp
        atomic_write(self.room / _TABLE, json.dumps(self._stamps, indent=0, sort_keys=True))

    def _name(self, path: Path) -> str:
        return path.relative_to(self.folder).as_posix()


def told(waiting: Sequence[Path]) -> list[str]:
    """One line about recordings that nobody has converted yet; none where there are none."""
    if not waiting:
        return []
    count, kinds = len(waiting), ", ".join(sorted({path.suffix.lower() for path in waiting}))
    return [f"{count} {'clip' if count == 1 else 'clips'} left out ({kinds}: {waiting[0].name}): not converted; "
            "Build Library in Blender converts them"]


def stamp_of(path: Path) -> list[int]:
    """Size and time of change of a file; zeros where it cannot be seen."""
    try:
        status = os.stat(path)
    except OSError:
        return [0, 0]
    return [status.st_size, status.st_mtime_ns]
