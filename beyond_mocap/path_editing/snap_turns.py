"""Where a path turns a body faster than a body turns."""

from __future__ import annotations

import numpy as np

from ..base.errors import TimedMessage
from ..evaluation.naturalness import EVENTS, SNAP_SECONDS, find_snap_turns, format_event, measure_course
from ..motion.motion import Motion, forward_kinematics
from .path_edit import EditedMotion

_TEXT = {name: text for name, _, text in EVENTS}["snap_turns"]


def report_snap_turns(edited: EditedMotion) -> list[TimedMessage]:
    """Report the turns by more than 75 degrees within 0.3 s that the motion has on its new path and not on its own.

    Args:
        edited: the motion on the new path; of one that restarts with its path the first lap counts.
    Returns:
        At most one message, with the seconds; none for a skeleton without legs.
    """
    if not edited.source.has_legs:
        return []
    edited, motion = edited.remove_repeats, edited.source.motion
    turns, own_turns = _find_seconds(edited.motion), _find_seconds(motion)
    recorded = np.interp(turns * edited.motion.fps, np.arange(len(edited.frames)), edited.frames) / motion.fps
    turns = turns[(np.abs(recorded[:, None] - own_turns) > SNAP_SECONDS).all(axis=1)]
    return [format_event(turns, f"{_TEXT}: smooth the path there")] if len(turns) else []


def _find_seconds(motion: Motion) -> np.ndarray:
    """Find the seconds (K,) of a motion's snap turns."""
    course = measure_course(motion.skeleton, forward_kinematics(motion)[0], motion.fps)
    return course.times[find_snap_turns(course)]
