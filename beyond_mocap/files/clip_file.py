"""Read a clip from a file of any form that needs no Blender: BVH, or motion of SMPL in an .npz."""

from __future__ import annotations

from pathlib import Path

from .bvh.bvh import BvhClip, read_bvh
from .smpl.smpl import is_smpl_file, read_smpl

CLIP_ENDINGS = (".bvh", ".npz")


def read_clip(path, unit: float | None = None) -> BvhClip:
    """Read a clip.

    Args:
        path: the file.
        unit: metres per unit of a BVH file; None estimates it.
    Returns:
        The clip.
    Raises:
        InputError: if it is neither form.
    """
    return read_bvh(path, unit) if Path(path).suffix.lower() not in (".npz", ".pkl") else read_smpl(path)


def is_clip_file(path: Path) -> bool:
    """Return whether a file with one of `CLIP_ENDINGS` is a clip: an .npz may hold anything."""
    return path.suffix.lower() != ".npz" or is_smpl_file(path)
