"""Run-up to a generated throw and recovery from it, constructed from a library.

    run_up = construct_run_up(library, plan, thrown.motion, thrown.release, 12.4, action="throw")

The throw becomes a clip of the library, in memory, whose key moment is the release. The player's track is led
through the position of the throw, since the throw is aimed from there, and the search finds the motion before and
after it. `join_throw` then inserts the exact throw.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import ClipAnnotation, KeyMoment, Span, Timeline, labels
from ..base.easing import quintic_between
from ..base.errors import InputError, TimedLine, told_time
from ..library.clip import Clip
from ..library.features import describe_clips
from ..library.features import joined as joined_frames
from ..library.library import Library
from ..motion import contacts
from ..motion.humanoid import heading
from ..motion.motion import Motion, resample
from ..motion.retargeting.retarget import Retargeter
from ..motion.track import SampledTrack, Track, zero_phase_hann
from ..synthesis.construct.construction import Construction, find_touches, key_results
from ..synthesis.known_touches import solve_touches
from ..synthesis.plan import Plan, ResolvedPlan
from ..synthesis.resolve_plan import resolve_plan
from ..synthesis.search.edit_list import EditList
from ..synthesis.search.footage import Footage, fetch, output_index
from ..synthesis.search.path_costs import balanced
from ..synthesis.search.path_search import PathSearch
from ..synthesis.search.wanted import Wanted, build_order
from ..synthesis.search_library import search_library

OWN_WORD = "generated"
"""The label that only the generated clip has."""

ACTIONS = {action: labels.list_labels(action=action, is_root=True)[:1] for action in labels.ACTIONS}
"""Action of a model -> label of the key moment in which it happens."""

SMOOTH = 0.7
"""Seconds of the window that removes the sway from a body's own path."""

EDGE = 0.1
"""Seconds at either end of the generated clip that are used for its transitions."""

_CLIP = "generated throw"
_ENDS = 0.5  # s at either end of a stretch with the heading of the surrounding motion
_CATCH_UP = 0.8  # m/s, speed difference to the track on the detour to the throw
_LEADS = (1.0, 4.0)  # s, shortest and longest duration of the detour to the throw and back

Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False, kw_only=True)
class RunUpResult:
    """A player's motion around a throw, on the throw's own skeleton.

    Attributes:
        motion: the whole motion.
        start: s of its first frame on the track's clock.
        transitions: frames at which another clip begins.
        warnings: warnings for people.
    """

    motion: Motion
    start: float
    seams: np.ndarray
    warnings: tuple[str, ...] = ()


def construct_run_up(
    library: Library, plan: Plan, throw: Motion, release: float, at: float, *, action: str = "throw",
    progress: Progress | None = None, cancelled: Callable[[], bool] | None = None, between: Motion | None = None,
) -> RunUpResult:
    """Construct a player's motion with the throw as one of the library's clips, released at about `at` s.

    Args:
        library: the clips.
        plan: plan of the player; its track is led through the throw, and key moments whose resolved touches lie
            within the throw are left out, with a warning.
        throw: the throw at its final position on the pitch, on any humanoid skeleton.
        release: s in the throw at which the ball leaves.
        at: s of the release on the track's clock.
        action: one of ACTIONS.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
        between: motion before and after, frame for frame: the result has its heading at either end.
    Raises:
        InputError: if the throw lies outside the track.
    """
    from threadpoolctl import threadpool_limits

    _check(plan, throw, at - release)
    with threadpool_limits(limits=1):
        known = solve_touches(plan)
    led, warnings = _plan_with_throw(known, throw, release, at, action)
    resolved = resolve_plan(led, library, touches_solved=True)
    size = resolved.size
    bones = library.skeleton.scaled(size)
    same = throw.skeleton.same_bones(bones, 1e-5)
    own = throw if same else Retargeter(throw, bones, keeps_travel=True).carry(throw)
    own = Motion(library.skeleton, own.root_positions / size, own.rotations, own.fps)
    report = progress or (lambda done, text: None)
    more = add_throw_clip(search_library(library, resolved, report), own, release, action)
    with threadpool_limits(limits=1):
        order = _order(more, resolved)
        search = PathSearch(more, order, balanced(plan.alpha), lambda done, text: report(0.8 * done, text), cancelled)
        edit = search.run()
        report(0.8, "Constructing")
        construction = _construction(more, resolved, order, edit, _heading_of(own, at - release, between))
        planted, _ = construction.lay_out()
    motion = Motion(bones, planted.root * size, planted.rotations, plan.fps)
    if not same:
        motion = Retargeter(motion, throw.skeleton, example=throw, keeps_travel=True).carry(motion)
    start, seams = float(resolved.track.times[0]), construction.source.seams
    return RunUpResult(motion=motion, start=start, seams=seams, warnings=(*warnings, *order.warnings))


def _check(plan: Plan, throw: Motion, begin: float) -> None:
    """Raise InputError if the throw lies outside the track."""
    finish, times = begin + throw.duration, plan.track.times
    if begin < times[0] - 0.5 / plan.fps or finish > times[-1] + 0.5 / plan.fps:
        raise InputError(
            "throw", f"from {begin:.2f} to {finish:.2f} s", f"within the track, {times[0]:.2f} to {times[-1]:.2f} s",
            "choose another time or a longer track",
        )


def _order(library: Library, plan: ResolvedPlan) -> Wanted:
    """Build the search request; the generated clip is played at its own rate only."""
    order = build_order(library, plan)
    keys = tuple(replace(key, rates=(1.0,)) if OWN_WORD in key.asked.words else key for key in order.keys)
    return replace(order, keys=keys)


def _construction(
    library: Library, plan: ResolvedPlan, order: Wanted, edit: EditList, heading_of: Callable
) -> Construction:
    """Build the construction of the motion that the search found."""
    track = plan.sampled(plan.fps)
    index = output_index(len(track.times), library, plan.fps, len(edit))
    source = fetch(library, edit, index, plan.fps)
    touches = find_touches(library, plan.fps, edit, key_results(library, plan.fps, order, edit, source))
    heading_given = heading_of(track, source, len(library.clips) - 1)
    return Construction(
        library=library, plan=plan, track=track, source=source, touches=touches, heading=heading_given,
        faces_ball=False,
    )


def _heading_of(throw: Motion, begin: float, between: Motion | None) -> Callable:
    """Build a function heading(track, source, clip) -> (T,) rad, NaN where the heading is free.

    The heading is that of the throw, which is that clip and begins at second `begin`, while it is played, and that
    of `between` at both ends.
    """
    def given(track: SampledTrack, source: Footage, clip: int) -> np.ndarray:
        kept = np.full(len(track.times), np.nan)
        is_throw = source.clip == clip
        seconds = track.times[is_throw] - begin
        kept[is_throw] = np.interp(seconds, np.arange(len(throw)) / throw.fps, heading(throw))
        if between is not None:
            faces, count = heading(between), int(_ENDS * track.fps)
            for end in (slice(None, count), slice(-count, None)):
                kept[end] = np.where(np.isnan(kept[end]), faces[end], kept[end])
        return kept

    return given


def add_throw_clip(library: Library, motion: Motion, release: float, action: str = "throw") -> Library:
    """Add a clip to a library, in memory only.

    Args:
        library: the library.
        motion: the throw on the library's skeleton.
        release: s from its first frame to its key moment.
        action: one of ACTIONS.
    """
    edge = int(EDGE * motion.fps)
    words = (*ACTIONS[action], OWN_WORD)
    key = float(np.clip(release * motion.fps, edge, len(motion) - 1 - edge))
    row = ClipAnnotation(edge, len(motion) - 1 - edge, key, words)
    clip = Clip(path=_CLIP, mirrored=False, motion=motion, annotations=(row,), standing=contacts.points(motion))
    frames = joined_frames(library.frames, describe_clips([clip], library.frames))
    return replace(library, clips=(*library.clips, clip), frames=frames, clusters={}, kept=None)


def _plan_with_throw(plan: Plan, throw: Motion, release: float, at: float, action: str) -> tuple[Plan, list[str]]:
    """Insert the throw into the track and timeline of a plan; also return warnings about what is left out."""
    begin = at - release
    asked, told = _timeline_with_throw(plan.timeline, begin, begin + throw.duration, at, ACTIONS[action])
    if plan.pins:
        told.append("the plan's pinned clips are ignored, because the plan contains a throw")
    track = _lead_through(plan, throw, release, at)
    return replace(plan, track=track, timeline=asked, pins=(), method="path"), told


def _timeline_with_throw(
    timeline: Timeline, begin: float, finish: float, at: float, words: tuple[str, ...]
) -> tuple[Timeline, list[str]]:
    """Insert the throw's key moment into a timeline, without key moments that overlap it; also return warnings."""
    kept = [key for key in timeline.keys if not begin < key.in_force < finish]
    told: list[str] = [
        TimedLine(f"{told_time(key.time)} s: '{' '.join(key.words)}' overlaps the throw and is left out",
                  (key.time, key.time))
        for key in timeline.keys if key not in kept
    ]  # fmt: skip
    spans = [part for span in timeline.spans for part in _outside(span, begin, finish)]
    return Timeline(tuple(spans), (*kept, KeyMoment(at, (*words, OWN_WORD)))), told


def _outside(span: Span, begin: float, finish: float) -> list[Span]:
    """Return the parts of a span outside the throw."""
    if span.end <= begin or span.start >= finish:
        return [span]
    parts = [(span.start, min(span.end, begin)), (max(span.start, finish), span.end)]
    return [replace(span, start=a, end=b) for a, b in parts if b - a > 0.1]


def _lead_through(plan: Plan, throw: Motion, release: float, at: float) -> Track:
    """Lead the plan's track through the position of the throw while it lasts.

    Before and after it the track makes a detour at a feasible pace.
    """
    fps = plan.fps
    track = plan.sampled(fps)
    own = resample(throw, fps)
    path = zero_phase_hann(own.root_positions[:, :2], fps, SMOOTH)
    begin = at - release
    seconds = begin + np.arange(len(path)) / fps
    places, times = track.raw.copy(), track.times
    inside = (times >= seconds[0]) & (times <= seconds[-1])
    for axis in (0, 1):
        places[inside, axis] = np.interp(times[inside], seconds, path[:, axis])
    for way, edge in ((-1, 0), (1, -1)):
        there = float(seconds[edge]), path[edge], _velocity(path, edge, fps)
        places = _bridge(places, times, track, there, way)
    ball = None if plan.track.ball is None else track.ball
    return Track(times, places, ball)


def _bridge(places: np.ndarray, times: np.ndarray, track: SampledTrack, there: tuple, way: int) -> np.ndarray:
    """Insert a path from the track to the throw (way -1) or back to the track (1) into the positions (T, 2) m."""
    edge = there[0]
    off = np.linalg.norm([np.interp(edge, times, track.positions[:, axis]) - there[1][axis] for axis in (0, 1)])
    seconds = float(np.clip(2.0 * off / _CATCH_UP, *_LEADS))
    far = float(np.clip(edge + way * seconds, times[0], times[-1]))
    if abs(far - edge) < 2.0 / track.fps:
        return places
    here = far, *(np.array([np.interp(far, times, column) for column in values.T])
                  for values in (track.positions, track.velocity))  # fmt: skip
    low, high = (here, there) if way < 0 else (there, here)
    between = (times > low[0]) & (times < high[0])
    out = places.copy()
    out[between] = quintic_between(times[between], low, high)
    return out


def _velocity(path: np.ndarray, edge: int, fps: float) -> np.ndarray:
    """Measure the velocity (2,) m/s of a path at its first (edge 0) or last frames."""
    few = path[:4] if edge == 0 else path[-4:]
    return (few[-1] - few[0]) / (len(few) - 1) * fps
