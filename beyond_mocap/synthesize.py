"""The recipe: from a library and a plan to a take.

    library = build("clips")
    track, report = clean(read_track_csv("player.csv"))
    take = synthesize(library, Plan(track=track, timeline=read_timeline("player.txt", 30.0)))

The plan is put into frames (`synthesis.wanted`), a search picks what is shown (`synthesis.path_search`, or
`synthesis.blocks` with `synthesis.locomotion`), the frames are fetched (`synthesis.footage`), seams are smoothed
(`polish.cross_fade`, or `polish.smoothing` by Faustino's methods) and the motion is laid on the ground (`polish.on_track`,
or `polish.joining` without a track).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .annotation import spoken
from .errors import InputError
from .evaluation.give_way import give_way
from .evaluation.played import played_from_take
from .library.chosen import with_chosen_gaits
from .library.library import Library
from .motion import quaternion
from .motion.humanoid import identify
from .motion.motion import Motion, pose_kinematics
from .motion.track import SampledTrack, sample
from .plan import METHODS, Plan
from .polish.banking import banked, missing_lean
from .polish.cross_fade import faded_rotations, faded_values, share
from .polish.foot_plant import Planted, plant
from .polish.give import give
from .polish.joining import chained_facing, chained_root, torso_corrections
from .polish.face_ball import turned_to_ball
from .polish.on_track import facing, firmness, pulled_to_track, root_with_sway
from .polish.smoothing import spread_rotations, spread_values
from .polish.steps import Steps, steps
from .polish.strike import Struck, Touch, strike
from .synthesis.balance import balanced
from .synthesis.blocks import BlockSearch
from .synthesis.distance import exact_keys, straight_edit, warped_edit
from .synthesis.edit_list import EditList
from .synthesis.gaze import wanted_offset
from .synthesis.footage import Footage, Shown, fetch, overlap
from .synthesis.locomotion import match_distance, travelled_distance
from .synthesis.path_search import PathSearch
from .synthesis.wanted import Wanted, needed, wanted
from .take import BallPath, KeyResult, Take

Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class Found:
    """What a search ends in: the edit list at the library's rate, (T,) metres travelled where the method decides it, and the
    frame from which on it was searched in a hurry, if it was."""

    edit: EditList
    travelled: np.ndarray | None = None
    hurried: int | None = None


def synthesize(
    library: Library,
    plan: Plan,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    hurry: Callable[[], bool] | None = None,
) -> Take:
    """A player's motion for `plan` out of `library`.

    progress(fraction, text) is called now and then. Raises NotInLibrary for a key moment that no clip can serve (unless
    plan.nearest), InputError for an unknown method, Cancelled when `cancelled()` says so. When `hurry()` says so, method
    "path" keeps what it has found, searches the rest quickly, and the take's warnings tell from which second on; before
    anything is found, and by the other methods, that is Cancelled too. The same library, plan and numpy give the same bits:
    linear algebra is held to one thread, since more add up in another order.
    """
    if plan.method not in METHODS:
        raise InputError("--method", plan.method, f"one of {', '.join(METHODS)}")
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return _synthesize(library, plan, progress or (lambda fraction, text: None), cancelled, hurry)


def _synthesize(library: Library, plan: Plan, report: Progress, cancelled, hurry) -> Take:
    recordings, library = library, with_made_gaits(library, plan, report)
    clock = [time.perf_counter()]
    order = wanted(library, plan)
    found = _search(library, plan, order, lambda fraction, text: report(0.8 * fraction, text), cancelled, hurry)
    clock.append(time.perf_counter())
    report(0.8, "Constructing")
    track = order.track if plan.fps == library.fps else sample(plan.track, plan.fps, plan.track_window)
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
        planted, track = replace(planted, root=struck.root, rotations=struck.rotations), replace(track, ball=struck.ball)
    motion = Motion(library.skeleton, planted.root, planted.rotations, plan.fps)
    clock.append(time.perf_counter())
    seconds = dict(zip(("search", "construct", "polish"), np.diff(clock).tolist()))
    report(1.0, "Done")
    take = _take(library, plan, order, track, edit, footage, motion, keys, seconds)
    take = replace(take, contacts=taken.contacts, stepped=taken.stepped)
    take = replace(take, correction=planted.correction, ik_miss=planted.miss)
    return with_warnings(take, recordings, order, found.hurried)


def with_made_gaits(library: Library, plan: Plan, report: Progress) -> Library:
    """The library that a plan is made from: with made clips, where recordings lack what its track asks for, and with the
    chosen gaits."""
    if plan.method == "path" and plan.made and _lacks(library, plan):
        report(0.0, "Making what the recordings lack")
        library = library.extended
    return with_chosen_gaits(library, dict(plan.gaits))


def _lacks(library: Library, plan: Plan) -> bool:
    """Whether the recordings lack speeds that the track asks for, or kicks as fast as its key moments."""
    track = sample(plan.track, library.fps, plan.track_window)
    moments = np.array([key.time for key in plan.timeline.keys])
    return library.lacks(track.speed, np.interp(moments, track.times, track.speed))


def _search(library: Library, plan: Plan, order: Wanted, report: Progress, cancelled, hurry) -> Found:
    if plan.method == "path":
        search = PathSearch(library, order, balanced(plan.alpha), report, cancelled, hurry)
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
    """Seams smoothed, laid on the ground, and, by `path`, feet held where they stand or stepping where they would slide."""
    smooth = smoothed(library, plan, footage)
    if plan.method == "blocks":
        angle, ground = _chained(library, footage, smooth, track, plan.fps)
    else:
        angle, ground = _on_track(library, plan, track, smooth, found, index, strikes)
    pose = faced(smooth.pose, angle)
    root = np.concatenate([ground, smooth.height[:, None]], axis=1)
    if plan.method == "path":
        pose = leaning(library, plan, track, smooth, pose)
        return footed(library, plan, track, root, pose, footage.standing, strikes)
    none = np.zeros((len(root), 2))
    return Planted(root, pose, none, none), Steps.none(pose, footage.standing)


def smoothed(library: Library, plan: Plan, footage: Footage) -> Footage:
    """The footage without jumps at its seams: faded over by what both recordings show or, by Faustino's methods, spread as
    he does. A fade is half as long as his window."""
    reach = 0.5 * plan.seam_window * plan.fps
    if plan.method != "path":
        return _spread(footage, reach)
    over = overlap(library, footage, 0.5 * reach)
    weight = share(over.through, over.after)
    return replace(
        footage,
        pose=faded_rotations(footage.pose, over.at, over.pose, over.through, over.after),
        height=faded_values(footage.height, over.at, over.height, weight),
        sway=faded_values(footage.sway, over.at, over.sway, weight),
    )


def _spread(footage: Footage, reach: float) -> Footage:
    return replace(
        footage,
        pose=spread_rotations(footage.pose, footage.seams, footage.ahead_pose, reach),
        height=spread_values(footage.height, footage.seams, footage.ahead_height, reach),
        sway=spread_values(footage.sway, footage.seams, footage.ahead_sway, reach),
    )


def leaning(library: Library, plan: Plan, track: SampledTrack, footage: Footage, pose: np.ndarray) -> np.ndarray:
    """Local rotations (T, J, 4) of a body that leans into the track's curves as far as its footage does not."""
    lean = missing_lean(track.speed, track.direction, footage.velocity, footage.turn, footage.seams, plan.fps)
    return banked(library.skeleton, pose, track.direction, lean)


def given(library: Library, plan: Plan, track: SampledTrack, root, pose, standing: np.ndarray, free=1.0):
    """Root (T, 3) m and local rotations (T, J, 4) of a body laid on its track that gives where its feet would slide, where
    it is `free` (T,) to: 1, or nothing at 0."""
    move, turn = give(library.skeleton, root, pose, standing, plan.fps)
    pulled = pulled_to_track(root[:, :2] + move, track.raw, plan.fps, plan.root_window)
    free = np.broadcast_to(free, len(root))
    ground = root[:, :2] + free[:, None] * (pulled - root[:, :2])
    return np.concatenate([ground, root[:, 2:]], axis=1), faced(pose, free * turn)


def footed(
    library: Library, plan: Plan, track: SampledTrack, root, pose, standing: np.ndarray, strikes: list[Touch],
    share=0.0, stepped: np.ndarray | None = None,
) -> tuple[Planted, Steps]:
    """A body laid on its track with its feet held where they stand, or stepping where they would be dragged.

    No steps are added where the ball may be met, nor where a share (T,) of the motion is given; stepped (T, 2) bool: those
    that are taken there.
    """
    share, at = np.broadcast_to(share, len(root)), np.arange(len(root))
    free = share == 0.0
    for touch in strikes:
        free &= (at < touch.frame - touch.entry) | (at > touch.frame + touch.leave)
    taken = steps(library.skeleton, root, pose, standing, plan.fps, stepped, free)
    root = root + np.column_stack([(1.0 - share)[:, None] * taken.sway, np.zeros(len(root))])
    root, pose = given(library, plan, track, root, taken.rotations, taken.standing, 1.0 - share)
    return plant(library.skeleton, root, pose, taken.standing, plan.fps, moves=taken.moves), taken


def faced(pose: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Poses (T, J, 4) turned about the vertical by `angle` (T,) radians; from the facing frame: facing there."""
    out = pose.copy()
    out[:, 0] = quaternion.multiply(quaternion.about_up(angle), pose[:, 0])
    return out


def _on_track(library: Library, plan: Plan, track: SampledTrack, footage: Footage, found: Found, index, strikes):
    """Facing (T,) and root (T, 2): at the track's place at every time, or, by distance, where the track has come as far."""
    if found.travelled is None:
        firm = firmness(footage.standing, footage.height, plan.fps)
        angle = facing(track.direction, track.speed, footage.velocity, footage.turn, firm=firm, aim=aimed(track))
        angle = angle + towards_ball(library, track, footage, angle, strikes)
        root = root_with_sway(track.positions, footage.sway, angle)
        return angle, pulled_to_track(root, track.raw, plan.fps, plan.root_window)
    travelled = np.interp(index, np.arange(len(found.travelled)), found.travelled)
    place, direction = along(track, travelled)
    speed = np.abs(np.gradient(travelled)) * plan.fps if len(travelled) > 1 else np.zeros(1)
    angle = facing(direction, speed, footage.velocity, footage.turn)
    return angle, root_with_sway(place, footage.sway, angle)


def aimed(track: SampledTrack) -> np.ndarray:
    """(T,) radians: where a body that stands or goes slowly turns to."""
    return track.direction + wanted_offset(track)


def towards_ball(library: Library, track: SampledTrack, footage: Footage, angle: np.ndarray, strikes: list[Touch]) -> np.ndarray:
    """(T,) radians by which a body that faces `angle` (T,) turns so that what strikes points at the ball."""
    ground = root_with_sway(track.positions, footage.sway, angle)
    root = np.concatenate([ground, footage.height[:, None]], axis=1)
    return turned_to_ball(library.skeleton, root, faced(footage.pose, angle), track.ball, strikes, track.fps)


def touches(library: Library, plan: Plan, edit: EditList, keys: tuple[KeyResult, ...]) -> list[Touch]:
    """Where the body may meet the ball: every key moment that is played."""
    found = []
    for placed in edit.keys:
        result = keys[placed.wanted]
        entry, leave = np.multiply(needed(library, placed.key), plan.fps / library.fps)
        found.append(Touch(result.frame, result.words, float(entry), float(leave)))
    return found


def met(library, plan: Plan, track: SampledTrack, standing: np.ndarray, planted: Planted, found: list[Touch]) -> Struck:
    """The motion and the ball with the striking part of the body on the ball at every touch that was found; standing
    (T, 2, 2) bool."""
    known = plan.track.ball_height_known
    height = np.interp(track.times, plan.track.times, known.astype(float)) > 0.5
    return strike(
        library.skeleton, planted.root, planted.rotations, standing.any(axis=2), track.ball, found, plan.fps,
        measured=track.ball_measured, height_known=height,
    )


def along(track: SampledTrack, travelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (T, 2) on the track's path after `travelled` (T,) metres, and the direction (T,) of the path there in radians.

    Faustino eq. 29 steps from the present place towards the track's place at the next travelled distance; since both lie on
    the same path, the steps add up to the path itself. (As printed the difference points backwards.) Beyond the track's end
    the last direction is kept.
    """
    way = travelled_distance(track) + 1e-6 * np.arange(len(track.times))
    place = np.stack([np.interp(travelled, way, track.positions[:, axis]) for axis in (0, 1)], axis=1)
    direction = np.interp(travelled, way, track.direction)
    beyond = np.maximum(travelled - way[-1], 0.0)[:, None]
    return place + beyond * np.stack([np.cos(direction), np.sin(direction)], axis=1), direction


def _chained(library: Library, footage: Footage, smooth: Footage, track: SampledTrack, fps: float):
    """Facing and root for `blocks`: from the track's first place and direction on, wherever the clips lead."""
    turn = footage.turn.copy()
    torso, expected = _torso(library, footage.pose), _torso(library, footage.ahead_pose)
    turn[footage.seams] += torso_corrections(torso, footage.seams, expected)
    angle = chained_facing(float(track.direction[0]), turn)
    return angle, chained_root(track.positions[0], smooth.velocity, smooth.sway, angle, fps)


def _torso(library: Library, pose: np.ndarray) -> np.ndarray:
    """(T, 3) unit vector from hips to chest or neck in the facing frame."""
    body = identify(library.skeleton)
    top = body.neck if body.neck is not None else body.chest
    places, _ = pose_kinematics(library.skeleton, np.zeros((len(pose), 3)), pose)
    torso = places[:, top] - places[:, body.hips]
    return torso / np.maximum(np.linalg.norm(torso, axis=1, keepdims=True), 1e-9)


def _take(library, plan, order: Wanted, track, edit: EditList, footage: Footage, motion, keys, seconds) -> Take:
    clips = library.clips
    sources = sources_shown(library, footage)
    names = tuple(dict.fromkeys(sources))
    number = {name: i for i, name in enumerate(names)}
    ball = None
    if np.any(np.isfinite(track.ball[:, :2])):
        ball = BallPath(track.times, track.ball, track.ball_measured)
    return Take(
        motion=motion,
        start_time=float(track.times[0]),
        clips=names,
        clip=np.array([number[source] for source in sources]),
        clip_frame=footage.clip_frame,
        mirrored=np.array([clips[clip].mirrored for clip in footage.clip]),
        words=words_shown(library, footage),
        contacts=footage.standing.all(axis=2),
        seams=footage.seams,
        timeline=order.timeline,
        keys=keys,
        ball=ball,
        method=plan.method,
        seed=plan.seed,
        seconds=seconds,
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


def with_warnings(take: Take, recordings: Library, order: Wanted, hurried: int | None) -> Take:
    """The take with what has to be told about it. recordings: the library without made clips; hurried: frame at the
    library's rate from which on the search was cut short, or None."""
    told = [*recordings.notes, *order.warnings, *_crowded_out(order, take.edit)]
    if hurried is not None:
        told.append(f"{take.start_time + hurried / recordings.fps:.1f} s: from here on the search was cut short")
    return replace(take, warnings=(*told, *_gave_way(recordings, take.plan, take)))


def _crowded_out(order: Wanted, edit: EditList) -> list[str]:
    """One warning per key moment that clips could serve, but not so close to another one."""
    placed = {key.wanted for key in edit.keys}
    return [
        f"{key.asked.time:g} s: no room for '{' '.join(key.asked.words)}' so close to another key moment, it is not played"
        for number, key in enumerate(order.keys)
        if key.choices and number not in placed
    ]


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
