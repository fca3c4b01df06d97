"""Which clip each frame of a take shows."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..annotation import spoken
from ..library.library import Library
from .search.footage import Shown


def provenance_fields(library: Library, shown: Shown) -> dict[str, Any]:
    """The fields of a `Take` that say what its frames show: clips, clip, clip_frame, mirrored, words and seams."""
    sources = sources_shown(library, shown)
    names = tuple(dict.fromkeys(sources))
    number = {name: i for i, name in enumerate(names)}
    return {
        "clips": names,
        "clip": np.array([number[source] for source in sources]),
        "clip_frame": shown.clip_frame,
        "mirrored": np.array([library.clips[clip].mirrored for clip in shown.clip]),
        "words": words_shown(library, shown),
        "seams": shown.seams,
    }


def sources_shown(library: Library, shown: Shown) -> tuple[str, ...]:
    """The files, below the library, that hold every shown frame: recordings, or what was made behind their end."""
    frames = zip(shown.clip, np.round(shown.clip_frame, 6))
    return tuple(library.clips[clip].source_at(frame) for clip, frame in frames)


def words_shown(library: Library, shown: Shown) -> tuple[tuple[str, ...], ...]:
    """The words that every shown frame's clip carries there."""
    frames = zip(shown.clip, np.round(shown.clip_frame, 6))
    return tuple(spoken(library.clips[clip].words_at(frame)) for clip, frame in frames)
