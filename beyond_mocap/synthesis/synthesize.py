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
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import LOCOMOTION_WORDS, avoided_per_frame
from ..base.errors import InputError, TimedLine, told_time
from ..base.time_series import runs
from ..library.library import Library
from ..motion.foot_plant import Planted
from ..motion.motion import Motion, at_frames
from ..motion.track.ball_path import BallPath
from .construct.construction import Construction, find_touches, key_results
from .construct.pins import look_axis, pinned
from .construct.steps import Steps
from .construct.thesis_methods import lay_out_blocks
from .known_touches import untouched, with_course
from .own_size import in_own_size
from .plan import METHODS, Plan, ResolvedPlan
from .provenance import provenance_fields
from .quality.give_way import give_way
from .quality.played import played_from_take
from .resolve_plan import resolve_plan
from .search.blocks import BlockSearch
from .search.distance import exact_keys, straight_edit, warped_edit
from .search.dragged import left_out
from .search.edit_list import EditList
from .search.footage import fetch, output_index
from .search.locomotion import match_distance
from .search.path_costs import balanced
from .search.path_search import PathSearch
from .search.preferences import Used
from .search.wanted import Wanted, build_order
from .search_library import search_library
from .take import PinResult, Take

NEAR_KEY = 1.5
"""Seconds around a key moment in which its own labels may be shown although they are avoided."""

PIN_MISSED, GAZE_MISSED = 0.01, np.radians(5.0)
"""Metres, and radians of a gaze, by which a pin may be missed without a warning."""

LOOKED_AT = 200  # poses from which the look axis is estimated
_looks: weakref.WeakKeyDictionary[Library, np.ndarray] = weakref.WeakKeyDictionary()

Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class Found:
    """The result of a search.

    Attributes:
        edit: the edit list, at the library's rate.
        travelled: (T,) m travelled where the method decides it, else None.
        hurried_from: frame from which on it was searched in a hurry, None if it was not.
    """

    edit: EditList
    travelled: np.ndarray | None = None
    hurried: int | None = None

    def travelled_at(self, index: np.ndarray) -> np.ndarray | None:
        """Interpolate the distance (N,) m travelled at fractional frames `index` (N,) of the edit list."""
        return None if self.travelled is None else np.interp(index, np.arange(len(self.travelled)), self.travelled)


def synthesize(
    library: Library,
    plan: Plan,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    hurry: Callable[[], bool] | None = None,
    used: tuple[Used, ...] = (),
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
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        asking = {"cancelled": cancelled, "hurry": hurry, "used": used, "narrow": narrow}
        return _synthesize(library, plan, progress or (lambda fraction, text: None), **asking)


def _synthesize(library: Library, asked: Plan, report: Progress, **asking) -> Take:
    """Resolve, search and construct, with the seconds of each stage."""
    begun = time.perf_counter()
    plan = resolve_plan(asked, library)
    solving = {} if plan.course is None else {"solve": time.perf_counter() - begun}
    recordings, library = library, search_library(library, plan, report)
    begun = time.perf_counter()
    order = build_order(library, plan)
    found = _search(library, plan, order, lambda fraction, text: report(0.8 * fraction, text), **asking)
    seconds = {"search": time.perf_counter() - begun}
    take, laid = _laid_out(library, plan, order, found, report)
    take = replace(take, seconds={**seconds, **laid, **solving})
    return finished(take, plan, recordings, order, hurried=found.hurried)


def constructed(library: Library, plan: ResolvedPlan, edit: EditList, progress: Progress | None = None) -> Take:
    """Construct the take of method "path" that shows an edit list: all that `synthesize` does after its search.

    Unmet constraints are not in its warnings: it may be a part of a longer take, for which `evaluation.report.evaluate`
    reports them. The same arguments and numpy give the same bits.

    Args:
        library: the clips, with synthetic ones (`Library.with_synthetic_clips`) where the edit list shows them.
        plan: the resolved plan.
        edit: at the library's rate, from the track's first time on.
        progress: called as progress(fraction, text).
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        order = build_order(library, plan)
        take, seconds = _laid_out(library, plan, order, Found(edit), progress or (lambda fraction, text: None))
        return finished(replace(take, seconds=seconds), plan, library, order, judged=False)


def _laid_out(
    library: Library, plan: ResolvedPlan, order: Wanted, found: Found, report: Progress
) -> tuple[Take, dict[str, float]]:
    """Fetch what was found and construct the motion, in the library's size; also return the seconds of each stage."""
    clock = [time.perf_counter()]
    report(0.8, "Constructing")
    track = order.track if plan.fps == library.fps else plan.sampled(plan.fps)
    edit = exact_keys(library, found.edit, order)
    index = output_index(len(track.times), library, plan.fps, len(edit))
    source = fetch(library, edit, index, plan.fps)
    keys = key_results(library, plan.fps, order, edit, source)
    clock.append(time.perf_counter())
    report(0.9, "Polishing")
    touches = find_touches(library, plan.fps, edit, keys)
    construction = Construction(library=library, plan=plan, track=track, source=source, touches=touches)
    planted, taken, ball = _body(construction, found.travelled_at(index))
    motion = Motion(library.skeleton, planted.root, planted.rotations, plan.fps)
    take = Take(
        **provenance_fields(library, source), motion=motion, start_time=float(track.times[0]), contacts=taken.contacts,
        timeline=order.timeline, keys=keys, ball=ball, method=plan.method, seed=plan.asked.seed,
        correction=planted.correction, ik_miss=planted.miss, stepped=taken.stepped, plan=plan.asked, edit=edit,
    )
    clock.append(time.perf_counter())
    report(1.0, "Done")
    return take, dict(zip(("construct", "polish"), np.diff(clock).tolist()))


def _search(
    library: Library, plan: ResolvedPlan, order: Wanted, report: Progress, *, cancelled, hurry, used, narrow
) -> Found:
    """Run the search of the plan's method."""
    if plan.method == "path":
        more = {"hurry": hurry, "used": used, "narrow": narrow}
        search = PathSearch(library, order, balanced(plan.asked.alpha), report, cancelled, **more)
        return Found(search.run(), hurried=search.hurried)
    stops = [stop for stop in (cancelled, hurry) if stop]
    search = BlockSearch(library, order, plan.asked.alpha, report, lambda: any(stop() for stop in stops))
    blocks = search.run()
    if plan.method == "blocks":
        return Found(straight_edit(search, blocks))
    return Found(*warped_edit(search, match_distance(search, blocks, plan.asked.delta), plan.asked.catch_up))


def _body(construction: Construction, travelled: np.ndarray | None) -> tuple[Planted, Steps, BallPath | None]:
    """Construct the body, its steps and the ball; travelled: (T,) m by method "distance"."""
    track, ball = construction.track, construction.track.ball
    if construction.plan.method == "path":
        planted, taken = construction.lay_out()
        planted, ball = construction.meet_ball(planted, taken)
    else:
        planted, taken = lay_out_blocks(construction, travelled)
    known = np.any(np.isfinite(ball[:, :2]))
    return planted, taken, BallPath(track.times, ball, track.ball_measured) if known else None


def finished(
    take: Take, plan: ResolvedPlan, recordings: Library, order: Wanted, *, hurried: int | None = None,
    before: Take | None = None, judged: bool = True,
) -> Take:
    """Finish a take: scale it to the player's size, apply pins and the ball's trajectory, and add its warnings.

    Args:
        take: in the library's size.
        plan: the resolved plan.
        recordings: the library without synthetic clips.
        request: the request.
        hurried_from: frame at the library's rate from which on the search was cut short, None if it was not.
        before: the finished take that it is an edit of.
        report_unmet: whether unmet constraints are reported.
    """
    take = with_pins(in_own_size(take, plan.size, plan.asked, before), recordings)
    begun = time.perf_counter()
    take = with_course(take, plan)
    if plan.course is not None:
        take = replace(take, seconds={**take.seconds, "ball": time.perf_counter() - begun})
    return with_warnings(take, recordings, order, hurried, more=untouched(take, plan), judged=judged)


def with_pins(take: Take, recordings: Library) -> Take:
    """Bring the hands, feet and gaze of a take to the pins of its plan."""
    pins = take.plan.pins
    if not pins:
        return take
    found = pinned(take.motion, take.contacts, pins, take.start_time, look_of(recordings))
    motion = replace(take.motion, root_positions=found.root, rotations=found.rotations)
    results = tuple(PinResult(pin, miss) for pin, miss in zip(pins, found.miss))
    unpinned = take.motion, take.contacts
    return replace(take, motion=motion, contacts=found.contacts, pins=results, unpinned=unpinned)


def look_of(library: Library) -> np.ndarray:
    """Estimate the direction (3,) in which heads look, in their own frame, over the library's locomotion; cached."""
    if library not in _looks:
        frames = library.frames
        gaits = [i for i, word in enumerate(frames.vocabulary) if word in LOCOMOTION_WORDS]
        going = np.flatnonzero(frames.words[:, gaits].any(axis=1) & (frames.velocity[:, 0] > 0.0))
        some = going[:: max(1, len(going) // LOOKED_AT)] if len(going) else np.arange(min(len(frames), LOOKED_AT))
        pairs = zip(frames.clip[some], frames.source[some])
        poses = [at_frames(library.clips[clip].motion, np.array([frame]))[1] for clip, frame in pairs]
        _looks[library] = look_axis(library.skeleton, np.concatenate(poses))
    return _looks[library]


def with_warnings(
    take: Take, recordings: Library, order: Wanted, hurried: int | None, *, more: Sequence[str] = (),
    judged: bool = True,
) -> Take:
    """Add its warnings to a take.

    Args:
        take: the take.
        recordings: the library without synthetic clips.
        request: the request.
        hurried_from: frame at the library's rate from which on the search was cut short, or None.
        more: further lines.
        report_unmet: whether unmet constraints are reported.
    """
    told = [*recordings.notes, *order.warnings, *more, *_crowded_out(order, take.edit)]
    if take.plan.method == "path":  # the other methods leave out no part of a clip
        told += left_out(recordings, order, take.edit)
    if hurried is not None:
        since = take.start_time + hurried / recordings.fps
        told.append(TimedLine(f"{since:.1f} s: the search was cut short from here on", (since, since)))
    told += [*_shown_all_the_same(take), *_pins_missed(take)]
    gave_way = _gave_way(recordings, take.plan, take) if judged else ()
    return replace(take, cut_short=hurried is not None, warnings=(*told, *gave_way))


def _crowded_out(order: Wanted, edit: EditList) -> list[str]:
    """Report each key moment that clips could serve, but not so close to another one."""
    placed = {key.wanted for key in edit.keys}
    return [
        TimedLine(
            f"{told_time(key.asked.time)} s: '{' '.join(key.asked.words)}' is too close to another key moment and is "
            "not played", (key.asked.time, key.asked.time),
        )  # fmt: skip
        for number, key in enumerate(order.keys)
        if key.choices and number not in placed
    ]


def _shown_all_the_same(take: Take) -> list[TimedLine]:
    """Report each stretch with an avoided label; labels that key moments close by request do not count."""
    times = take.start_time + np.arange(len(take.words)) / take.motion.fps
    avoided = avoided_per_frame(take.plan.timeline, times)
    asked = [(key.asked.in_force, frozenset(key.asked.words)) for key in take.keys]
    told = []
    for word in sorted(frozenset().union(*avoided)):
        shows = np.array([word in avoid and word in words for avoid, words in zip(avoided, take.words)])
        for moment, words in asked:
            shows &= (word not in words) | (np.abs(times - moment) > NEAR_KEY)
        told += [
            TimedLine(
                f"{times[first]:.1f} s: the avoided label '{word}' is shown for "
                f"{(end - first) / take.motion.fps:.1f} s: the search found nothing without it",
                (times[first], times[end - 1]),
            ) for first, end in runs(shows)
        ]  # fmt: skip
    return told


def _pins_missed(take: Take) -> list[str]:
    """Report each pin that is missed visibly."""
    told = []
    for result in take.pins:
        pin, when = f"{told_time(result.pin.time)} s: the pin of {result.pin.part}", (result.pin.time, result.pin.end)
        if not np.isfinite(result.miss):
            told.append(f"{pin} is outside the track, or the skeleton has no such part; it is ignored")
        elif result.pin.part == "gaze" and result.miss > GAZE_MISSED:
            beyond = np.degrees(result.miss)
            told.append(TimedLine(f"{pin} is {beyond:.0f} degrees beyond what the neck can turn", when))
        elif result.pin.part != "gaze" and result.miss > PIN_MISSED:
            told.append(TimedLine(f"{pin} is out of reach by {100.0 * result.miss:.0f} cm", when))
    return told


def _gave_way(library: Library, plan: Plan, take: Take) -> list[TimedLine]:
    """Report what could not be met, and when."""
    played = played_from_take(take)
    return give_way(
        played, track=plan.track, timeline=take.timeline, library=library, ik_miss=take.ik_miss, asked=plan.timeline
    )
