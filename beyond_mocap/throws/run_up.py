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
from ..base.easing import interpolate_quintic
from ..base.errors import InputError, TimedMessage, format_seconds
from ..library.clip import Clip
from ..library.features import build_frames
from ..library.features import join_frames as joined_frames
from ..library.library import Library
from ..motion import contacts
from ..motion.humanoid import compute_heading
from ..motion.motion import Motion, resample
from ..motion.retargeting.retarget import Retargeter
from ..motion.track import SampledTrack, Track, smooth_zero_phase_hann
from ..synthesis.construct.construction import Construction, build_key_results, find_touches
from ..synthesis.heading_request import HeadingKey
from ..synthesis.one_thread import limit_to_one_thread
from ..synthesis.plan import Plan, ResolvedPlan
from ..synthesis.resolve_plan import resolve_plan
from ..synthesis.resolved_touches import resolve_touches
from ..synthesis.search.cost_weights import balance_weights
from ..synthesis.search.edit_list import EditList
from ..synthesis.search.path_search import PathSearch
from ..synthesis.search.request import SearchRequest, build_request
from ..synthesis.search.source_frames import SourceMotion, fetch_motion, output_index
from ..synthesis.search_library import extend_library

OWN_LABEL = "generated"
"""The label that only the generated clip has."""

ACTIONS = {action: labels.list_labels(action=action, is_root=True)[:1] for action in labels.ACTIONS}
"""Action of a model -> label of the key moment in which it happens."""

SMOOTHING_WINDOW = 0.7
"""Seconds of the window that removes the sway from a body's own path."""

EDGE = 0.1
"""Seconds at either end of the generated clip that are used for its transitions."""

_CLIP = "generated throw"
_END_SECONDS = 0.5  # s at either end of a stretch with the heading of the surrounding motion
_KEY_SECONDS = 0.2  # s between two heading keys: the planned heading turns with the throw
_CATCH_UP = 0.8  # m/s, speed difference to the track on the detour to the throw
_DETOUR_RANGE = (1.0, 4.0)  # s, shortest and longest duration of the detour to the throw and back

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
    transitions: np.ndarray
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
    _check_times(plan, throw, at - release)
    with limit_to_one_thread():
        resolved_plan = resolve_touches(plan)
    plan_with_throw, warnings = _insert_in_plan(resolved_plan, throw, release, at, action)
    plan_with_throw, left_out = _insert_headings(plan_with_throw, throw, at - release, between)
    resolved = resolve_plan(plan_with_throw, library, are_touches_resolved=True)
    size = resolved.size
    skeleton = library.skeleton.scale(size)
    has_same_bones = throw.skeleton.has_same_bones(skeleton, 1e-5)
    throw_clip = throw if has_same_bones else Retargeter(throw, skeleton, keeps_travel=True).retarget(throw)
    throw_clip = Motion(library.skeleton, throw_clip.root_positions / size, throw_clip.rotations, throw_clip.fps)
    report = progress or (lambda done, text: None)
    library_with_throw = add_throw_clip(extend_library(library, resolved, report), throw_clip, release, action)
    with limit_to_one_thread():
        order = _build_search_request(library_with_throw, resolved)
        search = PathSearch(library_with_throw, order, balance_weights(plan.alpha), lambda done,
                            text: report(0.8 * done, text), cancelled)
        edit = search.run()
        report(0.8, "Constructing")
        construction = _build_construction(library_with_throw, resolved, order, edit,
                                           _build_heading_function(throw_clip, at - release, between))
        planted, _ = construction.construct_body()
    motion = Motion(skeleton, planted.root * size, planted.rotations, plan.fps)
    if not has_same_bones:
        motion = Retargeter(motion, throw.skeleton, example=throw, keeps_travel=True).retarget(motion)
    start, seams = float(resolved.track.times[0]), construction.source.transitions
    return RunUpResult(motion=motion, start=start, transitions=seams, warnings=(*warnings, *left_out, *order.warnings))


def _check_times(plan: Plan, throw: Motion, begin: float) -> None:
    """Raise InputError if the throw lies outside the track."""
    finish, times = begin + throw.duration, plan.track.times
    if begin < times[0] - 0.5 / plan.fps or finish > times[-1] + 0.5 / plan.fps:
        raise InputError(
            "throw", f"from {begin:.2f} to {finish:.2f} s", f"within the track, {times[0]:.2f} to {times[-1]:.2f} s",
            "choose another time or a longer track",
        )


def _build_search_request(library: Library, plan: ResolvedPlan) -> SearchRequest:
    """Build the search request; the generated clip is played at its own rate only."""
    order = build_request(library, plan)
    keys = tuple(replace(key, rates=(1.0,)) if OWN_LABEL in key.requested.words else key for key in order.keys)
    return replace(order, keys=keys)


def _build_construction(
    library: Library, plan: ResolvedPlan, order: SearchRequest, edit: EditList, heading_of: Callable
) -> Construction:
    """Build the construction of the motion that the search found."""
    track = plan.sample_track(plan.fps, rests=False)  # it is led through the throw to a centimetre
    index = output_index(len(track.times), library, plan.fps, len(edit))
    source = fetch_motion(library, edit, index, plan.fps)
    touches = find_touches(library, plan.fps, edit, build_key_results(library, plan.fps, order, edit, source))
    requested_heading = heading_of(track, source, len(library.clips) - 1)
    return Construction(
        library=library, plan=plan, track=track, source=source, touches=touches, heading=requested_heading,
        turns_to_ball=False,
    )


def _build_heading_function(throw: Motion, begin: float, between: Motion | None) -> Callable:
    """Build a function heading(track, source, clip) -> (T,) rad, NaN where the heading is free.

    The heading is that of the throw, which is that clip and begins at second `begin`, while it is played, and that
    of `between` at both ends.
    """
    def sample_heading(track: SampledTrack, source: SourceMotion, clip: int) -> np.ndarray:
        kept = np.full(len(track.times), np.nan)
        is_throw = source.clip == clip
        seconds = track.times[is_throw] - begin
        kept[is_throw] = np.interp(seconds, np.arange(len(throw)) / throw.fps, compute_heading(throw))
        if between is not None:
            faces, count = compute_heading(between), int(_END_SECONDS * track.fps)
            for end in (slice(None, count), slice(-count, None)):
                kept[end] = np.where(np.isnan(kept[end]), faces[end], kept[end])
        return kept

    return sample_heading


def add_throw_clip(library: Library, motion: Motion, release: float, action: str = "throw") -> Library:
    """Add a clip to a library, in memory only.

    Args:
        library: the library.
        motion: the throw on the library's skeleton.
        release: s from its first frame to its key moment.
        action: one of ACTIONS.
    """
    edge = int(EDGE * motion.fps)
    words = (*ACTIONS[action], OWN_LABEL)
    key = float(np.clip(release * motion.fps, edge, len(motion) - 1 - edge))
    row = ClipAnnotation(edge, len(motion) - 1 - edge, key, words)
    clip = Clip(path=_CLIP, mirrored=False, motion=motion, annotations=(row,),
                heel_toe_contacts=contacts.detect_heel_toe_contacts(motion))
    frames = joined_frames(library.frames, build_frames([clip], library.frames))
    return replace(library, clips=(*library.clips, clip), frames=frames, cache_location=None)


def _insert_in_plan(plan: Plan, throw: Motion, release: float, at: float, action: str) -> tuple[Plan, list[str]]:
    """Insert the throw into the track and timeline of a plan; also return warnings about what is left out."""
    begin = at - release
    timeline, warnings = _insert_in_timeline(plan.timeline, begin, begin + throw.duration, at, ACTIONS[action])
    if plan.pins:
        warnings.append("the plan's pinned clips are ignored, because the plan contains a throw")
    track = _lead_through(plan, throw, release, at)
    return replace(plan, track=track, timeline=timeline, pins=(), method="path"), warnings


def _insert_headings(plan: Plan, throw: Motion, begin: float, between: Motion | None) -> tuple[Plan, list[str]]:
    """Insert the throw's heading into a plan, and that of `between` at both ends; also return warnings.

    The body then turns to the throw before it begins: without the keys it would jump to the throw's heading.
    """
    keys = _build_heading_keys(throw, begin)
    if between is not None:
        count, start = int(_END_SECONDS * between.fps), float(plan.track.times[0])
        for first in (0, len(between) - count):
            end = _build_heading_keys(between.frames(first, first + count), start + first / between.fps)
            keys += [key for key in end if key.time < keys[0].time - _KEY_SECONDS or key.time > begin + throw.duration]
    own: list[HeadingKey] = []
    warnings: list[str] = []
    for key in plan.heading_keys:
        if key.is_within(begin, begin + throw.duration):
            warnings.append(TimedMessage(f"{format_seconds(key.time)} s: the given heading overlaps the throw and is "
                                         "left out", (key.time, key.time)))
        else:
            own.append(key)
    return replace(plan, heading_keys=(*own, *keys), heading_path=None), warnings


def _build_heading_keys(motion: Motion, start: float) -> list[HeadingKey]:
    """Build keys of a motion's own heading, one every _KEY_SECONDS, for a motion that begins at `start` s."""
    faces, times = np.unwrap(compute_heading(motion)), np.arange(len(motion)) / motion.fps
    at = np.append(np.arange(0.0, times[-1] - 0.5 * _KEY_SECONDS, _KEY_SECONDS), times[-1])
    return [HeadingKey(float(start + second), float(np.interp(second, times, faces))) for second in at]


def _insert_in_timeline(
    timeline: Timeline, begin: float, finish: float, at: float, words: tuple[str, ...]
) -> tuple[Timeline, list[str]]:
    """Insert the throw's key moment into a timeline, without key moments that overlap it; also return warnings."""
    kept = [key for key in timeline.keys if not begin < key.resolved_time < finish]
    warnings: list[str] = [
        TimedMessage(f"{format_seconds(key.time)} s: '{' '.join(key.words)}' overlaps the throw and is left out",
                     (key.time, key.time))
        for key in timeline.keys if key not in kept
    ]  # fmt: skip
    spans = [part for span in timeline.spans for part in _cut_span(span, begin, finish)]
    return Timeline(tuple(spans), (*kept, KeyMoment(at, (*words, OWN_LABEL)))), warnings


def _cut_span(span: Span, begin: float, finish: float) -> list[Span]:
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
    track = plan.sample_track(fps)
    own = resample(throw, fps)
    path = smooth_zero_phase_hann(own.root_positions[:, :2], fps, SMOOTHING_WINDOW)
    begin = at - release
    seconds = begin + np.arange(len(path)) / fps
    places, times = track.raw.copy(), track.times
    inside = (times >= seconds[0]) & (times <= seconds[-1])
    for axis in (0, 1):
        places[inside, axis] = np.interp(times[inside], seconds, path[:, axis])
    for side, edge in ((-1, 0), (1, -1)):
        there = float(seconds[edge]), path[edge], _measure_velocity(path, edge, fps)
        places = _insert_detour(places, times, track, there, side)
    ball = None if plan.track.ball is None else track.ball
    return Track(times, places, ball)


def _insert_detour(places: np.ndarray, times: np.ndarray, track: SampledTrack, there: tuple, side: int) -> np.ndarray:
    """Insert a path from the track to the throw (side -1) or back to the track (1) into the positions (T, 2) m."""
    edge = there[0]
    off = np.linalg.norm([np.interp(edge, times, track.positions[:, axis]) - there[1][axis] for axis in (0, 1)])
    seconds = float(np.clip(2.0 * off / _CATCH_UP, *_DETOUR_RANGE))
    far = float(np.clip(edge + side * seconds, times[0], times[-1]))
    if abs(far - edge) < 2.0 / track.fps:
        return places
    here = far, *(np.array([np.interp(far, times, column) for column in values.T])
                  for values in (track.positions, track.velocity))  # fmt: skip
    low, high = (here, there) if side < 0 else (there, here)
    between = (times > low[0]) & (times < high[0])
    out = places.copy()
    out[between] = interpolate_quintic(times[between], low, high)
    return out


def _measure_velocity(path: np.ndarray, edge: int, fps: float) -> np.ndarray:
    """Measure the velocity (2,) m/s of a path at its first (edge 0) or last frames."""
    few = path[:4] if edge == 0 else path[-4:]
    return (few[-1] - few[0]) / (len(few) - 1) * fps
