"""The clips that a plan is searched in: the recordings, with synthetic ones where those lack what is requested."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..annotation.ball_contact import takes_with_foot
from ..library.automatic import with_chosen_gaits
from ..library.library import Library
from ..motion.track import sample
from .plan import ResolvedPlan
from .search.edit_list import EditList


def search_library(
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
    if shows_synthetic or plan.method == "path" and plan.asked.made and _lacks(library, plan):
        if report is not None:
            report(0.0, "Building synthetic clips")
        library = library.extended
    return with_chosen_gaits(library, dict(plan.asked.gaits))


def _lacks(library: Library, plan: ResolvedPlan) -> bool:
    """Return whether the recordings lack speeds of the track, or touches as fast as its key moments."""
    track = sample(plan.track, library.fps, plan.asked.track_window)
    moments = np.array([key.in_force for key in plan.timeline.keys])
    takes = np.array([takes_with_foot(key.words) for key in plan.timeline.keys], bool)
    return library.lacks(track.speed, np.interp(moments, track.times, track.speed), takes)
