"""Synthetic clips as BVH files beside the cache, for readers of a take's provenance."""

from __future__ import annotations

from pathlib import Path
from typing import Iterable

from ..files.bvh import bvh
from .clip import Clip
from .scan import CACHE_FOLDER


def write_synthetic_clips(place: Path, made: Iterable[Clip], missing_only: bool = False) -> None:
    """Writes clips that are made, or end so, as BVH beside the cache, so that whoever follows a take's provenance finds
    them; a place that cannot be written is left alone. missing_only: those that are not there, as when someone has
    tidied up."""
    try:
        for clip in made:
            file = place / Path(clip.source_at(len(clip.motion) - 1)).relative_to(CACHE_FOLDER)
            if not clip.mirrored and not (missing_only and file.exists()):
                file.parent.mkdir(parents=True, exist_ok=True)
                bvh.write(file, clip.motion)
    except OSError:
        return
