"""Synthesize: from a library and a plan to a take.

    library = build("clips")
    track, report = clean(read_track_csv("player.csv"))
    take = synthesize(library, Plan(track=track, timeline=read_timeline("player.txt", 30.0)))

The plan is put into frames (`synthesis.search.request`), a search chooses what is shown
(`synthesis.search.path_search`, or `synthesis.search.blocks` with `synthesis.search.locomotion`), the frames are
fetched (`synthesis.search.source_frames`) and placed on the track (`synthesis.construct`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import avoided_labels_per_frame
from ..base.errors import InputError, TimedMessage, UserCancelledError, format_count, format_seconds
from ..base.settings import find_setting
from ..base.time_series import find_runs
from ..library.library import Library
from ..motion.foot_plant import PlantResult
from ..motion.motion import Motion
from .ball_pins import KEY_REACH, SAME_TOUCH, find_pinned_frame
from .body_size import to_player_size
from .construct.ball_touch.carry_ball import build_ball_path, report_recorded_ball
from .construct.ball_touch.touch_frames import find_nearest_frame
from .construct.construction import Construction, build_key_results, find_touches
from .construct.extra_steps import Steps
from .construct.gaze import estimate_look
from .construct.pins import apply_pins
from .construct.thesis_methods import construct_blocks
from .contact_edit import FEET
from .known_body import name_known_frames
from .one_thread import limit_to_one_thread
from .pin import BALL, Pin
from .plan import METHODS, Plan, ResolvedPlan
from .provenance import build_provenance_fields
from .quality.playback import playback_from_take
from .quality.unmet_constraints import report_unmet_constraints
from .resolve_plan import resolve_plan
from .resolved_touches import apply_trajectory, report_missing_touches
from .search.block_costs import rescale_alpha
from .search.blocks import BlockSearch
from .search.cost_weights import balance_weights
from .search.distance import align_keys, build_straight_edit, build_warped_edit
from .search.edit_list import EditList
from .search.foot_drag import report_left_out
from .search.gait_loops import build_gait_loops
from .search.locomotion import compute_travelled_distance, match_distance
from .search.path_search import PathSearch
from .search.preferences import UsedStretch
from .search.request import SearchRequest, build_request
from .search.source_frames import fetch_motion, output_index
from .search_library import extend_library
from .take import PinResult, Take

KEY_MARGIN = 1.5
"""Seconds around a key moment in which its own labels may be shown although they are avoided."""

PIN_TOLERANCE, GAZE_TOLERANCE = 0.01, np.radians(5.0)
"""Metres, and radians of a gaze, by which a pin may be missed without a warning."""

_NO_EFFECT = ("is outside the track, or the skeleton has no such part",
              f"has no key moment with the ball within {KEY_REACH:g} s, or the track has no ball")

CONTACT_REACH = 0.2
"""Seconds beside a contact edit within which its foot has to be in contact."""


Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The result of a search.

    Attributes:
        edit: the edit list, at the library's rate.
        travelled: (T,) m travelled where the method decides it, else None.
        hurried_from: frame from which on it was searched in a hurry, None if it was not.
        notes: what was left out of the search, one line each.
    """

    edit: EditList
    travelled: np.ndarray | None = None
    hurried_from: int | None = None
    notes: Sequence[str] = ()

    def interpolate_travelled(self, index: np.ndarray) -> np.ndarray | None:
        """Interpolate the distance (N,) m travelled at fractional frames `index` (N,) of the edit list."""
        return None if self.travelled is None else np.interp(index, np.arange(len(self.travelled)), self.travelled)


def synthesize(
    library: Library,
    plan: Plan,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    hurry: Callable[[], bool] | None = None,
    used: tuple[UsedStretch, ...] = (),
    narrow: bool = False,
) -> Take:
    """Synthesize a player's motion.

    The same library, plan and numpy give the same bits: linear algebra is held to one thread, since more threads add up
    in another order.

    Args:
        library: the recordings.
        plan: the request.
        progress: called as progress(fraction, text).
        cancelled: returns whether to stop.
        hurry: returns whether to finish early: method "path" then keeps what it has found, searches the rest
            quickly, and the take's warnings say from which second on; before anything is found, and by the other
            methods, this cancels.
        used: source frames that another solution avoids where it can (method "path"; the others differ by their seed).
        narrow: whether method "path" searches quickly from the start.
    Raises:
        NotInLibraryError: for a key moment that no clip can serve (unless plan.nearest).
        InputError: for an unknown method.
        UserCancelledError: when `cancelled` returns true.
    """
    if plan.method not in METHODS:
        raise InputError("method", plan.method, f"one of {', '.join(METHODS)}")
    with limit_to_one_thread():
        options = {"cancelled": cancelled, "hurry": hurry, "used": used, "narrow": narrow}
        return _synthesize_plan(library, plan, progress or (lambda fraction, text: None), **options)


def _synthesize_plan(library: Library, requested: Plan, report: Progress, **options) -> Take:
    """Resolve, search and construct, with the seconds of each stage."""
    started = time.perf_counter()
    plan = resolve_plan(requested, library)
    solving = {} if plan.trajectory is None else {"solve": time.perf_counter() - started}
    recordings, library = library, extend_library(library, plan, report)
    started = time.perf_counter()
    request = build_request(library, plan)
    found = _search(library, plan, request, lambda fraction, text: report(0.8 * fraction, text), **options)
    seconds = {"search": time.perf_counter() - started}
    take, construct_seconds = _construct_motion(library, plan, request, found, report)
    take = replace(take, seconds={**seconds, **construct_seconds, **solving})
    return finish_take(take, plan, recordings, request, hurried_from=found.hurried_from, notes=found.notes)


def construct_take(library: Library, plan: ResolvedPlan, edit: EditList) -> Take:
    """Construct the take of method "path" that shows an edit list: all that `synthesize` does after its search.

    Unmet constraints are not in its warnings: it may be a part of a longer take, for which `evaluation.report.evaluate`
    reports them. The same arguments and numpy give the same bits.

    Args:
        library: the clips, with synthetic ones (`Library.with_synthetic_clips`) where the edit list shows them.
        plan: the resolved plan.
        edit: at the library's rate, from the track's first time on.
    """
    with limit_to_one_thread():
        request = build_request(library, plan, has_costs=False)
        take, seconds = _construct_motion(library, plan, request, SearchResult(edit), lambda fraction, text: None)
        return finish_take(replace(take, seconds=seconds), plan, library, request, report_unmet=False)


def _construct_motion(
    library: Library, plan: ResolvedPlan, request: SearchRequest, result: SearchResult, report: Progress
) -> tuple[Take, dict[str, float]]:
    """Fetch what was found and construct the motion, in the library's size; also return the seconds of each stage."""
    clock = [time.perf_counter()]
    report(0.8, "Constructing")
    track = request.track if plan.fps == library.fps else plan.sample_track(plan.fps)
    edit = align_keys(library, result.edit, request)
    index = output_index(len(track.times), library, plan.fps, len(edit))
    source = fetch_motion(library, edit, index, plan.fps)
    keys = build_key_results(library, plan.fps, request, edit, source)
    clock.append(time.perf_counter())
    report(0.9, "Correcting feet")
    touches = find_touches(library, plan.fps, edit, keys)
    construction = Construction(library=library, plan=plan, track=track, source=source, touches=touches)
    planted, steps, ball = _construct_body(construction, result.interpolate_travelled(index))
    motion = Motion(library.skeleton, planted.root, planted.rotations, plan.fps)
    ball = build_ball_path(library, plan.requested, track, source=source, motion=motion, ball=ball)
    take = Take(
        **name_known_frames(build_provenance_fields(library, source), plan.requested.bodies, track.times),
        motion=motion, start_time=float(track.times[0]),
        contacts=steps.contacts, timeline=request.timeline, keys=keys, ball=ball, method=plan.method,
        seed=plan.requested.seed, correction=planted.correction, ik_miss=planted.miss, stepped=steps.stepped,
        plan=plan.requested, edit=edit, planned_heading=track.heading,
        heading_path=plan.heading_path if plan.method == "path" else None,
    )
    clock.append(time.perf_counter())
    report(1.0, "Done")
    return take, dict(zip(("construct", "polish"), np.diff(clock).tolist()))


def _search(
    library: Library, plan: ResolvedPlan, request: SearchRequest, report: Progress, *, cancelled, hurry, used, narrow
) -> SearchResult:
    """Run the search of the plan's method."""
    if plan.method == "path":
        more = {"hurry": hurry, "used": used, "narrow": narrow}
        search = PathSearch(library, request, balance_weights(plan.requested.alpha), report, cancelled, **more)
        return SearchResult(search.run(), hurried_from=search.hurried_from)
    stops = [stop for stop in (cancelled, hurry) if stop]
    if plan.method == "baseline":
        if cancelled is not None and cancelled():
            raise UserCancelledError("synthesis: cancelled")
        return SearchResult(build_gait_loops(library, request))
    alpha = rescale_alpha(plan.requested.alpha)
    search = BlockSearch(library, request, alpha, report, lambda: any(stop() for stop in stops))
    blocks = search.run()
    if plan.method != "distance":
        return SearchResult(build_straight_edit(search, blocks), notes=search.notes)
    sections = match_distance(search, blocks, plan.requested.delta)
    return SearchResult(*build_warped_edit(search, sections, plan.requested.catch_up), notes=search.notes)


def _construct_body(construction: Construction, travelled: np.ndarray | None) -> tuple[PlantResult, Steps, np.ndarray]:
    """Construct the body, its steps and the track's ball; travelled: (T,) m by method "distance"."""
    track, ball = construction.track, construction.track.ball
    if construction.plan.method == "path":
        planted, steps = construction.construct_body()
        planted, ball = construction.solve_ball_contact(planted, steps)
    else:
        is_on_track = construction.plan.method in ("fs", "baseline")
        planted, steps = construct_blocks(construction, compute_travelled_distance(track) if is_on_track else travelled)
    return planted, steps, ball


def finish_take(
    take: Take, plan: ResolvedPlan, recordings: Library, request: SearchRequest, *, hurried_from: int | None = None,
    before: Take | None = None, report_unmet: bool = True, notes: Sequence[str] = (),
) -> Take:
    """Finish a take: scale it to the player's size, apply pins and the ball's trajectory, and add its warnings.

    Args:
        take: in the library's size.
        plan: the resolved plan.
        recordings: the library without synthetic clips.
        request: the request.
        hurried_from: frame at the library's rate from which on the search was cut short, None if it was not.
        before: the finished take that it is an edit of.
        report_unmet: whether unmet constraints and the time of recorded balls are reported, as of a whole take.
        notes: what was left out of the search, one line each.
    """
    take = add_pins(to_player_size(take, plan.size, plan.requested, before), recordings)
    started = time.perf_counter()
    take, detours = apply_trajectory(take, plan)
    if plan.trajectory is not None:
        take = replace(take, seconds={**take.seconds, "ball": time.perf_counter() - started})
    take = measure_ball_pins(take, plan)
    return add_warnings(take, recordings, request, hurried_from, report_unmet=report_unmet,
                        more=[*notes, *report_missing_touches(take, plan), *detours])


def add_pins(take: Take, recordings: Library) -> Take:
    """Bring the hands, feet and gaze of a take to the pins of its plan."""
    pins = [pin for pin in take.plan.pins if pin.part != BALL]
    if not pins:
        return take
    found = apply_pins(take.motion, take.contacts, pins, take.start_time, estimate_look(recordings))
    motion = replace(take.motion, root_positions=found.root, rotations=found.rotations)
    results = tuple(PinResult(pin, miss) for pin, miss in zip(pins, found.miss))
    unpinned = take.motion, take.contacts
    return replace(take, motion=motion, contacts=found.contacts, pins=results, unpinned=unpinned)


def measure_ball_pins(take: Take, plan: ResolvedPlan) -> Take:
    """Measure how far the ball of a take is from its pins, each at the frame at which its key moment is played."""
    results = [PinResult(pin, _measure_ball_miss(take, plan.ball_pins.get(pin))) for pin in take.plan.pins
               if pin.part == BALL]
    return replace(take, pins=(*take.pins, *results)) if results else take


def _measure_ball_miss(take: Take, pin: Pin | None) -> float:
    """Measure how far, m, the ball is from a pin when its key moment is played; infinite for a pin without effect."""
    frame = None if pin is None or take.ball is None else find_pinned_frame(take.ball.times, pin)
    if pin is None or take.ball is None or frame is None:
        return np.inf
    played = [find_nearest_frame(key.frame, len(take.motion)) for key in take.keys
              if abs(key.requested.resolved_time - pin.time) <= SAME_TOUCH]
    return float(np.linalg.norm(take.ball.positions[min(played, default=frame)] - pin.position))


def add_warnings(
    take: Take, recordings: Library, request: SearchRequest, hurried_from: int | None, *, more: Sequence[str] = (),
    report_unmet: bool = True,
) -> Take:
    """Add its warnings to a take.

    Args:
        take: the take.
        recordings: the library without synthetic clips.
        request: the request.
        hurried_from: frame at the library's rate from which on the search was cut short, or None.
        more: further lines.
        report_unmet: as for `finish_take`.
    """
    messages = [*recordings.notes, *recordings.proposal_notes, *request.warnings, *more]
    messages += _report_crowded_keys(request, take.edit)
    if take.plan.method == "path":  # the other methods leave out no part of a clip
        messages += report_left_out(recordings, request, take.edit)
    if hurried_from is not None:
        since = take.start_time + hurried_from / recordings.fps
        messages.append(TimedMessage(f"{since:.1f} s: the search was cut short from here on", (since, since)))
    messages += [*_report_avoided_labels(take), *_report_missed_pins(take), *_report_ignored_heading_keys(take.plan),
                 *_report_ignored_contact_edits(take)]
    unmet: Sequence[str] = ()
    if report_unmet:
        unmet = (*report_recorded_ball(take.plan, take.ball, take.seams.tolist()),
                 *report_unmet_requests(recordings, take))
    return replace(take, is_cut_short=hurried_from is not None, warnings=(*messages, *unmet))


def _report_crowded_keys(request: SearchRequest, edit: EditList) -> list[str]:
    """Report each key moment that clips could serve, but not so close to another one."""
    placed = {key.number for key in edit.keys}
    return [
        TimedMessage(
            f"{format_seconds(key.requested.time)} s: '{' '.join(key.requested.words)}' is too close to another key "
            "moment and is not played", (key.requested.time, key.requested.time),
        )  # fmt: skip
        for number, key in enumerate(request.keys)
        if key.choices and number not in placed
    ]


def _report_avoided_labels(take: Take) -> list[TimedMessage]:
    """Report each stretch with an avoided label; labels that key moments close by request do not count."""
    times = take.start_time + np.arange(len(take.words)) / take.motion.fps
    avoided = avoided_labels_per_frame(take.plan.timeline, times)
    key_labels = [(key.requested.resolved_time, frozenset(key.requested.words)) for key in take.keys]
    messages = []
    for word in sorted(frozenset().union(*avoided)):
        shows = np.array([word in avoid and word in words for avoid, words in zip(avoided, take.words)])
        for moment, words in key_labels:
            shows &= (word not in words) | (np.abs(times - moment) > KEY_MARGIN)
        messages += [
            TimedMessage(
                f"{times[first]:.1f} s: the avoided label '{word}' is shown for "
                f"{(end - first) / take.motion.fps:.1f} s: the search found nothing without it",
                (times[first], times[end - 1]),
            ) for first, end in find_runs(shows)
        ]  # fmt: skip
    return messages


def _report_missed_pins(take: Take) -> list[str]:
    """Report each pin that is missed visibly."""
    messages = []
    for result in take.pins:
        pin, when = f"{format_seconds(result.pin.time)} s: the pin of {result.pin.part}", (result.pin.time,
                result.pin.end)
        if not np.isfinite(result.miss):
            messages.append(f"{pin} {_NO_EFFECT[result.pin.part == BALL]}; it is ignored")
        elif result.pin.part == "gaze" and result.miss > GAZE_TOLERANCE:
            beyond = np.degrees(result.miss)
            messages.append(TimedMessage(f"{pin} is {beyond:.0f} degrees beyond what the neck can turn", when))
        elif result.pin.part == BALL and result.miss > PIN_TOLERANCE:
            text = f"is missed by {100.0 * result.miss:.0f} cm: the ball goes round the body"
            messages.append(TimedMessage(f"{pin} {text}", when))
        elif result.pin.part not in ("gaze", BALL) and result.miss > PIN_TOLERANCE:
            messages.append(TimedMessage(f"{pin} is out of reach by {100.0 * result.miss:.0f} cm", when))
    return messages


def _report_ignored_contact_edits(take: Take) -> list[TimedMessage]:
    """Report the contact edits that found no contact of their foot, or no room for a new one."""
    messages, times = [], take.start_time + np.arange(len(take.contacts)) / take.motion.fps
    for edit in take.plan.contact_edits:
        stands = times[take.contacts[:, FEET.index(edit.foot)]]
        low, high = edit.time + min(edit.start, 0.0) - CONTACT_REACH, edit.time + max(edit.end, 0.0) + CONTACT_REACH
        is_outside = not times[0] <= edit.time <= times[-1]
        if is_outside or edit.kind != "delete" and not np.any((stands >= low) & (stands <= high)):
            text = f"{format_seconds(edit.time)} s: the edited contact of the {edit.foot} foot is missing, the edit has"
            messages.append(TimedMessage(f"{text} no effect", (edit.time, edit.time)))
    return messages


def _report_ignored_heading_keys(plan: Plan) -> list[str]:
    """Report the heading keys before the start and after the end of the track, one line for each of the two; all of
    them where the method plans no heading.
    """
    if plan.heading_keys and plan.method != "path":
        count = format_count(len(plan.heading_keys), "heading key")
        titles = {name: title for name, title, _ in find_setting("synthesis", "method").choices}
        return [f"{count}: the method {titles[plan.method]} plans no heading; ignored; choose {titles['path']}"]
    start, end = plan.track.times[0], plan.track.times[-1]
    messages = []
    for keys in ([key for key in plan.heading_keys if key.end < start],
                 [key for key in plan.heading_keys if key.time > end]):
        if keys:
            when, last = format_seconds(keys[0].time), format_seconds(keys[-1].time)
            name = f"heading key at {when} s" if len(keys) == 1 else f"{len(keys)} heading keys at {when} to {last} s"
            messages.append(f"{name}: outside the track's {format_seconds(start)} to {format_seconds(end)} s; ignored")
    return messages


def report_unmet_requests(library: Library, take: Take) -> list[TimedMessage]:
    """Report what could not be met in a take from a library, and when."""
    played, plan = playback_from_take(take), take.plan
    return report_unmet_constraints(
        played, track=plan.track, timeline=take.timeline, library=library, ik_miss=take.ik_miss,
        user_timeline=plan.timeline, has_actions=plan.method == "path" and plan.made,
    )
