"""The recipe: from a library and a plan to a take.

    library = build("clips")
    track, report = clean(read_track_csv("player.csv"))
    take = synthesize(library, Plan(track=track, timeline=read_timeline("player.txt", 30.0)))

The plan is put into frames (`synthesis.wanted`), a search picks what is shown (`synthesis.path_search`, or
`synthesis.blocks` with `synthesis.locomotion`), the frames are fetched (`synthesis.footage`) and laid on the ground
(`lay_out`).
"""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .annotation import LOCOMOTION_WORDS, avoided_per_frame, spoken
from .annotation.ball_contact import takes_with_foot
from .errors import InputError, TimedLine, told_time
from .evaluation.give_way import give_way
from .evaluation.played import played_from_take
from .known_touches import in_force, untouched, with_course
from .lay_out import as_far, chained, faced, footed, leaning, met, on_track, smoothed, touches
from .library.chosen import with_chosen_gaits
from .library.library import Library
from .motion.motion import Motion, at_frames
from .motion.runs import runs
from .motion.track import SampledTrack, sample
from .own_size import in_library_size, in_own_size, size_of
from .plan import METHODS, Plan
from .polish.foot_plant import Planted
from .polish.pins import look_axis, pinned
from .polish.steps import Steps
from .polish.strike import Touch
from .synthesis.balance import balanced
from .synthesis.blocks import BlockSearch
from .synthesis.distance import exact_keys, straight_edit, warped_edit
from .synthesis.dragged import left_out
from .synthesis.edit_list import EditList
from .synthesis.footage import Footage, Shown, fetch
from .synthesis.locomotion import match_distance
from .synthesis.path_search import PathSearch
from .synthesis.used import Used
from .synthesis.wanted import Wanted, wanted
from .take import BallPath, KeyResult, PinResult, Take

NEAR_KEY = 1.5
"""Seconds around a key moment in which its own words may be shown, whoever avoids them."""

PIN_MISSED, GAZE_MISSED = 0.01, np.radians(5.0)
"""Metres, and radians of a gaze, by which a pin may be missed without being told."""

LOOKED_AT = 200
_looks: weakref.WeakKeyDictionary[Library, np.ndarray] = weakref.WeakKeyDictionary()

Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class Found:
    """What a search ends in: the edit list at the library's rate, (T,) metres travelled where the method decides it,
    and the frame from which on it was searched in a hurry, if it was."""

    edit: EditList
    travelled: np.ndarray | None = None
    hurried: int | None = None


def synthesize(
    library: Library,
    plan: Plan,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    hurry: Callable[[], bool] | None = None,
    used: tuple[Used, ...] = (),
) -> Take:
    """A player's motion for `plan` out of `library`.

    progress(fraction, text) is called now and then. Raises NotInLibrary for a key moment that no clip can serve (unless
    plan.nearest), InputError for an unknown method, Cancelled when `cancelled()` says so. When `hurry()` says so,
    method "path" keeps what it has found, searches the rest quickly, and the take's warnings tell from which second on;
    before anything is found, and by the other methods, that is Cancelled too. used: footage that another solution is to
    do without where it can (method "path"; the others differ by their seed). The same library, plan and numpy give the
    same bits: linear algebra is held to one thread, since more add up in another order.
    """
    if plan.method not in METHODS:
        raise InputError("--method", plan.method, f"one of {', '.join(METHODS)}")
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return _synthesize(library, plan, progress or (lambda fraction, text: None), cancelled, hurry, used)


def _synthesize(library: Library, asked: Plan, report: Progress, cancelled, hurry, used: tuple[Used, ...]) -> Take:
    begun = time.perf_counter()
    known = in_force(asked)
    solving = {} if known.solved is None else {"solve": time.perf_counter() - begun}
    plan = in_library_size(known, size_of(asked, library.skeleton))
    recordings, library = library, with_made_gaits(library, plan, report)
    begun = time.perf_counter()
    order = wanted(library, plan)
    found = _search(library, plan, order, lambda fraction, text: report(0.8 * fraction, text), cancelled, hurry, used)
    seconds = {"search": time.perf_counter() - begun}
    take, laid = _laid_out(library, plan, order, found, report)
    return finished(
        replace(take, seconds={**seconds, **laid, **solving}), asked, known, recordings, order, found.hurried
    )


def constructed(library: Library, known: Plan, edit: EditList, progress: Progress | None = None) -> Take:
    """The take of method "path" that shows `edit`: all that `synthesize` does behind its search.

    known: the plan with its key moments and its ball as they are in force (`known_touches.in_force`). edit: at the
    library's rate, from the track's first time on; its clips are those of `library`, which has made ones
    (`Library.extended`) where it shows them. What gave way is not told in its warnings: it may be a part of a longer
    take, of which `evaluation.evaluate` tells it. The same arguments and numpy give the same bits.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        plan = in_library_size(known, size_of(known, library.skeleton))
        order = wanted(library, plan)
        take, seconds = _laid_out(library, plan, order, Found(edit), progress or (lambda fraction, text: None))
        return finished(replace(take, seconds=seconds), known, known, library, order, None, judged=False)


def _laid_out(
    library: Library, plan: Plan, order: Wanted, found: Found, report: Progress
) -> tuple[Take, dict[str, float]]:
    """What was found, fetched and laid on the ground, in the library's size; and what that took, in seconds."""
    clock = [time.perf_counter()]
    report(0.8, "Constructing")
    track = order.track if plan.fps == library.fps else plan.sampled(plan.fps)
    edit = exact_keys(library, found.edit, order)
    index = np.minimum(np.arange(len(track.times)) * (library.fps / plan.fps), len(edit) - 1)
    footage = fetch(library, edit, index, plan.fps)
    keys = tuple(key_result(library, plan, order, edit, footage, number) for number in range(len(order.keys)))
    clock.append(time.perf_counter())
    report(0.9, "Polishing")
    strikes = touches(library, plan, edit, keys)
    planted, taken = _polished(library, plan, track, footage, found, index, strikes)
    if plan.method == "path":
        struck = met(library, plan, track, taken.standing, planted, strikes)
        planted = replace(planted, root=struck.root, rotations=struck.rotations)
        track = replace(track, ball=struck.ball)
    take = _take(library, plan, order, track, edit, footage, keys, planted, taken)
    clock.append(time.perf_counter())
    report(1.0, "Done")
    return take, dict(zip(("construct", "polish"), np.diff(clock).tolist()))


def with_made_gaits(library: Library, plan: Plan, report: Progress) -> Library:
    """The library that a plan is made from: with made clips, where recordings lack what its track asks for, and with
    the chosen gaits."""
    if plan.method == "path" and plan.made and _lacks(library, plan):
        report(0.0, "Making what the recordings lack")
        library = library.extended
    return with_chosen_gaits(library, dict(plan.gaits))


def _lacks(library: Library, plan: Plan) -> bool:
    """Whether the recordings lack speeds that the track asks for, or touches as fast as its key moments."""
    track = sample(plan.track, library.fps, plan.track_window)
    moments = np.array([key.in_force for key in plan.timeline.keys])
    takes = np.array([takes_with_foot(key.words) for key in plan.timeline.keys], bool)
    return library.lacks(track.speed, np.interp(moments, track.times, track.speed), takes)


def _search(
    library: Library, plan: Plan, order: Wanted, report: Progress, cancelled, hurry, used: tuple[Used, ...]
) -> Found:
    if plan.method == "path":
        search = PathSearch(library, order, balanced(plan.alpha), report, cancelled, hurry, used=used)
        return Found(search.run(), hurried=search.hurried)
    stops = [stop for stop in (cancelled, hurry) if stop]
    search = BlockSearch(library, order, plan.alpha, report, lambda: any(stop() for stop in stops))
    blocks = search.run()
    if plan.method == "blocks":
        return Found(straight_edit(search, blocks))
    return Found(*warped_edit(search, match_distance(search, blocks, plan.delta), plan.catch_up))


def _polished(
    library: Library, plan: Plan, track: SampledTrack, footage: Footage, found: Found, index, strikes: list[Touch]
) -> tuple[Planted, Steps]:
    """Seams smoothed, laid on the ground, and, by `path`, feet held where they stand or stepping where they would
    slide."""
    smooth = smoothed(library, plan, footage)
    if plan.method == "blocks":
        angle, ground = chained(library, footage, smooth, track)
    elif plan.method == "distance":
        travelled = np.interp(index, np.arange(len(found.travelled)), found.travelled)
        angle, ground = as_far(track, smooth, travelled)
    else:
        angle, ground = on_track(library, plan, track, smooth, strikes)
    pose = faced(smooth.pose, angle)
    root = np.concatenate([ground, smooth.height[:, None]], axis=1)
    if plan.method == "path":
        pose = leaning(library, plan, track, smooth, pose)
        return footed(library, plan, track, root, pose, footage.standing, strikes)
    none = np.zeros((len(root), 2))
    return Planted(root, pose, none, none), Steps.none(pose, footage.standing)


def _take(
    library: Library, plan: Plan, order: Wanted, track: SampledTrack, edit: EditList, footage: Footage,
    keys: tuple[KeyResult, ...], planted: Planted, taken: Steps,
) -> Take:
    clips = library.clips
    sources = sources_shown(library, footage)
    names = tuple(dict.fromkeys(sources))
    number = {name: i for i, name in enumerate(names)}
    ball = None
    if np.any(np.isfinite(track.ball[:, :2])):
        ball = BallPath(track.times, track.ball, track.ball_measured)
    return Take(
        motion=Motion(library.skeleton, planted.root, planted.rotations, plan.fps),
        start_time=float(track.times[0]),
        clips=names,
        clip=np.array([number[source] for source in sources]),
        clip_frame=footage.clip_frame,
        mirrored=np.array([clips[clip].mirrored for clip in footage.clip]),
        words=words_shown(library, footage),
        contacts=taken.contacts,
        seams=footage.seams,
        timeline=order.timeline,
        keys=keys,
        ball=ball,
        method=plan.method,
        seed=plan.seed,
        correction=planted.correction,
        ik_miss=planted.miss,
        stepped=taken.stepped,
        plan=plan,
        edit=edit,
    )


def sources_shown(library: Library, shown: Shown) -> tuple[str, ...]:
    """The files, below the library, that hold every shown frame: recordings, or what was made behind their end."""
    frames = zip(shown.clip, np.round(shown.clip_frame, 6))
    return tuple(library.clips[clip].source_at(frame) for clip, frame in frames)


def words_shown(library: Library, shown: Shown) -> tuple[tuple[str, ...], ...]:
    """The words that every shown frame's clip carries there."""
    frames = zip(shown.clip, np.round(shown.clip_frame, 6))
    return tuple(spoken(library.clips[clip].words_at(frame)) for clip, frame in frames)


def finished(
    take: Take, asked: Plan, plan: Plan, recordings: Library, order: Wanted, hurried: int | None,
    before: Take | None = None, judged: bool = True,
) -> Take:
    """A take out of the library's size in the player's, with its pins, its ball and its warnings. plan: `asked` as it
    is in force; before: the finished take that it is an edit of; judged: as `with_warnings` has it."""
    take = with_pins(in_own_size(take, size_of(asked, recordings.skeleton), asked, before), recordings)
    begun = time.perf_counter()
    take = with_course(take, plan)
    if plan.solved is not None:
        take = replace(take, seconds={**take.seconds, "ball": time.perf_counter() - begun})
    return with_warnings(take, recordings, order, hurried, untouched(take, plan), judged)


def with_pins(take: Take, recordings: Library) -> Take:
    """The take with hands, feet and gaze at the pins of its plan."""
    pins = take.plan.pins
    if not pins:
        return take
    found = pinned(take.motion, take.contacts, pins, take.start_time, look_of(recordings))
    motion = replace(take.motion, root_positions=found.root, rotations=found.rotations)
    results = tuple(PinResult(pin, miss) for pin, miss in zip(pins, found.miss))
    unpinned = take.motion, take.contacts
    return replace(take, motion=motion, contacts=found.contacts, pins=results, unpinned=unpinned)


def look_of(library: Library) -> np.ndarray:
    """(3,) which way heads look in their own frame, on the average of the library's locomotion."""
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
    take: Take, recordings: Library, order: Wanted, hurried: int | None, more: Sequence[str] = (), judged: bool = True
) -> Take:
    """The take with what has to be told about it. recordings: the library without made clips; hurried: frame at the
    library's rate from which on the search was cut short, or None; more: lines that are told too; judged: whether what
    gave way is told."""
    told = [*recordings.notes, *order.warnings, *more, *_crowded_out(order, take.edit)]
    if take.plan.method == "path":  # the others never choose what of a clip is left out
        told += left_out(recordings, order, take.edit)
    if hurried is not None:
        since = take.start_time + hurried / recordings.fps
        told.append(TimedLine(f"{since:.1f} s: from here on the search was cut short", (since, since)))
    told += [*_shown_all_the_same(take), *_pins_missed(take)]
    gave_way = _gave_way(recordings, take.plan, take) if judged else ()
    return replace(take, cut_short=hurried is not None, warnings=(*told, *gave_way))


def _crowded_out(order: Wanted, edit: EditList) -> list[str]:
    """One warning per key moment that clips could serve, but not so close to another one."""
    placed = {key.wanted for key in edit.keys}
    return [
        TimedLine(
            f"{told_time(key.asked.time)} s: no room for '{' '.join(key.asked.words)}' so close to another key moment, "
            "it is not played", (key.asked.time, key.asked.time),
        )  # fmt: skip
        for number, key in enumerate(order.keys)
        if key.choices and number not in placed
    ]


def _shown_all_the_same(take: Take) -> list[str]:
    """One warning per stretch and word that must not be, where no way without it was found; what key moments close by
    ask for is not told."""
    times = take.start_time + np.arange(len(take.words)) / take.motion.fps
    avoided = avoided_per_frame(take.plan.timeline, times)
    asked = [(key.asked.in_force, frozenset(key.asked.words)) for key in take.keys]
    told = []
    for word in sorted(frozenset().union(*avoided)):
        shows = np.array([word in avoid and word in words for avoid, words in zip(avoided, take.words)])
        for time, words in asked:
            shows &= (word not in words) | (np.abs(times - time) > NEAR_KEY)
        told += [
            TimedLine(
                f"{times[first]:.1f} s: '{word}' is shown for {(end - first) / take.motion.fps:.1f} s though it "
                "must not be; no way without it was found", (times[first], times[end - 1]),
            ) for first, end in runs(shows)
        ]  # fmt: skip
    return told


def _pins_missed(take: Take) -> list[str]:
    """One warning per pin that is missed by more than can be seen."""
    told = []
    for result in take.pins:
        pin, when = f"{told_time(result.pin.time)} s: the pin of {result.pin.part}", (result.pin.time, result.pin.end)
        if not np.isfinite(result.miss):
            told.append(f"{pin} lies outside the track, or the skeleton has no such part; it counts for nothing")
        elif result.pin.part == "gaze" and result.miss > GAZE_MISSED:
            beyond = np.degrees(result.miss)
            told.append(TimedLine(f"{pin} is {beyond:.0f} degrees beyond what the neck can turn", when))
        elif result.pin.part != "gaze" and result.miss > PIN_MISSED:
            told.append(TimedLine(f"{pin} is out of reach by {100.0 * result.miss:.0f} cm", when))
    return told


def key_result(library: Library, plan: Plan, order: Wanted, edit: EditList, played: Shown, number: int) -> KeyResult:
    """How key moment `number` came out: where its clip's key frame is played, or what stands in for it."""
    key = order.keys[number]
    at = key.frame * plan.fps / library.fps
    near = int(np.clip(round(at), 0, len(played.clip) - 1))
    clip, shown = int(played.clip[near]), float(played.clip_frame[near])
    placed = next((p for p in edit.keys if p.wanted == number and p.key.clip == clip), None)
    words = spoken(placed.key.words if placed else library.clips[clip].words_at(shown))
    if placed is not None:
        inside = np.flatnonzero(played.piece == played.piece[near])
        if len(inside) > 1 and np.all(np.diff(played.clip_frame[inside]) > 0):
            at = float(np.interp(placed.key.frame, played.clip_frame[inside], inside))
        shown = placed.key.frame
    source = library.clips[clip]
    instead = words if key.used_instead and not key.choices else key.used_instead
    return KeyResult(key.asked, at, source.path, shown, source.mirrored, words, instead)


def _gave_way(library: Library, plan: Plan, take: Take) -> list[str]:
    """What could not all hold, and when."""
    played = played_from_take(take)
    return give_way(
        played, track=plan.track, timeline=take.timeline, library=library, ik_miss=take.ik_miss, asked=plan.timeline
    )
