"""Which clip frame each output frame shows: what every search ends in, and all that has to be kept of a take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...library.keys import Key


@dataclass(frozen=True)
class PlacedKey:
    """Key moment number `wanted` of the order is served by `key` of the library."""

    wanted: int
    key: Key


@dataclass(frozen=True, eq=False)
class EditList:
    """At the library's rate: clip (T,) index, frame (T,) fractional place among the library's frames (it may lie a few
    frames outside its clip at a seam, where the clip's end is held), seams: frames that begin another piece."""

    clip: np.ndarray
    frame: np.ndarray
    seams: np.ndarray
    keys: tuple[PlacedKey, ...]

    def __len__(self) -> int:
        return len(self.clip)

    @property
    def pieces(self) -> list[tuple[int, int]]:
        """(first, end) frames of the uncut pieces."""
        edges = [0, *self.seams.tolist(), len(self.clip)]
        return list(zip(edges, edges[1:]))


def find_seams(clip: np.ndarray, frame: np.ndarray, step: float = 1.5) -> np.ndarray:
    """Frames at which the clip changes or the frame jumps by more than `step` library frames or backwards."""
    jump = np.diff(frame)
    return np.flatnonzero((np.diff(clip) != 0) | (jump > step) | (jump < 0.0)) + 1


def replaced(
    edit: EditList, first: int, end: int, clip: np.ndarray, frame: np.ndarray, keys: tuple[PlacedKey, ...]
) -> EditList:
    """The edit list with frames first .. end of clip (T,) and frame (T,) in their place, and `keys` beside its own.

    Seams outside stay as they are; those inside and at both ends of the stretch are found anew."""
    inside = slice(first, end)
    new_clip, new_frame = edit.clip.copy(), edit.frame.copy()
    new_clip[inside], new_frame[inside] = clip[inside], frame[inside]
    low, high = max(first - 1, 0), min(end + 1, len(edit))
    found = find_seams(new_clip[low:high], new_frame[low:high]) + low
    seams = np.concatenate([edit.seams[edit.seams < first], found, edit.seams[edit.seams > end]])
    return EditList(new_clip, new_frame, seams, tuple(sorted((*edit.keys, *keys), key=lambda key: key.wanted)))


def at_times(edit: EditList, index: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Clip (N,), frame (N,) and piece (N,) at fractional output frames `index` (N,), never mixing two pieces."""
    starts = np.array([low for low, _ in edit.pieces])
    piece = np.clip(np.searchsorted(starts, index + 1e-9, side="right") - 1, 0, len(starts) - 1)
    clip, frame = np.empty(len(index), int), np.empty(len(index))
    for number, (low, high) in enumerate(edit.pieces):
        inside = piece == number
        if np.any(inside):
            clip[inside] = edit.clip[low]
            frame[inside] = _extended(edit.frame[low:high], index[inside] - low)
    return clip, frame, piece


def _extended(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Linear interpolation that goes on with the last slope beyond the end."""
    if len(values) == 1:
        return values[0] + at
    low = np.clip(np.floor(at).astype(int), 0, len(values) - 2)
    return values[low] + (values[low + 1] - values[low]) * (at - low)
