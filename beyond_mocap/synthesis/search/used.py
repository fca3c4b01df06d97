"""Footage that has been shown and is not to be shown again: what makes a search find another solution.

A search that is to differ pays for frames that an earlier one has shown, and a little for other frames of the same
clips. It is a price, not a ban: where nothing else comes near what is asked, the same footage is shown again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...library.library import Library

AGAIN = 1.0
"""Price per slot of the very footage, that of a metre per second of missed speed."""
SAME_CLIP = 0.25
"""Price per slot of other frames of the same clip, or of its mirror image."""
AROUND = 0.25
"""Seconds around shown footage that count as shown."""


@dataclass(frozen=True)
class Used:
    """A piece of a clip that has been shown. clip: path below the library; first, last: frames of the clip at the
    library's rate."""

    clip: str
    mirrored: bool
    first: float
    last: float


def used_in(library: Library, edit, first: int, end: int) -> tuple[Used, ...]:
    """The footage that frames first .. end of an `EditList` show."""
    found = []
    for low, high in edit.pieces:
        low, high = max(low, first), min(high, end)
        if low < high:
            clip = int(edit.clip[low])
            frames = edit.frame[low:high] - library.frames.first[clip]
            source = library.clips[clip]
            found.append(Used(source.path, source.mirrored, float(frames.min()), float(frames.max())))
    return tuple(dict.fromkeys(found))


def price(library: Library, used: tuple[Used, ...]) -> np.ndarray:
    """(N,) float32: what every library frame costs more per slot; clips that the library does not have are left out."""
    cost = np.zeros(len(library.frames), np.float32)
    frames, around = library.frames, AROUND * library.fps
    place = {(clip.path, clip.mirrored): number for number, clip in enumerate(library.clips)}
    clips = {piece.clip for piece in used}
    for number, clip in enumerate(library.clips):
        if clip.path in clips:
            cost[frames.first[number] : frames.first[number] + frames.count[number]] = SAME_CLIP
    for piece in used:
        number = place.get((piece.clip, piece.mirrored))
        if number is None:
            continue
        start, last = frames.first[number], frames.first[number] + frames.count[number] - 1
        low = max(start, int(np.floor(start + piece.first - around)))
        high = min(last, int(np.ceil(start + piece.last + around)))
        cost[low : high + 1] = AGAIN
    return cost
