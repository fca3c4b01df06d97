"""The results of building a library, saved in one `.npz` (never pickled) that depends on the content of every file
read; and the synthetic clips beside it, as BVH.

A damaged or stale cache is not used but written again. The file is written under another name and renamed, so two
processes that build at once do no harm: the later one wins with the same content.
"""

from __future__ import annotations

import io
import json
import os
from dataclasses import asdict, fields
from pathlib import Path
from typing import Iterable

import numpy as np

from ..annotation import ClipAnnotation
from ..base.content import read_bytes
from ..base.digest import byte_digest
from ..base.errors import InputError
from ..base.user_folders import find_user_cache
from ..files.atomic import atomic_write
from ..files.bvh import bvh
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from .clip import Clip
from .features import Frames
from .repair import RepairFigures
from .scan import CACHE_FOLDER

# raised whenever what is computed or stored changes, so that old caches are not used
VERSION = 40
_FRAME_ARRAYS = tuple(field.name for field in fields(Frames) if field.name != "vocabulary")


def compute_fingerprint(folder: Path, clips, sources, skeleton: Path | None, **options) -> str:
    """Compute a hash of names and contents of all files that a build reads, the options, and this module's VERSION."""
    parts: list[str | bytes] = [json.dumps([VERSION, str(np.__version__), options], sort_keys=True)]
    for path in [*clips, *sources, *([skeleton] if skeleton else [])]:
        parts.append(os.fsencode(os.path.relpath(path, folder)) + b"\0")
        try:
            parts.append(byte_digest(read_bytes(path, "a file of the library"), size=64))
        except InputError:
            parts.append(b"unreadable")
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


def save_library(place: Path, key: str, library, name: str = "library") -> bool:
    """Save `library` as `place`/`name`.npz; returns False if the folder cannot be written."""
    arrays = {f"frames.{part}": getattr(library.frames, part) for part in _FRAME_ARRAYS}
    arrays["root"] = np.concatenate([clip.motion.root_positions for clip in library.clips])
    arrays["rotations"] = np.concatenate([clip.motion.rotations for clip in library.clips])
    arrays["standing"] = np.concatenate([clip.heel_toe_contacts for clip in library.clips])
    arrays["offsets"], arrays["end_offsets"] = library.skeleton.offsets, library.skeleton.end_offsets
    arrays["header"] = np.frombuffer(json.dumps(_build_header(key, library)).encode(), np.uint8)
    try:
        place.mkdir(parents=True, exist_ok=True)
        content = io.BytesIO()  # on a full disk, an archive that is written there reports an error of its own
        np.savez(content, **arrays)
        atomic_write(place / f"{name}.npz", content.getvalue())
        return True
    except (OSError, InputError):
        return False


def _build_header(key: str, library) -> dict:
    """Build the header: everything that is not an array."""
    skeleton = library.skeleton
    return {
        "key": key, "names": skeleton.names, "parents": skeleton.parents, "end_parents": skeleton.end_parents,
        "vocabulary": library.frames.vocabulary, "fps": library.fps, "notes": library.notes,
        "clips": [[clip.path, clip.mirrored, clip.motion.fps, len(clip.motion),
                   [asdict(row) for row in clip.annotations], clip.recorded_count, asdict(clip.repair_figures)
                   if clip.repair_figures else None, clip.has_proposed_labels] for clip in library.clips],
    }  # fmt: skip


def load_library(place: Path, key: str, name: str = "library") -> dict | None:
    """Load the fields of a cached library.

    Args:
        place: the cache's folder.
        key: fingerprint of the content that it must belong to.
        name: of the file, without its ending.
    Returns:
        The fields of a `Library` but its folder, or None where the cache is missing, damaged or of other content.
    """
    try:
        with np.load(place / f"{name}.npz", allow_pickle=False) as arrays:
            header = json.loads(arrays["header"].tobytes())
            if header["key"] != key:
                return None
            return _restore_fields(header, {part: arrays[part] for part in arrays.files})
    except Exception:  # a damaged file can raise any of zipfile's, numpy's, json's and our own exceptions
        return None


def _restore_fields(header: dict, arrays: dict) -> dict:
    """Restore the fields of a library but its folder."""
    names, parents, ends = (header[part] for part in ("names", "parents", "end_parents"))
    skeleton = Skeleton(names, parents, arrays["offsets"], ends, arrays["end_offsets"])
    clips, start = [], 0
    for path, mirrored, fps, count, rows, recorded, mended, is_proposed in header["clips"]:
        part = slice(start, start + count)
        motion = Motion(skeleton, arrays["root"][part], arrays["rotations"][part], fps)
        rows = tuple(ClipAnnotation(row["start"], row["end"], row["key"], tuple(row["words"])) for row in rows)
        mended = mended and RepairFigures(**mended)
        clips.append(Clip(path=path, mirrored=mirrored, motion=motion, annotations=rows,
                          heel_toe_contacts=arrays["standing"][part], recorded_count=recorded, repair_figures=mended,
                          has_proposed_labels=is_proposed))
        start += count
    frames = Frames(
        vocabulary=tuple(header["vocabulary"]), **{name: arrays[f"frames.{name}"] for name in _FRAME_ARRAYS}
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
        for clip in clips:
            file = place / Path(clip.source_at(len(clip.motion) - 1)).relative_to(CACHE_FOLDER)
            if not clip.mirrored and not (missing_only and file.exists()):
                file.parent.mkdir(parents=True, exist_ok=True)
                bvh.write_bvh(file, clip.motion)
    except (OSError, InputError):
        return
