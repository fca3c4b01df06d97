"""The recordings below a folder, whether they can be read, and their annotations.

Recordings in formats that only Blender reads (FBX, glTF, USD) are converted once to BVH and stored beside the cache:
`CACHE/converted/` mirrors the library's folders, `kicks/low.fbx` becomes `CACHE/converted/kicks/low.fbx.bvh`. A table
of each source's size and time shows whether a conversion is current; one that is not is never read. Blender converts
(the extension's Build Library does it first); the command line reads what has been converted.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path

from .. import annotation
from ..annotation.vocabulary import find_meant_label, list_vocabulary
from ..base.errors import InputError, build_read_error, describe_no_folder, format_count
from ..base.fixes import Fix
from ..files.atomic import atomic_write
from ..files.clip_file import CLIP_ENDINGS, FOREIGN, is_clip_file
from ..files.file_names import identify_file

CACHE_FOLDER = ".beyond_mocap"
CLASSIFIER_FILE = "learned_words.npz"
"""Name of the learned classifier of labels in the cache's folder."""
TABLE_NAME = "annotations.csv"
LABEL_ENDINGS = (".txt", TABLE_NAME)
"""Endings of the names of files with labels."""
Tables = Mapping[Path, Mapping[str, Sequence[annotation.ClipAnnotation]]]
"""Absolute folder of a table -> file as spelled there -> its rows."""
_CONVERT = "press Build Library in Blender, or run batch.py -- library in it"
_TABLE, _FORM = "converted.json", 1  # raised when conversions hold more: Blender then converts again


def find_clips(folder: str | Path) -> list[Path]:
    """Find all BVH files below `folder`, sorted by their path below it; symbolic links are followed, loops are not.

    Args:
        folder: the library's folder.
    Returns:
        The files.
    Raises:
        InputError: if the folder is missing, holds no BVH file, or one whose name cannot be written into a table, or
            that is a device or a pipe.
    """
    found = find_recordings(folder, (".bvh",))
    if not found:
        raise InputError(folder, "no BVH file in the folder", "at least one .bvh", "copy recordings into it")
    return _check_files(found)


def _check_files(paths: list[Path]) -> list[Path]:
    """Return recordings after a check that each is a file: a pipe keeps its readers waiting (InputError)."""
    for path in paths:
        if not path.is_file():
            raise build_read_error(path, "a recording")
    return paths


def find_recordings(folder: str | Path, endings: tuple[str, ...] = (*CLIP_ENDINGS, *FOREIGN)) -> list[Path]:
    """Find all files below `folder` with one of these endings, as `find_clips`, converted or not; the list may be
    empty. A folder that has the name of a file with labels is found too, since it is none.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(folder, describe_no_folder(folder), "a folder with recordings",
                         "choose the folder of your library", fixes=(Fix("relink_library"),))
    found: dict[str, Path] = {}  # name below the folder -> file
    seen: set[tuple[int, int] | str] = set()
    for parent, folders, files in os.walk(folder, followlinks=True):
        identity = identify_file(parent)
        if identity in seen:
            folders.clear()
            continue
        seen.add(identity)
        files += [name for name in folders if name.lower().endswith(LABEL_ENDINGS)]
        folders[:] = sorted(name for name in folders if name != CACHE_FOLDER)
        place = Path(parent)
        below = "".join(f"{part}/" for part in place.relative_to(folder).parts)
        paths = (place / name for name in files if name.lower().endswith(endings))
        found |= {below + path.name: path for path in paths if is_clip_file(path)}
    for name, path in found.items():
        if name.encode("utf-8", "replace").decode() != name:
            raise InputError(ascii(str(path)), "a name that is not UTF-8", "a name in UTF-8", "rename the file")
    return [found[name] for name in sorted(found)]


def list_own_recordings(folder: str | Path) -> list[Path]:
    """List the recordings that are a library's clips, as `find_recordings`; of `kick.bvh`, `kick.npz` and `kick.fbx`
    only the first.
    """
    return _choose_forms(find_recordings(folder))


def find_recordings_and_labels(folder: str | Path) -> tuple[list[Path], list[Path]]:
    """Find a library's clips, as `list_own_recordings`, and everything that has the name of a file with labels."""
    found = find_recordings(folder, (*CLIP_ENDINGS, *FOREIGN, *LABEL_ENDINGS))
    kinds: tuple[list[Path], list[Path]] = [], []
    for path in found:
        kinds[path.name.lower().endswith(LABEL_ENDINGS)].append(path)
    return _choose_forms(kinds[0]), kinds[1]


def _choose_forms(found: list[Path]) -> list[Path]:
    """Choose of recordings with one name the first form."""
    forms = [os.path.splitext(path) for path in found]
    best: dict[str, int] = {}
    for stem, ending in forms:
        best[stem] = min(_rank_form(ending), best.get(stem, len(CLIP_ENDINGS)))
    return [path for path, (stem, ending) in zip(found, forms) if _rank_form(ending) == best[stem]]


def _rank_form(ending: str) -> int:
    """Return the rank of a recording's form: that of `CLIP_ENDINGS`, then all that Blender converts."""
    return CLIP_ENDINGS.index(ending.lower()) if ending.lower() in CLIP_ENDINGS else len(CLIP_ENDINGS)


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
    found = _check_files(list_own_recordings(folder) if found is None else found)
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


def list_table_places(folder: Path, clips: list[Path]) -> list[Path]:
    """List the `annotations.csv` files that may apply to `clips`, whether they exist or not.

    From each clip's folder up to the library's top, and in the folder above that, since a library is often one folder
    of a larger collection.
    """
    folder = Path(folder)
    clip_folders = {clip.parent for clip in clips}
    folders = {place for home in clip_folders for place in (home, *home.parents) if place == folder
               or folder in place.parents}
    folders |= {folder, _to_absolute(folder).parent}
    return sorted(place / TABLE_NAME for place in folders)


def _to_absolute(path: Path) -> Path:
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
        self.tables = {_to_absolute(table.parent): annotation.read_annotation_csv(table, skips) for table in tables}

    def read_rows(self, clip: Path, fps: float) -> tuple[annotation.ClipAnnotation, ...]:
        """Read the rows of one clip: NAME.txt beside it, else the nearest table from its folder upward that has rows
        for it.
        """
        beside = clip.with_suffix(".txt")
        if beside.is_file():
            return tuple(annotation.read_clip_annotations(beside, fps))
        clip = _to_absolute(clip)
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
    expected = [path for path in (*labels, _to_absolute(folder).parent / TABLE_NAME) if path not in used
                and (path.name == TABLE_NAME or os.path.splitext(path)[0] in stems)]
    lone, lines = _read_lone_tables(path for path in expected if path.name == TABLE_NAME and path.is_file()
                                    and _to_absolute(path.parent) not in tables)
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
            tables[_to_absolute(file.parent)] = annotation.read_annotation_csv(file)
        except InputError as error:
            lines.append(f"{error}; no clip is beside it or below, so it is not used")
    return tables, lines


def _describe_unknown_files(folder: Path, recordings: Sequence[Path], tables: Tables) -> list[str]:
    """Describe in a line the rows that name no recording of the library as their table has to: by its path below the
    table. A table above the library serves other folders too.
    """
    top = os.path.join(_to_absolute(folder), "")
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


def is_foreign(path: Path) -> bool:
    """Whether a recording has to be converted before it can be read."""
    return path.suffix.lower() in FOREIGN


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
