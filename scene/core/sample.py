"""The sample that is part of the extension: where its files are, and where what is computed from them is stored.

The extension's folder is only read. A path into it that is stored in a .blend file stays valid when the extension is
updated, or the file is opened on another computer: it is found again by its part below the sample's folder.
"""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from ...beyond_mocap.base.errors import InputError

EXTENSION = __package__.removesuffix(".scene.core")
NAME = "sample_blend"
FOLDER = Path(__file__).resolve().parents[2] / NAME


def find_sample_path(*parts: str) -> Path:
    """Find a file or folder of the sample.

    Args:
        parts: the path below the sample's folder.
    Returns:
        The absolute path.
    Raises:
        InputError: if this copy of the extension does not have it.
    """
    path = FOLDER.joinpath(*parts)
    if not path.exists():
        raise InputError(path, "the sample is not there", "a file of the extension", "install the extension again")
    return path


def is_in_sample(path: str | Path) -> bool:
    """Return whether an absolute path is the sample's folder or inside it."""
    return FOLDER in (Path(path), *Path(path).parents)


def find_moved_path(path: str) -> str:
    """Find a path into the sample of an earlier version or of another computer here; other paths stay as they are.

    Args:
        path: an absolute path.
    Returns:
        The absolute path.
    """
    parts = Path(path.replace("\\", "/")).parts
    if NAME not in parts or os.path.exists(path):
        return path
    start = len(parts) - parts[::-1].index(NAME)
    here = FOLDER.joinpath(*parts[start:])
    return str(here) if here.exists() else path


def find_cache_base() -> Path:
    """Find the folder for what is computed from the sample: the extension's own in the user's folders."""
    try:
        return Path(bpy.utils.extension_path_user(EXTENSION, path="sample"))
    except ValueError:  # not installed as an extension, such as when a script loads it
        import tempfile  # with what it loads, a hundredth of what enabling takes

        return Path(tempfile.gettempdir()) / "beyond_mocap_sample"


def check_not_sample(path: str | Path) -> None:
    """Raise InputError if a file to be written is in the sample."""
    if is_in_sample(path):
        raise InputError(path, "belongs to the sample, which is not changed", "a folder of your own",
                         "copy the clip to your own library")
