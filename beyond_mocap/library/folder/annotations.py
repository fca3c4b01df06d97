"""The annotations of the recordings below a folder: `NAME.txt` beside a clip, and the tables that apply to it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ... import annotation

TABLE_NAME = "annotations.csv"
LABEL_ENDINGS = (".txt", TABLE_NAME)
"""Endings of the names of files with labels."""
Tables = Mapping[Path, Mapping[str, Sequence[annotation.ClipAnnotation]]]
"""Absolute folder of a table -> file as spelled there -> its rows."""


def list_table_places(folder: Path, clips: list[Path]) -> list[Path]:
    """List the `annotations.csv` files that may apply to `clips`, whether they exist or not.

    From each clip's folder up to the library's top, and in the folder above that, since a library is often one folder
    of a larger collection.
    """
    folder = Path(folder)
    clip_folders = {clip.parent for clip in clips}
    folders = {place for home in clip_folders for place in (home, *home.parents) if place == folder
               or folder in place.parents}
    folders |= {folder, to_absolute(folder).parent}
    return sorted(place / TABLE_NAME for place in folders)


def to_absolute(path: Path) -> Path:
    """Return the absolute path without `..`: with the library given as `..`, the folder above it is not its last part.
    """
    return Path(os.path.normpath(path.absolute()))


class Annotations:
    """The annotations of a library's clips (docs/reference/library-folder.md, *Where labels are found*)."""

    def __init__(self, folder: Path, clips: list[Path], skips: Callable[[Mapping], bool] | None = None):
        """Read every table that may apply, without the rows that `skips` selects (`read_annotation_csv`); InputError
        for a broken one.
        """
        tables = [table for table in list_table_places(folder, clips) if table.is_file()]
        self.tables = {to_absolute(table.parent): annotation.read_annotation_csv(table, skips) for table in tables}

    def read_rows(self, clip: Path, fps: float) -> tuple[annotation.ClipAnnotation, ...]:
        """Read the rows of one clip: NAME.txt beside it, else the nearest table from its folder upward that has rows
        for it.
        """
        beside = clip.with_suffix(".txt")
        if beside.is_file():
            return tuple(annotation.read_clip_annotations(beside, fps))
        clip = to_absolute(clip)
        for place in clip.parents:
            if place in self.tables:
                rows = self.tables[place].get(clip.relative_to(place).as_posix())
                if rows:
                    return tuple(rows)
        return ()

    def list_sources(self, clips: list[Path]) -> list[Path]:
        """List every file that was or would be read for annotations; the cache depends on them."""
        texts = [os.path.splitext(clip)[0] + ".txt" for clip in clips]
        return [*(Path(text) for text in texts if os.path.isfile(text)),
                *(place / TABLE_NAME for place in sorted(self.tables))]
