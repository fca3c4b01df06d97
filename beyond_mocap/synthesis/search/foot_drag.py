"""Entries and exits of key moments' clips that stand still while the track moves: what may be left out, and its report.

A player who arrives at a run does not stand still before a header. On that track, a clip that stands still there would
be dragged with both feet on the ground, and no step is added around a touch. Sliding feet yield later than transitions
(docs/explanation/quality.md), so the search also has such a clip without that part as a candidate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.errors import TimedMessage
from ...library.keys import Key
from ...library.library import Library
from .candidate_index import USUAL_STANCE
from .edit_list import EditList
from .request import SearchRequest, compute_needed_frames, library_frame

DRAG_SPEED = 1.0
"""m/s between a clip with both feet on the ground and the track, above which the feet are dragged."""

_REPORTED_FRAMES = 4.0  # frames left out from which on it is reported


def drags_feet(library: Library, request: SearchRequest, at: float, key: Key, rate: float, low: int, high: int) -> bool:
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
    frames, out = library.frames, np.arange(max(low, 0), min(high, len(request)))
    first = frames.first[key.clip]
    clip_frames = np.round(library_frame(library, key) + rate * (out - at)).astype(int)
    clip_frames = np.clip(clip_frames, first, first + frames.count[key.clip] - 1)
    apart = np.abs(request.track.speed[out] - rate * frames.speed[clip_frames])
    feet = (library.stance_seconds[clip_frames] > USUAL_STANCE) & (apart > DRAG_SPEED)
    return 2 * np.count_nonzero(feet) > len(out)


def list_slot_ranges(
    library: Library, request: SearchRequest, edges: Sequence[int], at: float, key: Key, rate: float,
    slots: tuple[int, int], around: float,
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
    while at - edges[a + 1] >= around and drags_feet(
        library, request, at, key=key, rate=rate, low=edges[a], high=edges[a + 1],
    ):
        a += 1
    while edges[b - 1] - at >= around and drags_feet(
        library, request, at, key=key, rate=rate, low=edges[b - 1], high=edges[b],
    ):
        b -= 1
    return list(dict.fromkeys([(first, end), (a, end), (first, b), (a, b)]))


def report_left_out(library: Library, request: SearchRequest, edit: EditList) -> list[TimedMessage]:
    """Report each recorded key moment whose clip is shown without a part of its entry or exit that drags its feet.

    Args:
        library: the recordings.
        request: the request.
        edit: the edit list, at the library's rate.
    """
    messages = []
    for placed in edit.keys:
        if placed.key.clip < len(library.clips):
            messages += _report_clip(library, request, edit, placed.key, request.keys[placed.number])
    return messages


def _report_clip(library: Library, request: SearchRequest, edit: EditList, key: Key, moment) -> list[TimedMessage]:
    """Report what one key moment's clip lacks, for its entry and its exit."""
    at = int(np.clip(round(moment.frame), 0, len(edit) - 1))
    low, high = next(piece for piece in edit.pieces if piece[0] <= at < piece[1])
    entry, leave = compute_needed_frames(library, key)
    rate = (edit.frame[high - 1] - edit.frame[low]) / max(high - 1 - low, 1)
    if rate <= 0.0:  # a single frame between other key moments: nothing of the clip is played
        return []
    # the whole clip would run from whole[0] to whole[1]; it is shown from low to high
    whole = round(moment.frame - entry / rate), round(moment.frame + leave / rate)
    start, words = float(request.track.times[0]), " ".join(moment.requested.words)
    messages = []
    for name, first, end, inside in (("entry", whole[0], low, low > 0), ("exit", high, whole[1], high < len(edit))):
        if inside and end - first >= _REPORTED_FRAMES and drags_feet(library, request, moment.frame, key=key, rate=rate,
                                                                     low=first, high=end):
            when = start + first / library.fps, start + end / library.fps
            text = f"the {name} of the clip for '{words}' is left out: the clip stands still while the track moves"
            messages.append(TimedMessage(f"{when[0]:.1f}-{when[1]:.1f} s: {text}", when))
    return messages
