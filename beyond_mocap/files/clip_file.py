"""Read a clip from a file of any form that needs no Blender: BVH, or motion of SMPL in an .npz.

The readers are imported where they are used: lists of clips are needed at every start.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .bvh.bvh import BvhClip

CLIP_ENDINGS = (".bvh", ".npz")
FOREIGN = (".fbx", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")
"""Endings of recordings that Blender converts."""


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
    if Path(path).suffix.lower() in (".npz", ".pkl"):
        from .smpl.smpl import read_smpl

        return read_smpl(path)
    from .bvh.bvh import read_bvh

    return read_bvh(path, unit)


def is_clip_file(path: Path) -> bool:
    """Return whether a file with one of `CLIP_ENDINGS` is a clip: an .npz may hold anything."""
    if path.suffix.lower() != ".npz":
        return True
    from .smpl.smpl import is_smpl_file

    return is_smpl_file(path)
