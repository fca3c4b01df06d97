"""The clips that a plan is searched in: the recordings, with synthetic ones where those lack what is requested."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..annotation.ball_contact import takes_with_foot
from ..annotation.gaits import compute_heading_offset
from ..library.automatic_locomotion import apply_chosen_gaits
from ..library.library import Library
from ..library.missing_actions import ActionMoment, add_actions, find_missing_actions
from .plan import ResolvedPlan
from .requested_actions import read_moment_action, read_span_action
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
    actions = find_plan_actions(library, plan)
    shows_synthetic = edit is not None and int(edit.clip.max()) >= len(library.clips)
    if shows_synthetic or actions or _may_add_clips(plan) and _lacks_speeds(library, plan):
        if report is not None:
            report(0.0, "Building synthetic clips")
        library = add_actions(library.with_synthetic_clips, actions)
    return apply_chosen_gaits(library, dict(plan.requested.gaits))


def find_plan_actions(library: Library, plan: ResolvedPlan) -> tuple[str, ...]:
    """Find the paths of synthetic clips for the actions of a plan that no recording shows (`library.missing_actions`).

    Args:
        library: the recordings.
        plan: the resolved plan; none where it allows no synthetic clips.
    """
    if not _may_add_clips(plan):
        return ()
    return find_missing_actions(library, _list_action_moments(library, plan), plan.requested.mirror)


def _may_add_clips(plan: ResolvedPlan) -> bool:
    return plan.method == "path" and plan.requested.made


def _list_action_moments(library: Library, plan: ResolvedPlan) -> list[ActionMoment]:
    """List the actions that the key moments and spans of a plan ask for."""
    moments, spans = plan.timeline.keys, plan.timeline.spans
    if not moments and not spans:
        return []
    sampled = plan.sample_track(library.fps)
    return [*(read_moment_action(moment, plan.track, sampled) for moment in moments),
            *(read_span_action(span, sampled) for span in spans)]


def _lacks_speeds(library: Library, plan: ResolvedPlan) -> bool:
    """Return whether the recordings lack speeds of the track, or touches as fast as its key moments."""
    track = plan.sample_track(library.fps)
    moments = [key.resolved_time for key in plan.timeline.keys if not takes_with_foot(key.words)]
    offset = compute_heading_offset(track)
    return library.needs_synthetic_clips(track.speed, offset, np.unwrap(track.direction + offset),
                                         np.interp(moments, track.times, track.speed))
