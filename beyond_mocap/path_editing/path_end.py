"""What happens where a path ends before the motion does: the motion stops there, or begins again with the path (Path
editing §3.2.3). A closed path has no end: the motion goes round and round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError, TimedLine

REACHED = 1e-3
"""Metres by which a motion may overshoot the path and still be of its length."""

SHORTEST = 1e-6
"""Metres that a path is long at least."""

_STEP = 0.5  # metres; a path or lap shorter than this is told
_SHORTEST_LAP, _UNSEEN = 0.5, 0.1  # seconds: of a lap that is begun anew, and of a motion's end that nobody misses


@dataclass(frozen=True, eq=False)
class Ending:
    """count: frames from the beginning to the end of the path; shown (N,): which of these every output frame is; again
    (S,): output frames at which the motion begins anew; told: lines for the user."""

    count: int
    shown: np.ndarray
    again: np.ndarray
    told: tuple[str, ...] = ()


def ending(arc: np.ndarray, length: float, fps: float, end: str = "stop", closed: bool = False) -> Ending:
    """How a motion ends on a path `length` metres long, when it is at arc (T,) m, never falling, in its frames.

    end: "stop", or "repeat": motion and path begin again, as often as there are frames, without the wait that a rider
    begins with. InputError for a path that has no length.
    """
    if not np.isfinite(length) or length <= SHORTEST:
        raise InputError("path", "it has no length", "two different points", "draw a longer path")
    total = len(arc)
    whole = np.arange(total)
    none = np.zeros(0, dtype=int)
    short = (f"the path is only {length:.2f} m long, less than a step",) if length < _STEP else ()
    if closed:
        return Ending(total, whole, none, short)
    count = max(int(np.searchsorted(arc, length + REACHED, side="right")), 1)
    if count == total:
        return Ending(total, whole, none, short)
    first = _begins(arc[:count])
    if end == "repeat" and count - first >= _SHORTEST_LAP * fps:
        return _again(first, count, total, fps, short)
    when, left = count / fps, (total - count) / fps
    line = TimedLine(f"the path ends after {when:.1f} s, {left:.1f} s before the motion", (when, when))
    stops = (line,) if left > _UNSEEN else ()
    brief = ("the path is passed too quickly to begin again",) if end == "repeat" else ()
    return Ending(count, whole[:count], none, (*stops, *brief, *short))


def _begins(arc: np.ndarray) -> int:
    """The last of the frames that wait at the path's beginning."""
    return max(int(np.searchsorted(arc, arc[0] + 1e-12, side="right")) - 1, 0)


def _again(first: int, count: int, total: int, fps: float, told: tuple[str, ...]) -> Ending:
    later = np.arange(total - count)
    shown = np.concatenate([np.arange(count), first + later % (count - first)])
    again = np.arange(count, total, count - first)
    times = "once" if len(again) == 1 else f"{len(again)} times"
    line = TimedLine(f"the path ends after {count / fps:.1f} s; the motion begins again {times}", (count / fps,) * 2)
    return Ending(count, shown, again, (line, *told))
