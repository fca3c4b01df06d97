"""Edit list: which clip frame each output frame shows. Every search returns one; a take stores nothing else of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...library.keys import Key


@dataclass(frozen=True)
class PlacedKey:
    """A key moment of the request with the library key that serves it.

    Attributes:
        number: number of the key moment in the request.
        key: the library's key moment.
    """

    number: int
    key: Key


@dataclass(frozen=True, eq=False)
class EditList:
    """Which clip frame each output frame shows, at the library's rate.

    Attributes:
        clip: (T,) clip index.
        frame: (T,) fractional library frame; it may lie a few frames outside its clip at a transition, where the clip's
            end is held.
        transitions: (S,) frames that begin another piece.
        keys: the key moments that are shown.
    """

    clip: np.ndarray
    frame: np.ndarray
    transitions: np.ndarray
    keys: tuple[PlacedKey, ...]

    def __len__(self) -> int:
        return len(self.clip)

    @property
    def pieces(self) -> list[tuple[int, int]]:
        """(first, end) frames of the uncut pieces."""
        edges = [0, *self.transitions.tolist(), len(self.clip)]
        return list(zip(edges, edges[1:]))


@dataclass(frozen=True, eq=False)
class SearchStretch:
    """A stretch to be searched again.

    What the edit list shows before and behind stays: the search starts from the one and pays for the transition to the
    other.

    Attributes:
        edit: the edit list, at the library's rate.
        first: first frame of the stretch.
        end: frame after its last one.
    """

    edit: EditList
    first: int
    end: int


def find_transitions(clip: np.ndarray, frame: np.ndarray, step: float = 1.5) -> np.ndarray:
    """Find the frames at which the clip changes, or the frame jumps by more than `step` library frames or backwards.

    Args:
        clip: (T,) clip index.
        frame: (T,) library frame.
        step: largest step within a piece.
    """
    jump = np.diff(frame)
    return np.flatnonzero((np.diff(clip) != 0) | (jump > step) | (jump < 0.0)) + 1


def replace_stretch(
    edit: EditList, first: int, end: int, clip: np.ndarray, frame: np.ndarray, keys: tuple[PlacedKey, ...]
) -> EditList:
    """Replace a stretch of an edit list.

    Transitions outside stay as they are; those inside and at both ends of the stretch are found again.

    Args:
        edit: T frames.
        first: first frame of the stretch.
        end: frame after its last one.
        clip: (T,) clip index, used inside the stretch.
        frame: (T,) library frame, used inside the stretch.
        keys: added to those of the edit list.
    """
    inside = slice(first, end)
    new_clip, new_frame = edit.clip.copy(), edit.frame.copy()
    new_clip[inside], new_frame[inside] = clip[inside], frame[inside]
    # one frame more on either side, so that a jump at an end of the stretch is found
    low, high = max(first - 1, 0), min(end + 1, len(edit))
    found = find_transitions(new_clip[low:high], new_frame[low:high]) + low
    transitions = np.concatenate([edit.transitions[edit.transitions < first], found,
                                  edit.transitions[edit.transitions > end]])
    return EditList(new_clip, new_frame, transitions, tuple(sorted((*edit.keys, *keys), key=lambda key: key.number)))


def compute_steps(edit: EditList, at: np.ndarray) -> np.ndarray:
    """Compute the steps of an edit list as played within its pieces.

    Args:
        edit: the edit list.
        at: (K,) output frames.
    Returns:
        (K,) library frames.
    """
    starts = np.array([low for low, _ in edit.pieces])
    piece = np.searchsorted(starts, at, side="right") - 1
    low, high = starts[piece], np.append(starts[1:], len(edit))[piece]
    one = np.clip(at, low, np.maximum(high - 2, low))
    return np.where(high - low > 1, edit.frame[np.minimum(one + 1, len(edit) - 1)] - edit.frame[one], 1.0)


def sample_edit(edit: EditList, index: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interpolate an edit list at fractional frames, never mixing two pieces.

    Args:
        edit: the edit list.
        index: (N,) fractional output frames at the library's rate.
    Returns:
        clip (N,), frame (N,) and piece (N,).
    """
    starts = np.array([low for low, _ in edit.pieces])
    piece = np.clip(np.searchsorted(starts, index + 1e-9, side="right") - 1, 0, len(starts) - 1)
    clip, frame = np.empty(len(index), int), np.empty(len(index))
    for number, (low, high) in enumerate(edit.pieces):
        inside = piece == number
        if np.any(inside):
            clip[inside] = edit.clip[low]
            frame[inside] = _interpolate_extended(edit.frame[low:high], index[inside] - low)
    return clip, frame, piece


def _interpolate_extended(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Interpolate linearly; beyond the end continue with the last slope."""
    if len(values) == 1:
        return values[0] + at
    low = np.clip(np.floor(at).astype(int), 0, len(values) - 2)
    return values[low] + (values[low + 1] - values[low]) * (at - low)
