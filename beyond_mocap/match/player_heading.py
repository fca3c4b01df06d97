"""The planned heading of a player of a match over a whole stretch, so that all windows that are cut out of it agree."""

from __future__ import annotations

from dataclasses import replace

from ..library.library import Library
from ..synthesis.heading_path import HeadingPath
from ..synthesis.heading_request import HeadingKey, Play
from ..synthesis.plan import Plan
from ..synthesis.resolve_plan import resolve_plan


def plan_player_heading(library: Library, plan: Plan, play: Play | None) -> HeadingPath:
    """Plan the heading of one stretch of a player.

    Args:
        library: the clips.
        plan: of the stretch.
        play: what the player faces beside the ball, None where that is not known.
    Returns:
        The planned heading; where joints show the body it comes from there and goes on from there.
    Raises:
        InputError: for a plan whose headings contradict each other.
    """
    keys = [HeadingKey(time, heading=float(heading), target=None, hold=0.0) for body in plan.bodies
            for time, heading in zip((body.start, body.end), body.compute_heading(library.skeleton)[[0, -1]])]
    begin, end = plan.track.times[[0, -1]]
    keys = [key for key in keys if key.is_within(begin, end)]
    if play is not None:
        measured = [key for key in play.keys if key.is_within(begin, end)
                    and not any(key.is_within(body.start, body.end) for body in plan.bodies)]
        play = replace(play, keys=tuple(measured))
    resolved = resolve_plan(replace(plan, heading_keys=tuple(keys)), library, are_touches_resolved=True)
    return resolved.plan_heading(play)
