"""The output cut into slots of about eight frames, and the pieces that clips of key moments fill among them.

A key moment's clip is played for its own entry and exit (Faustino 2016, §3.2.2): from the last slot edge before the
entry to the first one after the exit, at one playback rate, so that the key frame is on time; where its feet would be
dragged, also without that part (`foot_drag`). Midway between two key moments that are close together lies an edge
that neither crosses.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ...base.time_series import find_runs
from ...library.clip import Clip
from ...library.keys import Key
from ...library.library import Library
from .candidate_index import SLOT
from .foot_drag import list_slot_ranges
from .request import RequestedKey, SearchRequest, compute_needed_frames, library_frame, name_clip_key

KEY_PLAYBACK_RATES = np.array([0.8, 0.9, 1.0, 1.12, 1.25])  # rates at which a key moment's clip may be played
MIN_SLOT = 6  # frames of the shortest slot beside an extra edge
MIN_KEY_MARGIN = 12
"""Least frames before and after a key frame that its clip is played, however short its annotated row: a nearer cut
would be inside the swing itself."""

# s without a foot on the ground, longer than a runner's flight, and s from the key moment within which it counts
_OFF_FEET_SECONDS, _OFF_FEET_WITHIN = 0.25, 0.6
_CROWDED = 3 * SLOT  # frames between key moments below which they are close together
_TRIMMED = 2.5  # frames of an entry or exit that may be cut off, so that they do not bind one more slot


@dataclass(frozen=True, eq=False)
class KeyPieces:
    """P ways to serve key moments, every choice at every playback rate.

    Attributes:
        number: (P,) number of the key moment.
        choice: (P,) which of its choices.
        clip: (P,) clip index.
        rate: (P,) playback rate.
        first: (P,) first slot.
        end: (P,) slot after the last one.
        start: (P,) fractional library frame at the first slot's edge.
    """

    number: np.ndarray
    choice: np.ndarray
    clip: np.ndarray
    rate: np.ndarray
    first: np.ndarray
    end: np.ndarray
    start: np.ndarray

    def key(self, request: SearchRequest, piece: int) -> Key:
        """Return the library's key moment that a piece plays."""
        return request.keys[self.number[piece]].choices[self.choice[piece]]


def build_slot_edges(
    library: Library, request: SearchRequest, first: int = 0, end: int | None = None, on_grid: bool = False
) -> np.ndarray:
    """Cut the output into slots of about SLOT frames.

    There is an edge midway between key moments that are close together, and one before and after each where the
    shortest of its clips begins and ends, so that a clip which does not fit its surroundings is not played longer than
    it must be; none of these leaves a slot shorter than MIN_SLOT beside it.

    Args:
        library: the clips.
        request: the request.
        first: first output frame.
        end: frame after the last one; None for all.
        on_grid: whether edges lie at multiples of SLOT wherever key moments permit, so that searches of overlapping
            stretches share them.
    Returns:
        (S + 1,) output frames.
    """
    end = len(request) if end is None else end
    served = [key for key in request.keys if key.choices and first <= round(key.frame) < end]
    at = [key.frame for key in served]
    halfway = [round((a + b) / 2) for a, b in zip(at, at[1:]) if b - a < _CROWDED]
    fixed = np.unique(np.clip([first, *halfway, end], first, end))
    for key in served:
        entry, leave = np.min([compute_needed_frames(library, choice) for choice in key.choices], axis=0)
        for edge in (round(key.frame - max(entry, MIN_KEY_MARGIN)), round(key.frame + max(leave, MIN_KEY_MARGIN))):
            if np.abs(fixed - edge).min() >= MIN_SLOT and first < edge < end:
                fixed = np.sort(np.append(fixed, edge))
    fixed = _add_grid(fixed) if on_grid else fixed
    parts = [np.linspace(a, b, max(1, round((b - a) / SLOT)) + 1)[:-1] for a, b in zip(fixed, fixed[1:])]
    return np.round(np.concatenate([*parts, [end]])).astype(int)


def _add_grid(fixed: np.ndarray) -> np.ndarray:
    """Add the first and the last multiple of SLOT between each two edges that leaves no short slot beside them."""
    out = [fixed]
    for low, high in zip(fixed, fixed[1:]):
        # the first multiple rounded up, the last rounded down
        first, last = -(-(low + MIN_SLOT) // SLOT) * SLOT, (high - MIN_SLOT) // SLOT * SLOT
        out.append(np.array([first, last] if first <= last else [], int))
    return np.unique(np.concatenate(out))


def build_key_pieces(library: Library, request: SearchRequest, edges: np.ndarray) -> KeyPieces:
    """Build all pieces of all key moments between the first edge and the last.

    A key moment between two others in the same slot has no room and gets none.
    """
    served = [n for n, key in enumerate(request.keys) if key.choices and edges[0] <= round(key.frame) < edges[-1]]
    inside = {number: find_slot(edges, request.keys[number].frame) for number in served}
    rows: list[tuple] = []
    for before, number, after in zip([None, *served], served, [*served[1:], None]):
        # slots low .. high are free for this key moment: up to the edges midway to its neighbours
        low = 0 if before is None else _find_edge_between(edges, request, before, number)
        high = len(edges) - 1 if after is None else _find_edge_between(edges, request, number, after)
        if low <= inside[number] < high:
            rows += _build_pieces(library, request, edges, number=number, low=low, high=high)
    columns = zip(*rows) if rows else [()] * 7
    kinds = (int, int, int, float, int, int, float)
    return KeyPieces(*(np.array(column, dtype=kind) for column, kind in zip(columns, kinds)))


def _build_pieces(library: Library, request: SearchRequest, edges: np.ndarray, number: int, low: int,
                  high: int) -> list[tuple]:
    """Build the pieces of one key moment, between the edges numbered low and high.

    Returns:
        Rows in the order of the fields of `KeyPieces`.
    """
    key = request.keys[number]
    here, known_edges = find_slot(edges, key.frame), edges.tolist()  # numbers of Python, which one by one cost less
    rows = []
    for choice, option in enumerate(key.choices):
        entry, leave = np.maximum(compute_needed_frames(library, option), MIN_KEY_MARGIN)
        for rate in list_playback_rates(library, key, option):
            # the last edge before the entry and the first one after the exit, both a little trimmed
            first = bisect_right(known_edges, key.frame - entry / rate + _TRIMMED) - 1
            end = bisect_left(known_edges, key.frame + leave / rate - _TRIMMED)
            first, end = min(max(first, low), here), min(max(end, here + 1), high)
            around = MIN_KEY_MARGIN / rate - _TRIMMED
            for a, b in list_slot_ranges(library, request, known_edges, at=key.frame, key=option, rate=rate,
                                         slots=(first, end), around=around):
                # so that the key frame is played at exactly key.frame
                start = library_frame(library, option) - rate * (key.frame - edges[a])
                rows.append((number, choice, option.clip, rate, a, b, start))
    return rows


def list_playback_rates(library: Library, key: RequestedKey, option: Key) -> Sequence[float] | np.ndarray:
    """List the playback rates of a clip: a body in the air, and one that falls or slides, keeps gravity's time.

    Args:
        library: the clips.
        key: the requested key moment.
        option: the library's key moment that serves it.
    Returns:
        The rates; one alone is that of the swing too.
    """
    known, name = _off_feet.setdefault(library.clips[option.clip], {}), name_clip_key(library, option)
    if name not in known:
        known[name] = _is_off_feet(library, option)
    return (1.0,) if known[name] else key.rates or KEY_PLAYBACK_RATES


_off_feet: WeakKeyDictionary[Clip, dict[Key, bool]] = WeakKeyDictionary()
"""Whether clips are off their feet around their key moments."""


def _is_off_feet(library: Library, option: Key) -> bool:
    """Return whether the body is in the air, falls or slides around a key moment."""
    reach = int(_OFF_FEET_WITHIN * library.fps)
    at, first = library_frame(library, option), library.frames.first[option.clip]
    low, high = np.clip([round(at) - reach, round(at) + reach], first, first + library.frames.count[option.clip] - 1)
    off = find_runs(~library.feet_in_contact[low : high + 1].any(axis=1))
    return any(b - a >= _OFF_FEET_SECONDS * library.fps for a, b in off)


def find_slot(edges: np.ndarray, frame: float) -> int:
    """Return the slot in which an output frame lies."""
    return int(np.clip(np.searchsorted(edges, frame, side="right") - 1, 0, len(edges) - 2))


def _find_edge_between(edges: np.ndarray, request: SearchRequest, a: int, b: int) -> int:
    """Return the number of the edge nearest to the middle between two key moments."""
    return int(np.argmin(np.abs(edges - (request.keys[a].frame + request.keys[b].frame) / 2)))
