"""Recordings in formats that only Blender reads (FBX, glTF, USD), and the BVH files that are read in their place.

They are converted once and stored beside the cache: `CACHE/converted/` mirrors the library's folders, `kicks/low.fbx`
becomes `CACHE/converted/kicks/low.fbx.bvh`. A table of each source's size and time shows whether a conversion is
current; one that is not is never read. Blender converts (the extension's Build Library does it first); the command
line reads what has been converted.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

from ...base.errors import InputError, format_count
from ...files.atomic import atomic_write
from ...files.clip_file import FOREIGN
from .recordings import check_files, list_own_recordings

_CONVERT = "press Build Library in Blender, or run batch.py -- library in it"
_TABLE, _FORM = "converted.json", 2  # raised when conversions hold more: Blender then converts again


def find_readable_clips(folder: str | Path, place: str | Path,
                        found: list[Path] | None = None) -> tuple[list[Path], Conversions, list[str]]:
    """Find the recordings of a library that can be read now.

    Args:
        folder: the library's folder.
        place: its cache folder.
        found: its recordings, where they are known.
    Returns:
        The recordings, their conversions, and a line about recordings that are not converted yet.
    Raises:
        InputError: if none can be read, or one is a device or a pipe.
    """
    found = check_files(list_own_recordings(folder) if found is None else found)
    conversions = Conversions(folder, place)
    waiting = conversions.list_waiting(found)
    waiting_set = set(waiting)
    ready = [path for path in found if path not in waiting_set]
    if not ready and waiting:
        what = f"no clip in the folder that can be read, but {len(waiting)} that only Blender reads ({waiting[0].name})"
        raise InputError(folder, what, "at least one .bvh", _CONVERT)
    if not ready:
        raise InputError(folder, "no clip in the folder",
                         "at least one recording (BVH, SMPL as .npz, FBX, glTF or USD)", "copy recordings into it")
    return ready, conversions, describe_waiting(waiting)


class Conversions:
    """The conversions of the recordings below a library's folder.

    Attributes:
        folder: the library's.
        converted_folder: where conversions are stored.
    """

    def __init__(self, folder: str | Path, place: str | Path):
        """Read the table of conversions; a damaged one counts as empty. place: the library's cache folder."""
        self.folder, self.converted_folder = Path(folder), Path(place) / "converted"
        try:
            table = json.loads((self.converted_folder / _TABLE).read_text("utf-8"))
            self._stamps = {str(name): list(stamp) for name, stamp in table.items()}
        except (OSError, ValueError, AttributeError, TypeError):
            self._stamps = {}

    def find_readable_file(self, path: Path) -> Path:
        """Return the BVH file to read for a recording: itself, or its conversion."""
        return self.converted_folder / (self._build_key(path) + ".bvh") if is_foreign(path) else path

    def is_current(self, path: Path) -> bool:
        """Whether a recording can be read in its current state."""
        if not is_foreign(path):
            return True
        stamp = self._stamps.get(self._build_key(path), [])
        return stamp[:2] == read_stamp(path) and self.find_readable_file(path).is_file()

    def list_waiting(self, paths: Sequence[Path]) -> list[Path]:
        """List the recordings among `paths` that need a conversion."""
        return [path for path in paths if not self.is_current(path)]

    def list_outdated(self, paths: Sequence[Path]) -> list[Path]:
        """List the recordings among `paths` to convert: those of `list_waiting`, and those that an earlier version of
        the program has converted, which can be read meanwhile.
        """
        return [path for path in paths if is_foreign(path) and not (
            self.is_current(path) and self._stamps[self._build_key(path)][2:] == [_FORM])]

    def prepare_file(self, path: Path) -> Path:
        """Create the folder for a conversion and return the file to write.

        Raises:
            InputError: if the folder cannot be written.
        """
        target = self.find_readable_file(path)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            found, expected = f"cannot be written ({error.strerror})", "a folder for converted clips"
            raise InputError(target.parent, found, expected, "choose another cache folder") from None
        return target

    def record_conversion(self, path: Path, stamp: list[int]) -> None:
        """Record that a recording has been converted in the state of its `stamp`."""
        self._stamps[self._build_key(path)] = [*stamp, _FORM]
        atomic_write(self.converted_folder / _TABLE, json.dumps(self._stamps, indent=0, sort_keys=True))

    def _build_key(self, path: Path) -> str:
        return path.relative_to(self.folder).as_posix()


def is_foreign(path: Path) -> bool:
    """Whether a recording has to be converted before it can be read."""
    return path.suffix.lower() in FOREIGN


def describe_waiting(waiting: Sequence[Path]) -> list[str]:
    """Describe recordings that are not converted yet, in one line; no line where there are none."""
    if not waiting:
        return []
    count, kinds = len(waiting), ", ".join(sorted({path.suffix.lower() for path in waiting}))
    return [f"{format_count(count, 'clip')} skipped ({kinds}: {waiting[0].name}): not converted; "
            f"{_CONVERT}"]


def read_stamp(path: Path) -> list[int]:
    """Read size and modification time of a file; zeros where it cannot be read."""
    try:
        status = os.stat(path)
    except OSError:
        return [0, 0]
    return [status.st_size, status.st_mtime_ns]
