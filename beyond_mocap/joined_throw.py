"""A generated throw or kick within a longer motion: run-up and recovery from a library, or out of another motion and
on.

    way = run_up_and_recovery(library, plan, thrown.motion, thrown.release, at=12.4, action="throw")
    joined = laid_into(way.motion, way.start, thrown.motion, thrown.release, at=12.4)

Around its release the throw stays bit for bit what was generated, since the ball flies as it left that hand; only its
first and last parts go over into what surrounds it. It begins on a frame of the motion it is laid
into, so the release comes up to half a frame sooner or later than asked.

`around` does the first of these for a motion that is there already: the synthesizer has a few seconds of it before and
behind the throw, and the rest stays as it is.

With a library the throw becomes a clip of it, in memory, whose key moment is the release. The player's track is led
through the place where the throw is, for the target is aimed at from there, and the synthesizer finds the way in and
out. Without one the throw is eased into the motion that is there, which goes on from where the throw ends.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .annotation import ClipAnnotation, KeyMoment, Span, Timeline
from .ball.way import hermite
from .errors import InputError, TimedLine, told_time
from .evaluation.jerk import jerk, uncut_windows, windowed
from .library.features import joined as joined_frames
from .library.library import Clip, Library, described
from .motion import contacts, quaternion
from .motion.humanoid import heading, heading_from_positions, identify, stature
from .motion.motion import (
    Motion, at_frames, forward_kinematics, place, pose_kinematics, resample, world_rotation,
)
from .motion.neutral import neutral_stance
from .motion.retarget import Retargeter
from .motion.skeleton import Skeleton
from .motion.track import Track, zero_phase_hann
from .lay_out import aimed, faced, footed, leaning, smoothed, touches
from .own_size import in_library_size, size_of
from .plan import Plan
from .polish.carry import Body, Resting, leg, limb_carried
from .polish.meeting import eased
from .polish.stepped_over import stepped_over
from .polish.on_track import facing, firmness, pulled_to_track, root_with_sway
from .synthesis.balance import balanced
from .synthesis.footage import fetch
from .synthesis.path_search import PathSearch
from .synthesis.wanted import wanted
from .synthesize import key_result, with_made_gaits

FADE = 0.5
"""Seconds in which a throw goes over into what surrounds it, at either end."""

LEAST_KEPT = 0.25
"""Seconds before and behind the release that are never faded."""

EASED = {"throw": 0.8, "kick": FADE}
"""Seconds of that without a library: time for a step of each foot, where the throw leaves it."""

TURNING = 2.0
"""Radians a second at which a body may be turned towards where the throw begins; further apart it takes longer."""

EDGE = 0.1
"""Seconds at either end of the generated clip that serve the seams."""

OWN_WORD = "generated"
"""The word that only the generated clip carries."""

ACTIONS = {"throw": ("throwb",), "kick": ("kick",)}
_CLIP = "generated throw"
_STEPS_BELOW = 2.0  # m/s; who runs takes no small steps
_WAITS = 0.5  # m/s that no joint of a body is as fast as which only stands
_CATCH_UP = 0.8  # m/s by which the track is left behind or caught up with
_LEADS = (1.0, 4.0)  # s that leading the track to the throw and back takes, at least and at most
_SMOOTH = 0.7  # s of the window that takes the sway out of the throw's own path
_FACES_TELLS, _TURNED_TELLS, _MOVED_TELLS = np.radians(100.0), np.radians(60.0), 0.05  # a throw begins side on
_PERCENT = 99.0
_SPEEDS_UP = 2.5  # m/s^2 at which a body stops and sets out
_TOO_FAST = 1.2  # times what the library, or the body itself, shows
_ENDS = 0.5  # s at either end of a stretch that faces as the motion around it
REACH = 4.5
"""Seconds before and behind a throw in which a body may leave its own way."""


_usual: weakref.WeakKeyDictionary[Library, dict] = weakref.WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class RunUp:
    """A player's motion around a throw, on the throw's own skeleton. start: seconds of its first frame on the track's
    clock. seams: frames that begin another clip. warnings: lines for people."""

    motion: Motion
    start: float
    seams: np.ndarray
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Gone:
    """What `_Way` ends in: root (T, 3) m and rotations (T, J, 4) in the library's size."""

    root: np.ndarray
    rotations: np.ndarray
    seams: np.ndarray
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Joined:
    """A longer motion with the throw in it.

    motion: all of it; start: seconds of its first frame on the caller's clock; release: seconds there at which the ball
    leaves. first, end: frames first .. end of it show the throw from its first to its last; kept: (2,) frames between
    which it is exactly as generated. moved (3,) m and turned (rad): how what follows the throw was moved and turned
    about the vertical so that it goes on from there. warnings: lines for people.
    """

    motion: Motion
    start: float
    release: float
    first: int
    end: int
    kept: tuple[int, int]
    moved: np.ndarray
    turned: float
    warnings: tuple[str, ...] = ()

def laid_into(
    own: Motion, start: float, throw: Motion, release: float, at: float, goes_on: bool = False, fade: float = FADE
) -> Joined:
    """`throw` within `own`, whose first frame is at `start` s: released (or struck) at about `at` s on the same clock.

    release: seconds in `throw`. Both are on one skeleton, the throw lies where it has to be. Where the motion ends
    sooner, its ends are held. goes_on: what follows is moved and turned so that it goes on from where the throw ends;
    else it stays where it is. InputError for two skeletons and for a throw that is too short.
    """
    if throw.skeleton.names != own.skeleton.names:
        raise InputError("throw", "the motion of another skeleton", "one on the armature's own skeleton")
    throw = resample(throw, own.fps)
    lead, follow = release, throw.duration - release
    if min(lead, follow) < LEAST_KEPT:
        raise InputError(
            "throw", f"{lead:.2f} s before and {follow:.2f} s behind the release", f"{LEAST_KEPT:g} s or more of both"
        )
    fps = own.fps
    first = int(round((at - release - start) * fps))
    end = first + len(throw)
    own, start, first, end = _long_enough(own, start, first, end)
    before = _apart(own, first, throw, 0)
    into = float(np.clip(max(fade, abs(before) / TURNING), 1.0 / fps, max(lead - LEAST_KEPT, 1.0 / fps)))
    out = min(fade, follow - LEAST_KEPT)
    kept = first + int(np.ceil(into * fps)), end - int(np.ceil(out * fps))
    turned, moved = _continuation(own, throw, kept[1] - first, kept[1], end) if goes_on else (0.0, np.zeros(3))
    old = _with_rest_moved(own, kept[1], turned, moved)
    new = own.root_positions.copy(), own.rotations.copy()
    new[0][first:end], new[1][first:end] = throw.root_positions, throw.rotations
    share = _old_share(len(own), first, kept, end)
    pose = _between(own.skeleton, new, old, share)
    if goes_on:
        standing = contacts.points(own)
        inside = np.flatnonzero(share[first:end] < 0.5) + first
        standing[inside] = contacts.points(throw)[inside - first]
        for stretch in ((first, kept[0]), (kept[1], end)):
            if _pace_over(old[0], stretch, fps) > _STEPS_BELOW:
                continue
            pose = stepped_over(own.skeleton, pose, standing, stretch, fps)
    motion = Motion(own.skeleton, *pose, fps)
    away = old[0][kept[1]] - own.root_positions[kept[1]]
    told = _told(before, start + first / fps, turned, away, start + end / fps)
    return Joined(motion, start, start + first / fps + release, first, end, kept, away, turned, told)


def run_up_and_recovery(
    library: Library,
    plan: Plan,
    throw: Motion,
    release: float,
    at: float,
    action: str = "throw",
    progress: Callable[[float, str], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
    between: Motion | None = None,
) -> RunUp:
    """The player's motion with the throw as one of the library's clips, released at about `at` s on the track's clock.

    throw: where it has to be on the pitch, on any humanoid skeleton. The plan's track is led through it. Key moments of
    the plan within the throw are left out, and told. The exact throw is then put in by `laid_into`. between: the motion
    that it comes from and goes back to, frame for frame: it faces as that does at either end. InputError for a throw
    that lies outside the track.
    """
    from threadpoolctl import threadpool_limits

    begin, finish = at - release, at - release + throw.duration
    times = plan.track.times
    if begin < times[0] - 0.5 / plan.fps or finish > times[-1] + 0.5 / plan.fps:
        raise InputError(
            "throw", f"from {begin:.2f} to {finish:.2f} s", f"within the track, {times[0]:.2f} to {times[-1]:.2f} s",
            "choose another time, or a longer track",
        )
    plain, told = _led(plan, throw, release, at, action)
    size = size_of(plan, library.skeleton)
    bones = library.skeleton.scaled(size)
    same = throw.skeleton.same_bones(bones, 1e-5)
    own = throw if same else Retargeter(throw, bones, keeps_travel=True).carry(throw)
    own = Motion(library.skeleton, own.root_positions / size, own.rotations, own.fps)
    plain = in_library_size(plain, size)
    report = progress or (lambda done, text: None)
    more = with_clip(with_made_gaits(library, plain, report), own, release, action)
    with threadpool_limits(limits=1):
        found = _Way(more, plain, own, at - release, report, cancelled, between).gone()
    motion = Motion(bones, found.root * size, found.rotations, plan.fps)
    if not same:
        motion = Retargeter(motion, throw.skeleton, example=throw, keeps_travel=True).carry(motion)
    return RunUp(motion, float(plain.track.times[0]), found.seams, (*told, *found.warnings))


class _Way:
    """A player on his way through a throw, which is the last clip of the library and begins at second `begin`."""

    def __init__(self, library: Library, plan: Plan, throw: Motion, begin: float, report, cancelled, between):
        self.library, self.plan, self.throw, self.begin, self.between = library, plan, throw, begin, between
        self.report, self.cancelled = report, cancelled

    def gone(self) -> _Gone:
        """The body laid on the track, feet planted; in the throw it faces as the throw does."""
        library, plan = self.library, self.plan
        order = wanted(library, plan)
        keys = tuple(replace(key, rates=(1.0,)) if OWN_WORD in key.asked.words else key for key in order.keys)
        order = replace(order, keys=keys)
        edit = PathSearch(
            library, order, balanced(plan.alpha), lambda done, text: self.report(0.8 * done, text), self.cancelled
        ).run()
        self.report(0.8, "Laying out")
        track = plan.sampled(plan.fps)
        index = np.minimum(np.arange(len(track.times)) * (library.fps / plan.fps), len(edit) - 1)
        footage = fetch(library, edit, index, plan.fps)
        results = tuple(key_result(library, plan, order, edit, footage, n) for n in range(len(order.keys)))
        strikes = touches(library, plan, edit, results)
        shown = smoothed(library, plan, footage)
        angle = self._facing(track, shown)
        ground = root_with_sway(track.positions, shown.sway, angle)
        ground = pulled_to_track(ground, track.raw, plan.fps, plan.root_window)
        pose = leaning(library, plan, track, shown, faced(shown.pose, angle))
        root = np.column_stack([ground, shown.height])
        planted, _ = footed(library, plan, track, root, pose, shown.standing, strikes)
        return _Gone(planted.root, planted.rotations, footage.seams, order.warnings)

    def _facing(self, track, shown) -> np.ndarray:
        """(T,) rad: as the throw faces while it is shown, the compromise of `on_track.facing` elsewhere."""
        kept = np.full(len(track.times), np.nan)
        is_throw = shown.clip == len(self.library.clips) - 1
        seconds = track.times[is_throw] - self.begin
        kept[is_throw] = np.interp(seconds, np.arange(len(self.throw)) / self.throw.fps, heading(self.throw))
        if self.between is not None:
            faces, count = heading(self.between), int(_ENDS * self.plan.fps)
            for end in (slice(None, count), slice(-count, None)):
                kept[end] = np.where(np.isnan(kept[end]), faces[end], kept[end])
        firm = firmness(shown.standing, shown.height, self.plan.fps)
        return facing(track.direction, track.speed, shown.velocity, shown.turn, kept, firm, aimed(track))


def around(
    library: Library, own: Motion, start: float, throw: Motion, release: float, at: float, action: str = "throw",
    progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool] | None = None,
) -> RunUp:
    """`own`, whose first frame is at `start` s, with a run-up to the throw and a recovery out of `library`.

    Both are on one skeleton. The body leaves its own way some seconds before the throw and is back on it some seconds
    behind, where both show poses most alike; elsewhere it is as it was, bit for bit. `laid_into` then puts in the
    throw.
    """
    fps = own.fps
    first = int(round((at - release - start) * fps))
    own, start, first, end = _long_enough(own, start, first - 1, first + len(resample(throw, fps)) + 1)
    low, high = max(first - int(REACH * fps), 0), min(end + int(REACH * fps), len(own))
    comes_back = _pace(own.root_positions[high - 1, :2] - throw.root_positions[-1, :2], high - end, fps) <= _hurry(own)
    if not comes_back:
        own = _from_there(own, end, throw.root_positions[-1, :2])
    part = own.frames(low, high)
    times = start + np.arange(low, high) / fps
    path = zero_phase_hann(part.root_positions[:, :2], fps, _SMOOTH)
    plan = Plan(
        track=Track(times, path, None), library=library.folder, fps=fps, height=stature(own.skeleton),
    )  # fmt: skip
    way = run_up_and_recovery(library, plan, throw, release, at, action, progress, cancelled, part)
    count = min(len(way.motion), len(part))
    apart = np.linalg.norm(
        forward_kinematics(way.motion)[0][:count] - forward_kinematics(part)[0][:count], axis=-1
    ).mean(axis=1)  # fmt: skip
    fade = int(FADE * fps)
    leaves = _likest(apart, 0, first - low - fade, fade) if low else 0
    comes = _likest(apart, end - low + fade, count, fade) if high < len(own) else count
    at_frame = np.arange(len(own)) - low
    before = (leaves + fade - at_frame) / (fade + 1.0) if low else np.zeros(len(own))
    behind = (at_frame - comes + 1) / (fade + 1.0) if high < len(own) else np.zeros(len(own))
    share = eased(np.maximum(before, behind), np.ones(len(own)))
    new = own.root_positions.copy(), own.rotations.copy()
    new[0][low : low + count], new[1][low : low + count] = (
        way.motion.root_positions[:count],
        way.motion.rotations[:count],
    )
    root, rotations = _between(own.skeleton, new, (own.root_positions, own.rotations), share)
    seams = [low + leaves, *(way.seams + low), low + comes]
    told = list(way.warnings)
    if not comes_back:
        when = start + end / fps
        text = (
            f"{when:.1f} s: there is no time to get back to the own way: what follows goes on from where the throw ends"
        )
        told.append(TimedLine(text, (when, when)))
    fastest = float(np.linalg.norm(np.diff(root[low:high, :2], axis=0), axis=1).max() * fps)
    if fastest > _TOO_FAST * max(library.fastest, _hurry(own)):
        told.append(f"the body would have to go at {fastest:.1f} m/s around the throw: choose another frame or target")
    return RunUp(Motion(own.skeleton, root, rotations, fps), start, np.array(seams), tuple(told))


def comes_in_time(own: Motion, start: float, throw: Motion, release: float, at: float) -> bool:
    """Whether a body on its own way can be where the throw begins by then, without hurrying much."""
    first = int(np.clip(round((at - release - start) * own.fps), 0, len(own) - 1))
    low = max(first - int(REACH * own.fps), 0)
    away = throw.root_positions[0, :2] - own.root_positions[low, :2]
    return _pace(away, first - low, own.fps) <= _hurry(own)


def stops_at(own: Motion, start: float, seconds: float) -> np.ndarray:
    """(2,) m where a body on its own way comes to a stop at second `seconds`."""
    frame = int(np.clip(round((seconds - start) * own.fps), 0, len(own) - 1))
    spot, way, _ = _stop(own, frame, -1)
    return spot + way


def _stop(own: Motion, frame: int, side: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Where (2,) m the own way is some frames before (side -1) or behind a frame, the way (2,) m on which a body that
    goes at that speed stops or sets out meanwhile, and how many frames that are."""
    fps, places = own.fps, own.root_positions[:, :2]
    second = int(fps)
    near = places[np.clip([frame, frame + side * second], 0, len(own) - 1)]
    velocity = (near[1] - near[0]) * side
    seconds = max(_LEADS[0], float(np.linalg.norm(velocity)) / _SPEEDS_UP)
    frames = int(round(seconds * fps))
    other = int(np.clip(frame + side * frames, 0, len(own) - 1))
    return places[other], 0.5 * velocity * seconds, frames


def _from_there(own: Motion, end: int, place: np.ndarray) -> Motion:
    """The motion, everything from frame `end` on moved so that a body which sets out from `place` (2,) m gets into
    it."""
    spot, way, _ = _stop(own, min(end, len(own) - 1), 1)
    root = own.root_positions.copy()
    root[end:, :2] += place + way - spot
    return replace(own, root_positions=root)


def _pace(away: np.ndarray, frames: int, fps: float) -> float:
    """m/s that it takes to go `away` (2,) m within so many frames."""
    return float(np.linalg.norm(away)) * fps / max(frames, 1)


def _hurry(own: Motion) -> float:
    """m/s that are not asked too much of a body beside what it does anyway: its usual speed and a little."""
    step = np.linalg.norm(np.diff(own.root_positions[:, :2], axis=0), axis=1) * own.fps
    usual = float(np.median(step)) if len(step) else 0.0
    return max(min(1.5 * usual, usual + 0.6), 1.6)


def _likest(apart: np.ndarray, low: int, high: int, fade: int) -> int:
    """The frame of low .. high from which on two motions, `apart` (T,) m, are most alike for `fade` frames."""
    low, high = max(low, 0), min(high, len(apart)) - fade
    if high <= low:
        return max(min(low, len(apart) - fade), 0)
    means = np.convolve(apart, np.ones(fade) / fade, mode="valid")
    return low + int(np.argmin(means[low : high + 1]))


def with_clip(library: Library, motion: Motion, release: float, action: str = "throw") -> Library:
    """The library with one clip more, in memory only: `motion`, on the library's skeleton, whose key moment lies
    `release` s behind its first frame."""
    edge = int(EDGE * motion.fps)
    words = (*ACTIONS[action], OWN_WORD)
    key = float(np.clip(release * motion.fps, edge, len(motion) - 1 - edge))
    row = ClipAnnotation(edge, len(motion) - 1 - edge, key, words)
    clip = Clip(_CLIP, False, motion, (row,), contacts.points(motion))
    frames = joined_frames(library.frames, described([clip], library.frames))
    return replace(library, clips=(*library.clips, clip), frames=frames, clusters={}, kept=None)


def standing(skeleton: Skeleton, seconds: float, fps: float, spot=(0.0, 0.0), facing: float = 0.0) -> Motion:
    """Somebody who only stands, upright, at `spot` (2,) m, facing `facing` rad."""
    stance = neutral_stance(skeleton)
    local = stance.rotations.copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            above = quaternion.inverse(stance.rotations[parent])
            local[joint] = quaternion.multiply(above, stance.rotations[joint])
    count = max(int(round(seconds * fps)) + 1, 2)
    root = np.tile(stance.positions[0], (count, 1))
    motion = Motion(skeleton, root, np.tile(local, (count, 1, 1)), fps)
    return place(motion, facing, (spot[0], spot[1], 0.0))


def without_waiting(throw: Motion, release: float, keeps: float = FADE) -> tuple[Motion, float]:
    """A throw without the time in which the body only stands, before it winds up and behind it, but for `keeps` s of
    that at either end; and seconds from its first frame to its release. It is bit for bit what it was elsewhere."""
    fps = throw.fps
    speed = np.linalg.norm(np.diff(forward_kinematics(throw)[0], axis=0), axis=-1).max(axis=1) * fps
    moves = np.flatnonzero(speed > _WAITS)
    if not len(moves):
        return throw, release
    least, margin = int(np.ceil(2.0 * LEAST_KEPT * fps)), int(round(keeps * fps))
    at = release * fps
    first = int(np.clip(moves[0] - margin, 0, max(at - least, 0)))
    end = int(np.clip(moves[-1] + 2 + margin, min(at + least + 1, len(throw)), len(throw)))
    return throw.frames(first, end), release - first / fps


def seam_jerk(joined: Joined) -> np.ndarray:
    """(2,) m/s^3: the largest third difference of any joint within 8 frames of where the throw is gone over into and
    out of."""
    values = windowed(jerk(forward_kinematics(joined.motion)[0], joined.motion.fps))
    at = 0.5 * np.array([joined.first + joined.kept[0], joined.kept[1] + joined.end])
    return values[np.clip(np.round(at).astype(int) - 2, 0, len(values) - 1)]


def usual_jerk(library: Library, fps: float, percent: float = _PERCENT) -> float:
    """m/s^3 that so many per cent of the library's uncut recordings stay below within any 17 frames, at `fps`; worked
    out once."""
    known = _usual.setdefault(library, {})
    if (fps, percent) not in known:
        known[fps, percent] = _usual_jerk(library, fps, percent)
    return known[fps, percent]


def _usual_jerk(library: Library, fps: float, percent: float) -> float:
    found = []
    for clip in library.clips:
        if not clip.mirrored and not clip.made:
            places, _ = forward_kinematics(resample(clip.recording, fps))
            found.append(uncut_windows(jerk(places, fps), np.zeros(len(places)))[0])
    values = np.concatenate(found) if found else np.zeros(0)
    return float(np.percentile(values, percent)) if len(values) else np.nan


def led_through(plan: Plan, throw: Motion, release: float, at: float) -> Track:
    """The plan's track, going where the throw is as long as it lasts: on either side it is left and met again at a
    pace that bodies can go."""
    fps = plan.fps
    track = plan.sampled(fps)
    own = resample(throw, fps)
    path = zero_phase_hann(own.root_positions[:, :2], fps, _SMOOTH)
    begin = at - release
    seconds = begin + np.arange(len(path)) / fps
    places, times = track.raw.copy(), track.times
    inside = (times >= seconds[0]) & (times <= seconds[-1])
    for axis in (0, 1):
        places[inside, axis] = np.interp(times[inside], seconds, path[:, axis])
    for way, edge in ((-1, 0), (1, -1)):
        there = float(seconds[edge]), path[edge], _velocity(path, edge, fps)
        places = _bridged(places, times, track, there, way)
    ball = None if plan.track.ball is None else track.ball
    return Track(times, places, ball)


def _bridged(places: np.ndarray, times: np.ndarray, track, there, way: int) -> np.ndarray:
    """The places (T, 2) m with a way from the track to the throw (way -1) or back to it (1)."""
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
    out[between] = hermite(times[between], low, high)
    return out


def _velocity(path: np.ndarray, edge: int, fps: float) -> np.ndarray:
    few = path[:4] if edge == 0 else path[-4:]
    return (few[-1] - few[0]) / (len(few) - 1) * fps


def _led(plan: Plan, throw: Motion, release: float, at: float, action: str) -> tuple[Plan, list[str]]:
    """The plan with the throw in its track and timeline, and lines about what it leaves no room for."""
    begin = at - release
    asked, told = _asked(plan.timeline, begin, begin + throw.duration, at, ACTIONS[action])
    if plan.pins:
        told.append("the plan's pins count for nothing beside a throw")
    track = led_through(plan, throw, release, at)
    return replace(plan, track=track, timeline=asked, pins=(), method="path"), told


def _asked(timeline: Timeline, begin: float, finish: float, at: float, words) -> tuple[Timeline, list[str]]:
    """The timeline with the throw's key moment, without what it leaves no room for; lines about that."""
    kept = [key for key in timeline.keys if not begin < key.in_force < finish]
    told = [
        TimedLine(f"{told_time(key.time)} s: '{' '.join(key.words)}' lies within the throw, it is not played",
                  (key.time, key.time))
        for key in timeline.keys if key not in kept
    ]  # fmt: skip
    spans = [part for span in timeline.spans for part in _outside(span, begin, finish)]
    return Timeline(tuple(spans), (*kept, KeyMoment(at, (*words, OWN_WORD)))), told


def _outside(span: Span, begin: float, finish: float) -> list[Span]:
    """What is left of a span outside the throw."""
    if span.end <= begin or span.start >= finish:
        return [span]
    parts = [(span.start, min(span.end, begin)), (max(span.start, finish), span.end)]
    return [replace(span, start=a, end=b) for a, b in parts if b - a > 0.1]


def _long_enough(own: Motion, start: float, first: int, end: int) -> tuple[Motion, float, int, int]:
    """The motion with its ends held as long as the throw asks, its start, and the throw's frames in it."""
    if first >= 0 and end <= len(own):
        return own, start, first, end
    added = max(-first, 0)
    at = np.arange(-added, max(end, len(own)))
    root, rotations = at_frames(own, at)
    return Motion(own.skeleton, root, rotations, own.fps), start - added / own.fps, first + added, end + added


def _apart(own: Motion, frame: int, throw: Motion, shown: int) -> float:
    """Radians from where `own` faces at its frame to where the throw faces at its."""
    angles = []
    for motion, at in ((own, frame), (throw, shown)):
        places, _ = pose_kinematics(motion.skeleton, motion.root_positions[at], motion.rotations[at])
        angles.append(float(heading_from_positions(motion.skeleton, places)))
    return float(quaternion.wrapped(angles[1] - angles[0]))


def _continuation(own: Motion, throw: Motion, shown: int, frame: int, end: int) -> tuple[float, np.ndarray]:
    """Turn (rad) and offset (3,) m that put `own` where the throw is, in the middle of the hand-over."""
    middle = (end - frame) // 2
    at, there = min(frame + middle, len(own) - 1), min(shown + middle, len(throw) - 1)
    turn = _apart(own, at, throw, there)
    moved = quaternion.rotate(quaternion.about_up(np.array(turn)), own.root_positions[at])
    away = throw.root_positions[there] - moved
    return turn, np.array([away[0], away[1], 0.0])


def _with_rest_moved(own: Motion, frame: int, turn: float, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root and rotations of `own` with everything from `frame` on turned and moved."""
    moved = place(own, turn, offset)
    behind = np.arange(len(own)) >= frame
    return (
        np.where(behind[:, None], moved.root_positions, own.root_positions),
        np.where(behind[:, None, None], moved.rotations, own.rotations),
    )


def _pace_over(root: np.ndarray, stretch: tuple[int, int], fps: float) -> float:
    """m/s over the ground of root (T, 3) m within a stretch, on average."""
    part = root[stretch[0] : stretch[1], :2]
    return float(np.linalg.norm(np.diff(part, axis=0), axis=1).mean() * fps) if len(part) > 1 else 0.0


def _old_share(count: int, first: int, kept: tuple[int, int], end: int) -> np.ndarray:
    """(count,) share of what surrounds the throw: 0 within `kept`, 1 before its first frame and from its end on."""
    at = np.arange(count)
    before, behind = (kept[0] - at) / (kept[0] - first + 1.0), (at - kept[1] + 1) / (end - kept[1] + 1.0)
    return eased(np.maximum(before, behind), np.ones(count))


def _between(skeleton: Skeleton, new, old, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root (T, 3) m and rotations (T, J, 4) that are `new` where share (T,) is 0 and `old` where it is 1, bit for bit;
    feet go straight from where the one has them to where the other has them."""
    root = new[0] + share[:, None] * (old[0] - new[0])
    rotations = quaternion.slerp(new[1], quaternion.signed_like(old[1], new[1]), share[:, None])
    body, legs = Body.posed(skeleton, root, rotations), identify(skeleton)
    ours, theirs = pose_kinematics(skeleton, *new), pose_kinematics(skeleton, *old)
    for limb in (legs.left, legs.right):
        place, there = ours[0][:, limb.foot], theirs[0][:, limb.foot]
        away = place + share[:, None] * (there - place) - body.places[:, limb.foot]
        rotations = limb_carried(body, Resting.of(body, leg(limb)), away, rotations=rotations)
        turned = quaternion.slerp(ours[1][:, limb.foot], theirs[1][:, limb.foot], share)
        above = quaternion.inverse(world_rotation(skeleton, rotations, skeleton.parents[limb.foot]))
        rotations[:, limb.foot] = quaternion.multiply(above, turned)
    for end, (places, turns) in ((0.0, new), (1.0, old)):
        same = share == end
        root[same], rotations[same] = places[same], turns[same]
    return root, rotations


def _told(before: float, begin: float, turned: float, moved: np.ndarray, end: float) -> tuple[str, ...]:
    told = []
    if abs(before) > _FACES_TELLS:
        told.append(TimedLine(
            f"{begin:.1f} s: the body faces {abs(np.degrees(before)):.0f} degrees away from where the throw begins and "
            "is turned there; let it face the target, or give a library", (begin, begin),
        ))  # fmt: skip
    if np.linalg.norm(moved[:2]) > _MOVED_TELLS or abs(turned) > _TURNED_TELLS:
        told.append(TimedLine(
            f"{end:.1f} s: what follows goes on from where the throw ends, {np.degrees(turned):.0f} degrees turned",
            (end, end),
        ))  # fmt: skip
    return tuple(told)
