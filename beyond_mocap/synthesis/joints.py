"""Where one block ends and the next begins: the boundary moved by a few frames to where the two clips agree best.

Faustino §3.2.5 shifts the exit and the entry frame separately by gradient descent; the motion then changes its length,
key moments miss their frame and travelled distance drifts (his own §5.2.1 names this as the main source of his distance
errors). We shift both by the same number of frames: one clip plays a little longer and the other begins as much later,
so every other frame stays where it was, and with so few possibilities all of them are tried.
"""

from __future__ import annotations

import numpy as np

from ..library.library import Library
from .edit_list import EditList, PlacedKey, find_seams

REACH = 3


def edit_list(library: Library, clip: np.ndarray, frame: np.ndarray, keys: tuple[PlacedKey, ...], fixed) -> EditList:
    """An edit list from per-frame clips (T,) and library frames (T,), its seams moved to the best of +-3 frames.

    fixed: output frames (key moments) across which no seam may move.
    """
    clip, frame = clip.copy(), frame.astype(float).copy()
    seams = find_seams(clip, frame)
    fixed = sorted(fixed)
    for number, seam in enumerate(seams):
        low = max([0, *seams[number - 1 : number].tolist(), *[f + 1 for f in fixed if f < seam]])
        high = min([len(clip), *seams[number + 1 : number + 2].tolist(), *[f for f in fixed if f >= seam]])
        _move(library, clip, frame, int(seam), low, high)
    return EditList(clip, frame, find_seams(clip, frame), keys)


def _move(library: Library, clip, frame, seam: int, low: int, high: int) -> None:
    """Moves one seam within low < seam < high, in place."""
    shifts = [s for s in range(-REACH, REACH + 1) if low < seam + s < high]
    before, after = (clip[seam - 1], frame[seam - 1]), (clip[seam], frame[seam])
    costs = [_gap(library, before, after, s) for s in shifts]
    if not costs or np.min(costs) == np.inf:
        return
    shift = shifts[int(np.lexsort((np.abs(shifts), np.round(costs, 9)))[0])]
    for s in range(0, shift):
        clip[seam + s], frame[seam + s] = before[0], before[1] + 1 + s
    for s in range(shift, 0):
        clip[seam + s], frame[seam + s] = after[0], after[1] + s


def _gap(library: Library, before, after, shift: int) -> float:
    """Distance between the frame that would follow before the seam and the one after it: C of §3.2.5; inf outside a
    clip."""
    frames = library.frames
    places = []
    for (clip, frame), step in ((before, shift + 1), (after, shift)):
        at = int(round(frame)) + step
        if not frames.first[clip] <= at < frames.first[clip] + frames.count[clip]:
            return np.inf
        places.append(at)
    return float(np.linalg.norm(frames.features[places[0]] - frames.features[places[1]]))
