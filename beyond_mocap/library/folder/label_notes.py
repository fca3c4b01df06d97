"""Notes about labels in a library's folder that are not used, or are probably misspelled."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from ... import annotation
from ...annotation.vocabulary import find_meant_label, list_vocabulary
from ...base.errors import InputError, format_count
from .annotations import TABLE_NAME, Tables, to_absolute


def describe_unused_labels(folder: Path, recordings: Sequence[Path], labels: Sequence[Path], tables: Tables,
                           used: Collection[Path]) -> list[str]:
    """Describe the tables' rows that are not used, and what is no file where labels are expected, a line for each kind.

    Args:
        folder: the library's.
        recordings: its clips.
        labels: everything in it that has the name of a file with labels.
        tables: those that may apply to clips.
        used: files that labels are read from.
    Returns:
        The lines.
    """
    stems = {os.path.splitext(path)[0] for path in recordings}
    expected = [path for path in (*labels, to_absolute(folder).parent / TABLE_NAME) if path not in used
                and (path.name == TABLE_NAME or os.path.splitext(path)[0] in stems)]
    lone, lines = _read_lone_tables(path for path in expected if path.name == TABLE_NAME and path.is_file()
                                    and to_absolute(path.parent) not in tables)
    return [*_describe_no_files(folder, [path for path in expected if os.path.lexists(path) and not path.is_file()]),
            *_describe_unknown_files(folder, recordings, {**tables, **lone}), *lines]


def _describe_no_files(folder: Path, found: Sequence[Path]) -> list[str]:
    """Describe in a line what has the name of a file with labels and is a folder, a device, a pipe or a broken link."""
    if not found:
        return []
    other = "is a device or a pipe" if found[0].exists() else "is a link to no file"
    what = "is a folder" if found[0].is_dir() else other
    similar = f" (similar in {len(found)} places)" if len(found) > 1 else ""
    return [f"{_name_file(found[0], folder)}: {what}, so no labels are read from it{similar}; replace it by a file"]


def _name_file(path: Path, folder: Path) -> str:
    """Name a file by its path below the library, or above it."""
    return Path(os.path.relpath(path, folder)).as_posix()


def _read_lone_tables(files: Iterable[Path]) -> tuple[Tables, list[str]]:
    """Read tables that no clip lies beside or below, and describe those that cannot be read."""
    tables: dict[Path, Mapping[str, Sequence[annotation.ClipAnnotation]]] = {}
    lines = []
    for file in files:
        try:
            tables[to_absolute(file.parent)] = annotation.read_annotation_csv(file)
        except InputError as error:
            lines.append(f"{error}; no clip is beside it or below, so it is not used")
    return tables, lines


def _describe_unknown_files(folder: Path, recordings: Sequence[Path], tables: Tables) -> list[str]:
    """Describe in a line the rows that name no recording of the library as their table has to: by its path below the
    table. A table above the library serves other folders too.
    """
    top = os.path.join(to_absolute(folder), "")
    known = {os.path.abspath(path).replace(os.sep, "/") for path in recordings} if tables else set()
    unknown = [(place, name) for place in sorted(tables) for name in tables[place]
               if f"{place.as_posix()}/{name}" not in known and _concerns_library(str(place), name, top)]
    if not unknown:
        return []
    count = sum(len(tables[place][name]) for place, name in unknown)
    rows = "1 row names a file that is" if count == 1 else f"{count} rows name files that are"
    place, name = unknown[0]
    table = _name_file(place / TABLE_NAME, folder)
    where = f" in {table}" if "/" in table and not table.startswith("..") else ""
    return [f"{TABLE_NAME}: {rows} not in the library, such as {name}{where}"]


def _concerns_library(place: str, name: str, top: str) -> bool:
    """Return whether a row of the table in `place` has to name a recording below `top`."""
    return os.path.join(place, "").startswith(top) or os.path.normpath(os.path.join(place, name)).startswith(top)


def describe_lone_texts(folder: Path, recordings: Sequence[Path], labels: Sequence[Path]) -> list[str]:
    """Describe in a line the texts with labels that lie beside no recording of their name.

    Args:
        folder, recordings, labels: see `describe_unused_labels`.
    Returns:
        The line, if there are such texts.
    """
    known = {path.with_suffix("") for path in recordings}
    lone = [_name_file(path, folder) for path in labels if path.suffix.lower() == ".txt"
            and path.with_suffix("") not in known and _has_labels(path)]
    found = format_count(len(lone), "text with labels", "texts with labels")
    return [f"{found} beside no recording of the name, such as {lone[0]}"] if lone else []


def _has_labels(path: Path) -> bool:
    """Say whether a text has labels of a clip, as a README or a licence has not."""
    try:
        return bool(annotation.read_clip_annotations(path, 30.0))
    except InputError:
        return False


def describe_misspelled_labels(rows: Mapping[str, Sequence[annotation.ClipAnnotation]]) -> list[str]:
    """Describe, a line each, the labels that only a library's own annotations know and that are probably misspelled.

    Args:
        rows: path of a recording below the library's folder -> its rows.
    """
    known = list_vocabulary()
    places: dict[str, list[str]] = {}
    for clip, own in rows.items():
        for label in sorted({word for row in own for word in row.words} - known):
            places.setdefault(label, []).append(clip)
    meant = {label: find_meant_label(label, known) for label in sorted(places)}
    return [f"{places[label][0]}{_describe_more(places[label])}: the label '{label}' is not in the vocabulary; "
            f"if '{other}' is meant, correct it" for label, other in meant.items() if other]


def _describe_more(clips: Sequence[str]) -> str:
    """Say how many recordings follow the first one."""
    return f" and {format_count(len(clips) - 1, 'more clip')}" if len(clips) > 1 else ""
