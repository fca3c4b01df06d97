"""The recordings below a folder."""

from __future__ import annotations

import os
from pathlib import Path

from ...base.errors import InputError, build_read_error, describe_no_folder
from ...base.fixes import Fix
from ...files.clip_file import CLIP_ENDINGS, FOREIGN, is_clip_file
from ...files.file_names import identify_file
from .annotations import LABEL_ENDINGS

CACHE_FOLDER = ".beyond_mocap"


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
    return check_files(found)


def check_files(paths: list[Path]) -> list[Path]:
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
