"""What a library's uncut recordings score themselves, worked out once per library and output rate, and a take beside
them (`View`).

Measured are the recordings as they are used: brought to the library's skeleton and repaired (`library.repair`), which
leaves their jerk as it was: the 95th percentile moves by 1 % at most where clips keep their speed class, by 4 to 9 % on
a library of five bodies whose clips nearly all get other feet.

Every recording is resampled to the output's rate and measured frame by frame; a take's own score is then a look-up of
the frames it used. Twins are not measured again: all figures here are the same for left and right.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ..annotation import Timeline
from ..annotation.gaits import STANDING
from ..base.errors import InputError
from ..library.clip import Clip
from ..library.library import Library
from ..motion.humanoid import Humanoid, identify, stature
from ..motion.motion import at_frames, forward_kinematics, pose_kinematics, resample
from ..motion.skeleton import Skeleton
from ..motion.track import Track
from ..synthesis.quality import movement
from ..synthesis.quality.moments import moments
from ..synthesis.quality.played import Played, find_transitions
from . import realism

POSES_PER_SECOND = 10.0
LEFT_OUT_POSES = 3000


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """One uncut clip at the output's rate, T frames, measured.

    features (T, 6 J) float32 m, of `realism.pose_features`. sway, surge, speed (T,): m, m/s, m/s. contact_speed (T, 2)
    m/s, NaN without contact. skating (T,) bool. heel_rest: height of its heel joint on a flat foot, m. support (T, 2)
    m. tip (T,) m. jerk (T-3,) m/s^3. smoothness (T,) m from each frame to the next, NaN at the end. stances (S, 3) of
    its own frames and their travel (S,) m."""

    path: str
    rate: float
    features: np.ndarray
    sway: np.ndarray
    surge: np.ndarray
    speed: np.ndarray
    contact_speed: np.ndarray
    skating: np.ndarray
    heel_rest: float
    support: np.ndarray
    tip: np.ndarray
    jerk: np.ndarray
    smoothness: np.ndarray
    stances: np.ndarray
    travel: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class LibraryReference:
    """A library's recordings at `fps`, one after the other (N frames), and what is real for them.

    index: path -> recording; first (C + 1,): each recording's first row; rate (C,): its own frames per second; the
    per-frame arrays are Recording's, joined; jerk_above_real (N,): 1 where the window around a frame is above jerk_p95,
    NaN at a clip's ends. Speed classes are `movement.speed_class`'s: jerk_p95 (5,) m/s^3, smoothness_p95 and pose_p95
    (5,) m. poses (M, 6 J): some ten a second of all clips, twins included. heel_rest: height of the heel joint on a
    flat foot, m. fastest: highest speed of a root behind a 1 s window, slowest: the slowest gait, m/s."""

    fps: float
    index: dict[str, int]
    first: np.ndarray
    rate: np.ndarray
    sway: np.ndarray
    surge: np.ndarray
    speed: np.ndarray
    contact_speed: np.ndarray
    skating: np.ndarray
    support: np.ndarray
    tip: np.ndarray
    jerk_above_real: np.ndarray
    smoothness: np.ndarray
    stances: np.ndarray
    travel: np.ndarray
    heel_rest: float
    jerk_p95: np.ndarray
    smoothness_p95: np.ndarray
    poses: np.ndarray
    pose_p95: np.ndarray
    fastest: float
    slowest: float

    def rows(self, clips: tuple[str, ...], clip: np.ndarray, clip_frame: np.ndarray) -> np.ndarray:
        """Fractional row (T,) of each output frame's source, NaN where it is not known.

        clips: table of paths; clip (T,) int index into it, -1 unknown; clip_frame (T,) in the clip's own rate."""
        table = np.array([self.index.get(path, -1) for path in clips] + [-1])
        own = table[clip]
        frame = np.clip(clip_frame * self.fps / self.rate[own], 0, np.diff(self.first)[own] - 1)
        return np.where((own >= 0) & (clip >= 0), self.first[own] + frame, np.nan)

    def used_stances(self, rows: np.ndarray) -> np.ndarray:
        """Travel (S',) m of the source stances that a take touched; rows (T,) int of the frames it used."""
        used = np.zeros(self.first[-1] + 1, dtype=int)
        used[rows + 1] = 1
        count = np.cumsum(used)
        return self.travel[count[self.stances[:, 1]] > count[self.stances[:, 0]]]


_MADE: WeakKeyDictionary[Library, dict[float, LibraryReference]] = WeakKeyDictionary()


def library_reference(library: Library, fps: float) -> LibraryReference:
    """The library's reference at `fps`, kept in memory as long as the library is."""
    made = _MADE.setdefault(library, {})
    if fps not in made:
        made[fps] = build_reference(library, fps)
    return made[fps]


def build_reference(library: Library, fps: float) -> LibraryReference:
    """Measures every recording of a library at `fps` frames per second."""
    originals, twins = _originals(library.clips)
    measured = [measure(clip, fps) for clip in originals]
    lengths = [len(recording.sway) for recording in measured]
    first = np.concatenate([[0], np.cumsum(lengths)])
    windows = [movement.uncut_windows(recording.jerk, recording.speed) for recording in measured]
    hard, speed = (np.concatenate(column) for column in zip(*windows))
    jerk_p95 = movement.real_p95(hard, speed)
    poses, pose_p95 = _poses(measured, twins, identify(library.skeleton), fps)
    joined = {name: np.concatenate([getattr(recording, name) for recording in measured]) for name in _JOINED}
    return LibraryReference(
        fps=fps, index={recording.path: i for i, recording in enumerate(measured)}, first=first,
        rate=np.array([recording.rate for recording in measured]),
        jerk_above_real=np.concatenate([_above(recording, jerk_p95) for recording in measured]),
        stances=np.concatenate([r.stances + [start, start, 0] for r, start in zip(measured, first)]),
        heel_rest=float(np.median([recording.heel_rest for recording in measured])), jerk_p95=jerk_p95,
        smoothness_p95=realism.real_p95(joined["smoothness"], joined["speed"]), poses=poses, pose_p95=pose_p95,
        fastest=float(joined["speed"].max()), slowest=_slowest_gait(library), **joined,
    )  # fmt: skip


_JOINED = ("sway", "surge", "speed", "contact_speed", "skating", "support", "tip", "smoothness", "travel")


def _originals(clips: tuple[Clip, ...]) -> tuple[list[Clip], np.ndarray]:
    """One clip per path, unmirrored where there is one, and whether its twin is in the library too (C,)."""
    chosen: dict[str, Clip] = {}
    count: dict[str, int] = {}
    for clip in sorted(clips, key=lambda clip: clip.mirrored):
        chosen.setdefault(clip.path, clip)
        count[clip.path] = count.get(clip.path, 0) + 1
    return list(chosen.values()), np.array([count[path] > 1 for path in chosen])


def measure(clip: Clip, fps: float) -> Recording:
    """One clip at `fps`, uncut, measured frame by frame."""
    motion = resample(clip.recording, fps)
    skeleton, hips = motion.skeleton, identify(motion.skeleton).hips
    positions, rotations = forward_kinematics(motion)
    pelvis, planted = positions[:, hips, :2], positions[:, movement.foot_joints(skeleton)]
    at = np.minimum(np.rint(np.arange(len(motion)) * clip.motion.fps / fps).astype(int), len(clip.motion) - 1)
    contacts = clip.contacts[at]
    spans = movement.stances(contacts)
    heel_rest, floor = movement.heel_rest_height(planted, contacts), float(np.percentile(planted[:, :, 1, 2], 2))
    return Recording(
        path=clip.path, rate=clip.motion.fps, features=realism.pose_features(skeleton, positions, fps, hips),
        sway=movement.sway(pelvis, fps), surge=movement.surge(pelvis, fps), speed=movement.travel_speed(pelvis, fps),
        contact_speed=np.concatenate([movement.contact_speeds(planted, contacts, fps), [[np.nan, np.nan]]]),
        skating=np.append(movement.skating_steps(planted[:, :, 1], floor, fps), False), heel_rest=heel_rest,
        support=movement.support_height(planted, contacts, heel_rest),
        tip=movement.tip_height(skeleton, positions, rotations),
        jerk=movement.jerk(positions, fps), smoothness=np.append(realism.smoothness(skeleton, positions, fps), np.nan),
        stances=spans, travel=movement.stance_travel(planted[:, :, 1], spans),
    )  # fmt: skip


def _above(recording: Recording, real: np.ndarray) -> np.ndarray:
    """Per frame of a recording 1 where the window around it has more jerk than is real, 0 where not, NaN at its
    ends."""
    out = np.full(len(recording.sway), np.nan)
    windows, speed = movement.uncut_windows(recording.jerk, recording.speed)
    start = movement.JERK_REACH + movement.SEAM_TO_JERK
    out[start : start + len(windows)] = windows > real[movement.speed_class(speed)]
    return out


def _poses(measured: list[Recording], twins: np.ndarray, body: Humanoid, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Poses to compare with (M, 6 J), and the 95th percentile (5,) of the distance that a clip's own poses have to all
    other clips' (its twin left out with it), over at most 3000 poses evenly spread."""
    step = max(int(round(fps / POSES_PER_SECOND)), 1)
    rows = np.concatenate([recording.features[::step] for recording in measured])
    owner = np.concatenate([np.full(len(r.features[::step]), i) for i, r in enumerate(measured)])
    speed = np.concatenate([recording.speed[::step] for recording in measured])
    again = twins[owner]
    poses = np.concatenate([rows, realism.mirrored_features(rows[again], body)])
    owners = np.concatenate([owner, owner[again]])
    some = np.unique(np.linspace(0, len(rows) - 1, LEFT_OUT_POSES).astype(int))
    distance = realism.nearest_distance(rows[some], poses, owner[some], owners)
    return poses, realism.real_p95(distance, speed[some])


def source_poses(library: Library, clips: tuple[str, ...], clip, mirrored, clip_frame) -> np.ndarray:
    """Joints (T, J, 3) m of each output frame's source as recorded, seen from the body; NaN where it is not known.

    clips: table of paths; clip (T,) int index into it, -1 unknown; mirrored (T,) bool; clip_frame (T,) in the clip's
    rate."""
    table = {(source.path, source.mirrored): source.motion for source in library.clips}
    out = np.full((len(clip), len(library.skeleton), 3), np.nan)
    for number, side in set(zip(clip.tolist(), mirrored.tolist())):
        motion = table.get((clips[number], side)) if number >= 0 else None
        if motion is None:
            continue
        mine = (clip == number) & (mirrored == side)
        positions = pose_kinematics(motion.skeleton, *at_frames(motion, clip_frame[mine]))[0]
        out[mine] = realism.local_positions(motion.skeleton, positions, identify(motion.skeleton).hips)
    return out


def _slowest_gait(library: Library) -> float:
    """Speed of the slowest gait that gets about, m/s; NaN where the library has no locomotion."""
    try:
        return min(gait.speed for gait in library.gaits if gait.word != STANDING)
    except InputError:
        return np.nan


class View:
    """What all figures of one report share, worked out once: the take, the frames of the library it used, its seams,
    its speed, what was asked."""

    def __init__(self, played: Played, track: Track | None, timeline: Timeline | None, library: Library | None):
        motion = played.motion
        self.played, self.timeline, self.library, self.track = played, timeline, library, track
        self.fps, self.count = motion.fps, len(motion)
        self.reference = None if library is None else library_reference(library, motion.fps)
        self.size = 1.0 if library is None else _size(motion.skeleton, library.skeleton)
        self.stride = played.stride(library)
        self.rows = self._rows()
        self.used = np.rint(self.rows[np.isfinite(self.rows)]).astype(int)
        self.seams = find_transitions(*self.source)
        self.speed = movement.travel_speed(played.pelvis, self.fps)
        self.wanted = None if track is None else movement.track_at(track, played.times)
        self.moments = [] if timeline is None else moments(played, timeline.keys, self.stride, library)

    @property
    def source(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Clip, mirrored, clip_frame and stride per frame, as `pieces` wants them."""
        return self.played.clip, self.played.mirrored, self.played.clip_frame, self.stride

    def own(self, name: str) -> np.ndarray:
        """A figure of the uncut recordings at the frames that were used: (U, ...), empty without library."""
        return np.zeros(0) if self.reference is None else getattr(self.reference, name)[self.used]

    def _rows(self) -> np.ndarray:
        if self.reference is None:
            return np.full(self.count, np.nan)
        return self.reference.rows(self.played.clips, self.played.clip, self.played.clip_frame)


def _size(skeleton: Skeleton, library: Skeleton) -> float:
    """How many times as tall as the library's skeleton another one is; InputError where it is not the same one."""
    if skeleton.same_bones(library, 5e-3):
        return 1.0
    size = stature(skeleton) / stature(library) if skeleton.names == library.names else 1.0
    if not skeleton.same_bones(library.scaled(size), 5e-3):
        raise InputError("motion", "another skeleton than the library's", "a motion made from this library")
    return size
