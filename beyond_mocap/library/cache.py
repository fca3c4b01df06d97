"""The results of building a library, saved as files that depend on the content of every file read; and the synthetic
clips beside them, as BVH.

Arrays lie in a folder of npy files (never pickled) that are mapped into memory, so that a large library opens at once;
`library.json` has the rest and the name of that folder. The folder has a name of its own and is complete before the
file that names it is renamed into its place: two processes or users that build at once do no harm, the later one wins
with the same content. A damaged or outdated cache is not used but written again. Whether a file is damaged is found by
its digest; one whose size and time are as when it was written is not read for that.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..annotation import ClipAnnotation
from ..base.content import read_bytes
from ..base.digest import byte_digest
from ..base.errors import InputError
from ..base.user_folders import find_user_cache
from ..files.atomic import ABANDONED_SECONDS, atomic_write, remove_abandoned
from ..files.bvh import bvh
from ..files.bvh.bvh_text import MAX_BYTES
from ..files.motion_file import MotionWriter, divide_into_motions, map_array
from ..motion.skeleton import Skeleton
from .clip import Clip, RepairFigures
from .coverage import Coverage
from .features import Frames, list_frame_arrays
from .folder.conversions import read_stamp
from .folder.recordings import CACHE_FOLDER

# raised whenever what is computed or stored changes, so that old caches are not used
VERSION = 49
MOTIONS = "motions.npy"
"""Name of the file with the motions of all clips (`files.motion_file`)."""
CLASSIFIER_FILE = "learned_words.npz"
"""Name of the learned classifier of labels in the cache's folder."""
_DIGESTS, _COVERAGE = "digests.json", "coverage"
_SETTLED = 2_000_000_000  # ns since a file's last change from which on its time tells the next one
_TOKEN_BYTES = 6  # of the part of a folder's name that makes it unique


class SourceDigests:
    """Digests of the files of a library, which are read again only where size, times or inode differ from the last
    time.
    """

    def __init__(self, place: Path):
        """Read the digests that the last build left in the cache folder `place`; damaged ones count as none."""
        self._file = place / _DIGESTS
        try:
            self._known = dict(json.loads(self._file.read_text("utf-8")))
        except (OSError, ValueError, TypeError):
            self._known = {}
        self._used: dict[str, list] = {}

    def digest(self, name: str, path: Path) -> str:
        """Return the digest of a file's content as hex digits, "unreadable" if it cannot be read or is larger than any
        recording may be.

        Args:
            name: of the file below the library.
            path: the file.
        """
        stamp, now = _read_full_stamp(path), time.time_ns()
        row = self._known.get(name)
        if isinstance(row, list) and len(row) == 2 and row[0] == stamp and isinstance(row[1], str):
            self._used[name] = row
            return row[1]
        try:
            found = byte_digest(read_bytes(path, "a file of the library", MAX_BYTES), size=64).hex()
        except InputError:
            return "unreadable"
        if stamp and max(stamp[1:3]) < now - _SETTLED:  # a file that just changed may change again within one tick
            self._used[name] = [stamp, found]
        return found

    def save(self) -> None:
        """Save the digests where the cache folder exists and can be written."""
        if self._used != self._known and self._file.parent.is_dir():
            with suppress(InputError):
                atomic_write(self._file, json.dumps(self._used))


def _read_full_stamp(path: Path) -> list[int]:
    """Read size, times of content and of any change, and inode of a file; empty where it cannot be read."""
    try:
        status = os.stat(path)
    except OSError:
        return []
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


def compute_fingerprint(folder: Path, clips, sources, skeleton: Path | None, digests: SourceDigests, **options) -> str:
    """Compute a hash of names and contents of all files that a build reads, the options, and this module's VERSION."""
    parts: list[str | bytes] = [json.dumps([VERSION, str(np.__version__), options], sort_keys=True)]
    for path in [*clips, *sources, *([skeleton] if skeleton else [])]:
        name = os.path.relpath(path, folder)
        parts += [os.fsencode(name) + b"\0", digests.digest(name, path)]
    return byte_digest(*parts, size=64).hex()[:32]


def find_cache_folder(folder: Path, cache_dir: str | Path | None) -> tuple[Path, str]:
    """Find the folder of the cache, and a note for the user where that is not beside the recordings.

    Args:
        folder: the library's.
        cache_dir: the user's choice; None uses `folder`, or the user's cache folder where it cannot be written.
    Returns:
        The folder, and a note or "".
    Raises:
        InputError: if `cache_dir` is a file.
    """
    if cache_dir is not None:
        if Path(cache_dir).exists() and not Path(cache_dir).is_dir():
            raise InputError(cache_dir, "is not a folder", "a folder for the cache", "choose another cache folder")
        return Path(cache_dir), ""
    beside = folder / CACHE_FOLDER
    if os.access(beside if beside.is_dir() else folder, os.W_OK):
        return beside, ""
    base = find_user_cache()
    if base is None:
        return beside, ""
    elsewhere = find_own_folder(base, folder)
    return elsewhere, f"{folder} cannot be written: its cache is in {elsewhere}"


def find_own_folder(base: Path, folder: Path) -> Path:
    """Return the folder below `base` that belongs to the library of `folder` alone."""
    return base / byte_digest(str(folder.absolute()), size=64).hex()[:16]


@contextmanager
def create_arrays_folder(place: Path, name: str = "library") -> Iterator[Path]:
    """Context manager: a new folder in `place` for the arrays of a library; removed if the block fails.

    Raises:
        OSError: if it cannot be created, or something else has the place of the header, or a header that only another
            user may replace.
    """
    is_new, header = not place.exists(), place / f"{name}.json"
    if header.is_dir():
        raise IsADirectoryError(f"{header.name} is a folder")
    if _belongs_to_another(header):
        raise PermissionError(f"{header.name} belongs to another user")
    folder = place / f"{name}-{secrets.token_hex(_TOKEN_BYTES)}"
    folder.mkdir(parents=True)
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        if is_new:
            with suppress(OSError):  # not empty: another process works there
                place.rmdir()
        raise


def _belongs_to_another(file: Path) -> bool:
    """Return whether only another user may replace a file: in a folder with the sticky bit, as /tmp has it."""
    if not hasattr(os, "geteuid") or not os.path.lexists(file):
        return False
    folder = file.parent.stat()
    return bool(folder.st_mode & stat.S_ISVTX) and os.geteuid() not in (0, folder.st_uid, file.lstat().st_uid)


def save_library(place: Path, key: str, library, *, arrays: Path, name: str = "library") -> None:
    """Save `library` in `place`, and remove what was saved there long before, and what was computed from the one that
    it replaces.

    Args:
        place: the cache's folder.
        key: fingerprint of the content.
        library: the library.
        arrays: folder of `create_arrays_folder`, which may have the motions already.
        name: of the file, without its ending.
    Raises:
        OSError, InputError: if it cannot be written.
    """
    if not (arrays / MOTIONS).exists():
        writer = MotionWriter(arrays / MOTIONS)
        for clip in library.clips:
            writer.append(clip.motion)
        writer.finish()
    for part, values in _list_arrays(library).items():
        np.save(arrays / f"{part}.npy", values, allow_pickle=False)
    _publish(place, name, arrays, _build_header(key, library))
    _remove_derived(place, name)


def _remove_derived(place: Path, name: str) -> None:
    """Remove the headers of what was computed from the library of this name; it may have the same key, if it was built
    again because the cache seemed wrong.
    """
    derived = place.glob("*.json" if name == "library" else f"{name}-*.json")
    for header in [header for header in derived if header.stem not in ("library", _COVERAGE)]:
        if _read_header(place, header.stem):  # other files have no digest
            with suppress(OSError):
                header.unlink()


def _publish(place: Path, name: str, arrays: Path, header: dict) -> None:
    """Write the header that names a folder of complete arrays."""
    stamps = {file.name: [*read_stamp(file), _digest_file(file)] for file in sorted(arrays.iterdir())}
    with suppress(OSError, KeyError, TypeError):
        os.utime(place / _read_header(place, name)["folder"])  # from now on it is abandoned
    _write_header(place, name, {**header, "version": VERSION, "folder": arrays.name, "files": stamps})
    _remove_old_folders(place, name, arrays.name)


def save_arrays(place: Path, key: str, name: str, arrays: dict[str, np.ndarray]) -> None:
    """Save arrays that were computed from a cached library beside it; a folder that cannot be written is left alone.

    Args:
        place: the cache's folder.
        key: fingerprint of the library.
        name: of the arrays.
        arrays: by name.
    """
    with suppress(OSError, InputError), create_arrays_folder(place, name) as folder:
        for part, values in arrays.items():
            np.save(folder / f"{part}.npy", values, allow_pickle=False)
        _publish(place, name, folder, {"key": key})


def load_arrays(place: Path, key: str, name: str) -> dict[str, np.ndarray] | None:
    """Load what `save_arrays` saved, mapped into memory; None where it is missing, damaged or of another library."""
    header = _read_header(place, name)
    if header.get("key") != key or header.get("version") != VERSION:
        return None
    try:
        return {file.stem: map_array(file) for file in _list_sound_files(place, name, header)}
    except Exception:  # as for `load_library`
        return None


def save_coverage(place: Path, key: str, coverage: Coverage) -> None:
    """Save what the recordings lack, which takes as long to find as a take; a place that cannot be written is left
    alone.
    """
    with suppress(InputError):
        _write_header(place, _COVERAGE, {"key": key, "coverage": asdict(coverage)})


def load_coverage(place: Path, key: str) -> Coverage | None:
    """Load what `save_coverage` saved; None where it is missing, damaged or of another library."""
    header = _read_header(place, _COVERAGE)
    if header.get("key") != key:
        return None
    rows: dict[str, Any] = {}
    for name, value in header["coverage"].items():
        is_list = isinstance(value, list)
        rows[name] = tuple(tuple(row) if isinstance(row, list) else row for row in value) if is_list else value
    return Coverage(**rows)


def _list_arrays(library) -> dict[str, np.ndarray]:
    """List the arrays of a library, except its motions, by name."""
    arrays = {f"frames.{name}": values for name, values in list_frame_arrays(library.frames).items()}
    arrays["contacts"] = np.concatenate([clip.heel_toe_contacts for clip in library.clips])
    balls = [clip.ball for clip in library.clips if clip.ball is not None]
    if balls:
        arrays["balls"] = np.concatenate(balls)
    return {**arrays, "offsets": library.skeleton.offsets, "end_offsets": library.skeleton.end_offsets}


def _digest_file(file: Path) -> str:
    """Compute the digest of a file's content, without having all of it in memory."""
    with open(file, "rb") as handle:
        return hashlib.file_digest(handle, "blake2b").hexdigest()


def _write_header(place: Path, name: str, header: dict) -> None:
    """Write the header behind a digest of it; InputError if that is not possible."""
    text = json.dumps(header)
    atomic_write(place / f"{name}.json", f'"{byte_digest(text).hex()}"\n{text}')


def _read_header(place: Path, name: str) -> dict:
    """Read the header; empty where it is missing or damaged."""
    try:
        digest, text = (place / f"{name}.json").read_text("utf-8").split("\n", 1)
        header = json.loads(text) if digest == f'"{byte_digest(text).hex()}"' else None
    except (OSError, ValueError):
        return {}
    return header if isinstance(header, dict) else {}


def _remove_old_folders(place: Path, name: str, current: str) -> None:
    """Remove what was replaced, or left by killed builds, an hour ago or more, and files of version 0.1.

    Until then other processes, on other machines too, may have them mapped.
    """
    remove_abandoned(place)
    outdated = time.time() - ABANDONED_SECONDS
    for folder in place.glob(f"{name}-{'[0-9a-f]' * 2 * _TOKEN_BYTES}"):
        with suppress(OSError):  # on Windows, one that is still mapped stays until the next build
            if folder.name != current and folder.stat().st_mtime < outdated:
                shutil.rmtree(folder)
    with suppress(OSError):
        (place / f"{name}.npz").unlink()


def describe_outdated_cache(place: Path) -> list[str]:
    """Describe in a line that the cache is of another version of the program; no line where it is not."""
    version = _read_header(place, "library").get("version", VERSION)
    is_outdated = version != VERSION or (place / "library.npz").is_file()
    return ["the cache was written by another version of the program: the library is built again"] * is_outdated


def _build_header(key: str, library) -> dict:
    """Build the header: everything that is not an array."""
    skeleton = library.skeleton
    return {
        "key": key, "names": skeleton.names, "parents": skeleton.parents,
        "end_parents": skeleton.end_parents,
        "vocabulary": library.frames.vocabulary, "fps": library.fps, "notes": library.notes,
        "clips": [[clip.path, clip.mirrored, clip.motion.fps, len(clip.motion),
                   [[row.start, row.end, row.key, row.words] for row in clip.annotations], clip.recorded_count,
                   asdict(clip.repair_figures) if clip.repair_figures else None, clip.has_proposed_labels,
                   clip.t_pose_frames, 0 if clip.ball is None else len(clip.ball)]
                  for clip in library.clips],
    }  # fmt: skip


def has_library(place: Path) -> bool:
    """Return whether a folder holds a cached library, of whatever content.

    Args:
        place: the cache's folder.
    """
    return (place / "library.json").is_file()


def load_library(place: Path, key: str, name: str = "library") -> dict | None:
    """Load the fields of a cached library; its arrays are mapped into memory and read where they are used.

    Args:
        place: the cache's folder.
        key: fingerprint of the content that it must belong to.
        name: of the file, without its ending.
    Returns:
        The fields of a `Library` but its folder, or None where the cache is missing, damaged or of other content.
    """
    header = _read_header(place, name)
    if header.get("key") != key:
        return None
    try:
        arrays = {file.stem: map_array(file) for file in _list_sound_files(place, name, header)}
        return _restore_fields(header, arrays)
    except Exception:  # files of another form can raise any of numpy's, Python's and our own exceptions
        return None


def _list_sound_files(place: Path, name: str, header: dict) -> list[Path]:
    """List the npy files of a header; ValueError for a damaged one.

    One whose size or time is not as it was written (the folder was copied) is read as a whole, once.
    """
    folder, files = place / Path(header["folder"]).name, header["files"]
    changed = {}
    for file, (*stamp, digest) in files.items():
        if read_stamp(folder / file) != stamp:
            if _digest_file(folder / file) != digest:
                raise ValueError(f"{file} is damaged")
            changed[file] = [*read_stamp(folder / file), digest]
    if changed:
        with suppress(InputError):
            _write_header(place, name, {**header, "files": {**files, **changed}})
    return [folder / Path(file).name for file in files]


def _restore_fields(header: dict, arrays: dict) -> dict:
    """Restore the fields of a library but its folder."""
    names, parents, ends = (header[part] for part in ("names", "parents", "end_parents"))
    skeleton = Skeleton(names, parents, arrays["offsets"], ends, arrays["end_offsets"])
    shapes = ((skeleton, row[3], row[2]) for row in header["clips"])
    motions = divide_into_motions(arrays[Path(MOTIONS).stem], shapes)
    clips, start, ball_start = [], 0, 0
    for motion, (path, mirrored, _, count, rows, recorded, repaired, is_proposed, t_pose, known) in zip(motions,
                                                                                                     header["clips"]):
        annotations = tuple(ClipAnnotation(first, end, key, tuple(words)) for first, end, key, words in rows)
        clips.append(Clip(path=path, mirrored=mirrored, motion=motion, annotations=annotations,
                          heel_toe_contacts=arrays["contacts"][start : start + count], recorded_count=recorded,
                          repair_figures=repaired and RepairFigures(**repaired), has_proposed_labels=is_proposed,
                          t_pose_frames=tuple(t_pose),
                          ball=arrays["balls"][ball_start : ball_start + known] if known else None))
        start, ball_start = start + count, ball_start + known
    frames = Frames(
        vocabulary=tuple(header["vocabulary"]),
        **{name.removeprefix("frames."): values for name, values in arrays.items() if name.startswith("frames.")},
    )
    return {
        "skeleton": skeleton, "clips": tuple(clips), "frames": frames, "fps": header["fps"],
        "notes": tuple(header["notes"]),
    }  # fmt: skip


def write_synthetic_clips(place: Path, clips: Iterable[Clip], missing_only: bool = False) -> None:
    """Write synthetic clips, and recordings with a synthetic end, as BVH beside the cache.

    Readers of a take's provenance find them there. A folder that cannot be written is left alone.

    Args:
        place: the cache's folder.
        clips: the clips.
        missing_only: write only files that do not exist.
    """
    try:
        for clip in (clip for clip in clips if not clip.mirrored):
            file = place / Path(clip.source_at(len(clip.motion) - 1)).relative_to(CACHE_FOLDER)
            if not (missing_only and os.path.exists(file)):
                file.parent.mkdir(parents=True, exist_ok=True)
                bvh.write_bvh(file, clip.motion)
    except (OSError, InputError):
        return
