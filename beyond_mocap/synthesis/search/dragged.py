"""Entries and exits of key moments' clips that stand still while the track moves: what may be left out, and its report.

A player who arrives at a run does not stand still before a header. On that track, a clip that stands still there would
be dragged with both feet on the ground, and no step is added around a touch. Sliding feet yield later than transitions
(../shared/metrics.md), so the search also has such a clip without that part as a candidate.
"""

from __future__ import annotations

import numpy as np

from ...base.errors import TimedLine
from ...library.keys import Key
from ...library.library import Library
from .edit_list import EditList
from .offer import USUAL_STANCE
from .wanted import Wanted, needed, pool_frame

DRAGGED = 1.0
"""m/s between a clip with both feet on the ground and the track, above which the feet are dragged."""

_TOLD = 4.0  # frames left out from which on it is reported


def drags(library: Library, wanted: Wanted, at: float, key: Key, rate: float, low: int, high: int) -> bool:
    """Return whether a key's clip drags its feet for most of the frames low .. high.

    Both feet are in contact for longer than in a walk, and the track is faster or slower than the clip by DRAG_SPEED.

    Args:
        library: the clips.
        request: the request.
        at: output frame of the key frame.
        key: the clip's key moment.
        rate: playback rate.
        low, high: output frames.
    """
    frames, out = library.frames, np.arange(max(low, 0), min(high, len(wanted)))
    first = frames.first[key.clip]
    shown = np.round(pool_frame(library, key) + rate * (out - at)).astype(int)
    shown = np.clip(shown, first, first + frames.count[key.clip] - 1)
    apart = np.abs(wanted.track.speed[out] - rate * frames.speed[shown])
    feet = (library.stance_seconds[shown] > USUAL_STANCE) & (apart > DRAGGED)
    return 2 * np.count_nonzero(feet) > len(out)


def undragged(
    library: Library, wanted: Wanted, edges: np.ndarray, at: float, key: Key, rate: float, slots: tuple[int, int],
    around: float,
) -> list[tuple[int, int]]:  # fmt: skip
    """List the slot ranges that a key's clip may fill: the given one, and those without end slots that drag its feet.

    Args:
        library: the clips.
        request: the request.
        edges: (S + 1,) output frames of all slots.
        at: output frame of the key frame.
        key: the clip's key moment.
        rate: playback rate.
        slots: (first, end) that the clip would fill.
        around: frames on either side of `at` that stay.
    Returns:
        (first, end) of each range, without repeats.
    """
    first, end = slots
    a, b = first, end  # shrink from both ends, slot by slot
    while at - edges[a + 1] >= around and drags(
        library, wanted, at, key=key, rate=rate, low=edges[a], high=edges[a + 1],
    ):
        a += 1
    while edges[b - 1] - at >= around and drags(
        library, wanted, at, key=key, rate=rate, low=edges[b - 1], high=edges[b],
    ):
        b -= 1
    return list(dict.fromkeys([(first, end), (a, end), (first, b), (a, b)]))


def left_out(library: Library, wanted: Wanted, edit: EditList) -> list[TimedLine]:
    """Report each recorded key moment whose clip is shown without a part of its entry or exit that drags its feet.

    Args:
        library: the recordings.
        request: the request.
        edit: the edit list, at the library's rate.
    """
    told = []
    for placed in edit.keys:
        if placed.key.clip < len(library.clips):
            told += _left_out_of(library, wanted, edit, placed.key, wanted.keys[placed.wanted])
    return told


def _left_out_of(library: Library, wanted: Wanted, edit: EditList, key: Key, asked) -> list[TimedLine]:
    """Report what one key moment's clip lacks, for its entry and its exit."""
    at = int(np.clip(round(asked.frame), 0, len(edit) - 1))
    low, high = next(piece for piece in edit.pieces if piece[0] <= at < piece[1])
    entry, leave = needed(library, key)
    rate = (edit.frame[high - 1] - edit.frame[low]) / max(high - 1 - low, 1)
    # the whole clip would run from whole[0] to whole[1]; it is shown from low to high
    whole = round(asked.frame - entry / rate), round(asked.frame + leave / rate)
    start, words = float(wanted.track.times[0]), " ".join(asked.asked.words)
    told = []
    for name, first, end, inside in (("entry", whole[0], low, low > 0), ("exit", high, whole[1], high < len(edit))):
        if inside and end - first >= _TOLD and drags(library, wanted, asked.frame, key=key, rate=rate, low=first,
                                                     high=end):
            when = start + first / library.fps, start + end / library.fps
            lacks = f"the {name} of the clip for '{words}' is left out: the clip stands still while the track moves"
            told.append(TimedLine(f"{when[0]:.1f}-{when[1]:.1f} s: {lacks}", when))
    return told
