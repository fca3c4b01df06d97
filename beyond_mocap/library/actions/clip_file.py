"""A synthetic clip in a file beside the cache, exactly as it was built: other processes and later runs read it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np

from ...annotation import ClipAnnotation
from ...base.errors import InputError
from ...base.vectors import dot_products
from ...files.json_values import check_list, check_names, check_number, check_texts, describe_value
from ...files.piece_file import check_array, load_piece_file, write_piece_file
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from ..clip import SYNTHETIC_FPS, Clip
from ..folder.recordings import CACHE_FOLDER

_NAMES = ("key", "fps", "rows")
_UNIT_TOLERANCE = 1e-6  # by which the square of a rotation's length may differ from 1


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
        The clip; None where it is missing, damaged, not in that form or of another library.
    """

    def parse(header, arrays: dict[str, np.ndarray]) -> Clip:
        check_names(header, "header", _NAMES, _NAMES)
        if header["key"] != key or header["fps"] != SYNTHETIC_FPS:
            raise InputError("header", "another library or rate", f"{key}, {SYNTHETIC_FPS:g} frames per second")
        root = check_array(arrays, "root", np.float64, (None, 3))
        rotations = check_array(arrays, "rotations", np.float64, (len(root), len(skeleton), 4))
        contacts = check_array(arrays, "contacts", np.bool_, (len(root), 2, 2))
        if not len(root) or np.any(np.abs(dot_products(rotations, rotations) - 1.0) > _UNIT_TOLERANCE):
            raise InputError("rotations", f"{len(root)} frames", "one or more, of unit quaternions")
        for values in (root, rotations, contacts):
            values.setflags(write=False)
        rows = tuple(_parse_row(row, len(root) - 1) for row in check_list(header["rows"], "rows"))
        return Clip(path=path, mirrored=False, motion=Motion.from_stored(skeleton, root, rotations, SYNTHETIC_FPS),
                    annotations=rows, heel_toe_contacts=contacts)

    return load_piece_file(_name_file(place, path), parse)


def _parse_row(row, last: int) -> ClipAnnotation:
    """Parse the labels of a span of frames; InputError unless it lies within 0 .. last."""
    if len(check_list(row, "rows")) != 4:
        raise InputError("rows", describe_value(row), "[start, end, key, labels]")
    start, end, key = (None if value is None else check_number(value, "rows") for value in row[:3])
    if start is None or end is None or not (0.0 <= start <= end <= last and 0.0 <= (key or 0.0) <= last):
        raise InputError("rows", describe_value(row), f"frames from 0 to {last}")
    return ClipAnnotation(start, end, key, check_texts(row[3], "rows"))


def _name_file(place: Path, path: str) -> Path:
    return place / Path(path).relative_to(CACHE_FOLDER).with_suffix(".npz")
