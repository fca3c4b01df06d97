"""Resolve a plan for a library: touches solved, the player in the library's size.

    plan = resolve_plan(Plan(track=track, timeline=timeline, height=1.7), library)
    request = build_request(library, plan)

A player of s times the height of the library's skeleton who runs 5 m/s moves as the library does at 5 / s m/s. So the
track and the ball are divided by s here, and skeleton and root are multiplied by s in the end (`body_size`).
"""

from __future__ import annotations

from dataclasses import replace

from ..library.library import Library
from ..motion.humanoid import estimate_stature
from ..motion.skeleton import Skeleton
from ..motion.track import Track
from .plan import Plan, ResolvedPlan, SolvedTrajectory
from .resolved_touches import resolve_touches


def resolve_plan(
    plan: Plan, library: Library, *, trajectory: SolvedTrajectory | None = None, are_touches_resolved: bool = False
) -> ResolvedPlan:
    """Solve the touches and the body size of a plan for a library.

    Args:
        plan: the plan.
        library: the clips.
        trajectory: the ball's trajectory, where an earlier take of the same track has it.
        are_touches_resolved: whether the plan's key moments are at its touches already
            (`resolved_touches.resolve_touches`).
    """
    with_touches = plan if are_touches_resolved else resolve_touches(plan, trajectory)
    size = measure_size(plan, library.skeleton)
    return ResolvedPlan(
        requested=plan, timeline=with_touches.timeline, track=_scale_track(with_touches.track, size),
        trajectory=with_touches.solved, size=size
    )


def measure_size(plan: Plan, skeleton: Skeleton) -> float:
    """Measure how many times as tall as the library's skeleton a plan's player is."""
    return plan.height / estimate_stature(skeleton) if plan.height else 1.0


def _scale_track(track: Track, size: float) -> Track:
    """Scale a track and its ball to the library's size."""
    if size == 1.0:
        return track
    ball = None if track.ball is None else track.ball / size
    return replace(track, positions=track.positions / size, ball=ball)
