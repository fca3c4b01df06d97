"""The clips that a plan is searched in: the recordings, with synthetic ones where those lack what is requested."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..annotation.ball_contact import takes_with_foot
from ..annotation.gaits import compute_heading_offset
from ..library.automatic_locomotion import apply_chosen_gaits
from ..library.keys import select_keys
from ..library.library import Library
from .plan import ResolvedPlan
from .search.edit_list import EditList


def extend_library(
    library: Library, plan: ResolvedPlan, report: Callable[[float, str], None] | None = None,
    edit: EditList | None = None,
) -> Library:
    """Extend the recordings by what a plan needs, and choose its gaits.

    Args:
        library: the recordings.
        plan: the resolved plan.
        report: called as report(fraction, text) before synthetic clips are built.
        edit: what an earlier search chose; where it shows synthetic clips the library has them too.
    """
    shows_synthetic = edit is not None and int(edit.clip.max()) >= len(library.clips)
    if shows_synthetic or plan.method == "path" and plan.requested.made and _lacks_speeds(library, plan):
        if report is not None:
            report(0.0, "Building synthetic clips")
        library = library.with_synthetic_clips
    return apply_chosen_gaits(library, dict(plan.requested.gaits))


def _lacks_speeds(library: Library, plan: ResolvedPlan) -> bool:
    """Return whether the recordings lack speeds of the track, receptions, or touches as fast as its key moments."""
    track = plan.sample_track(library.fps)
    moments = np.array([key.resolved_time for key in plan.timeline.keys])
    takes = np.array([takes_with_foot(key.words) for key in plan.timeline.keys], bool)
    offset = compute_heading_offset(track)
    if any(take and not select_keys(library.keys, key.words) for take, key in zip(takes, plan.timeline.keys)):
        return True
    return library.needs_synthetic_clips(track.speed, offset, np.unwrap(track.direction + offset),
                                         np.interp(moments, track.times, track.speed), takes)
