"""A synthetic clip in a file beside the cache, exactly as it was built: other processes and later runs read it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from ...annotation import ClipAnnotation
from ...base.errors import InputError
from ...files.piece_file import read_piece_file, write_piece_file
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from ..clip import Clip
from ..scan import CACHE_FOLDER


def save_clip(place: Path, key: str, clip: Clip) -> None:
    """Save a synthetic clip; a folder that cannot be written is left alone.

    Args:
        place: the cache's folder.
        key: fingerprint of the library.
        clip: the clip, not its mirrored twin.
    """
    header = {"key": key, "fps": clip.motion.fps,
              "rows": [[float(row.start), float(row.end), None if row.key is None else float(row.key), row.words]
                       for row in clip.annotations]}  # fmt: skip
    arrays = {"root": clip.motion.root_positions, "rotations": clip.motion.rotations,
              "contacts": clip.heel_toe_contacts}
    with suppress(InputError):
        write_piece_file(_name_file(place, clip.path), header, arrays)


def load_clip(place: Path, key: str, skeleton: Skeleton, path: str) -> Clip | None:
    """Load what `save_clip` saved.

    Args:
        place: the cache's folder.
        key: fingerprint of the library.
        skeleton: of the library.
        path: of the clip.
    Returns:
        The clip; None where it is missing, damaged or of another library.
    """
    found = read_piece_file(_name_file(place, path))
    if found is None or found[0]["key"] != key:
        return None
    header, arrays = found
    for values in arrays.values():
        values.setflags(write=False)
    rows = tuple(ClipAnnotation(start, end, at, tuple(words)) for start, end, at, words in header["rows"])
    motion = Motion.from_stored(skeleton, arrays["root"], arrays["rotations"], header["fps"])
    return Clip(path=path, mirrored=False, motion=motion, annotations=rows, heel_toe_contacts=arrays["contacts"])


def _name_file(place: Path, path: str) -> Path:
    return place / Path(path).relative_to(CACHE_FOLDER).with_suffix(".npz")
