"""What a goalkeeper does about a shot, from the ball's way: waits low, catches, pushes away, punches or dives for it.

The ball's side and distance from where the keeper waits choose between standing and a short or a long dive, its height
low or high, and its speed after the touch between a catch and a ball that is pushed away. A ball that passes within
MISSED_REACH into the goal is dived for and missed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...annotation import AVOID_PREFIX
from ...annotation.event_labels import EventLabelTable
from ...annotation.timeline import TOUCH
from ...base.time_series import interpolate_columns
from ..moments import SHOTS, Moment, build_moment
from .shots import GOAL, SAVED, Shot

STANDING_REACH, SHORT_DIVE = 0.6, 1.8
"""m aside up to which a keeper stays on their feet (a step and both arms), and up to which a dive is short: in a short
one the hands meet the ball 1.2 to 1.4 m aside, in a long one 2.5 m (`synthetic.actions.keeper_dives`)."""

MISSED_REACH = 2.5
"""m aside up to which a keeper dives for a ball that goes in."""

WRONG_FOOTED = 0.3
"""m that a keeper moves to the other side while the ball passes, beyond which they dive for it no more."""

READY, SHUFFLE = "ready", "shuffle"
"""Labels of the set position, and of steps sideways in it."""

RESTING_PACE, LOW_PACE = 0.42, 1.6
"""m/s up to which a keeper waits in the set position, and up to which they go sideways in it; a faster one runs. At the
shots of a half the search shows a standing position up to 0.40 m/s, and not from 0.45 on."""

READY_BEFORE, READY_AFTER = 0.4, 0.6
"""s before a shot at which the set position begins, a short hop that ends as the ball is struck, and s after it at
which the position ends at the earliest."""

_DIVE_ENTRY, _STANDING_ENTRY = 1.15, 0.7  # s before the ball with which dives and saves in standing begin, set already
_LOW_DIVE, _PUNCH_HEIGHT = 0.9, 1.9  # m of the ball's centre: dives for lower balls are low; higher ones are punched
_SLOWEST_PARRY = 3.0  # m/s of the ball after a save: a slower ball was caught
_FARTHEST = 4.0  # m aside; a ball that is solved farther away says nothing of the keeper
_PACE_STEP = 0.2  # s between the places that give a keeper's pace: the noise of tracks is faster
_MIN_READY = 0.8  # s: a shorter wait is part of the save itself


def find_save_values(shot: Shot, heights: bool) -> dict[str, str]:
    """Find the labels that replace the placeholders of a save's row in the table.

    Args:
        shot: one that reaches the goalkeeper, or passes them.
        heights: whether the feed has the ball's height.
    Returns:
        "dive", "duration" and "side" for a dive, and "height" where it is known; {} for a save on the feet.
    """
    aside, height = abs(shot.lateral), shot.place[2]
    if not (STANDING_REACH if shot.end == SAVED else 0.0) < aside < _FARTHEST:  # who is beaten has dived
        return {}
    values = {"dive": "dive", "duration": "short_duration" if aside < SHORT_DIVE else "long_duration",
              "side": "left" if shot.lateral > 0.0 else "right"}
    return {**values, "height": ("low" if height < _LOW_DIVE else "high") if heights else ""}


def find_save_event(shot: Shot, after: float, heights: bool) -> tuple[str, tuple[str, ...]]:
    """Find the kind and details of the event that a save is.

    Args:
        shot: one that the goalkeeper touches.
        after: m/s of the ball after the touch.
        heights: whether the feed has the ball's height.
    Returns:
        "save" with "parried" for a ball that leaves fast, or "punch" for a high one that does so.
    """
    if after <= _SLOWEST_PARRY:
        return "save", ()
    is_punch = heights and shot.place[2] > _PUNCH_HEIGHT and abs(shot.lateral) < STANDING_REACH
    return ("punch", ()) if is_punch else ("save", ("parried",))


def label_missed_saves(shots: Sequence[Shot], table: EventLabelTable, heights: bool) -> list[Moment]:
    """Label the dives of one goalkeeper for balls that go in.

    Args:
        shots: at them.
        table: labels by event.
        heights: whether the feed has the ball's height.
    Returns:
        Key moments that miss the ball.
    """
    out = []
    for shot in shots:
        if shot.end == GOAL and abs(shot.lateral) < MISSED_REACH and not _is_wrong_footed(shot):
            labels = table.find_labels("save", "hand", ("parried",), find_save_values(shot, heights))
            out.append(build_moment(shot.arrival, (*labels, AVOID_PREFIX + TOUCH), SHOTS, shot.confidence))
    return [moment for moment in out if moment is not None]


def _is_wrong_footed(shot: Shot) -> bool:
    """Say whether the keeper's own track goes to the other side than the ball."""
    return bool(shot.moved * shot.lateral < 0.0 and abs(shot.moved) > WRONG_FOOTED)


def label_set_positions(shots: Sequence[Shot], moments: Sequence[Moment], times: np.ndarray,
                        path: np.ndarray) -> list[Moment]:
    """Label the stretches in which one goalkeeper waits low for a shot, where they do not run.

    Args:
        shots: at them, in order of time.
        moments: their other moments; a stretch ends before the entry of the next one, and is left out if it is short.
        times: (N,) s of their path.
        path: (N, 2) m, NaN while they are absent.
    Returns:
        Stretches, none over another.
    """
    out: list[Moment] = []
    for shot in shots:
        start = max([shot.time - READY_BEFORE, *(other.end for other in out if other.end is not None)])
        arrival = shot.arrival if np.isfinite(shot.arrival) else shot.time + READY_AFTER
        end = min([max(arrival, shot.time + READY_AFTER), *(_find_entry(other) for other in moments
                                                             if _find_end(other) > start)])
        pace = _measure_pace(times, path, start, end) if end - start >= _MIN_READY else np.inf
        if not pace > LOW_PACE:
            labels = (SHUFFLE if pace > RESTING_PACE else READY,)
            out += filter(None, [build_moment(start, labels, SHOTS, shot.confidence, round(end, 3))])
    return out


def _measure_pace(times: np.ndarray, path: np.ndarray, start: float, end: float) -> float:
    """Measure the mean speed, m/s, on a path (N, 2) m at `times` (N,) s between two seconds; NaN where unknown."""
    at = np.arange(start, end, _PACE_STEP)
    steps = np.diff(interpolate_columns(at, times, path, fill_value=np.nan), axis=0)
    return float(np.linalg.norm(steps, axis=1).sum() / (at[-1] - at[0]))


def _find_entry(moment: Moment) -> float:
    """Find when the body has left the set position for a moment, s."""
    if moment.end is not None:
        return moment.time
    return moment.time - (_DIVE_ENTRY if "dive" in moment.labels else _STANDING_ENTRY)


def _find_end(moment: Moment) -> float:
    return moment.time if moment.end is None else moment.end
