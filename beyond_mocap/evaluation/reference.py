"""The scores of a library's uncut recordings, computed once per library and frame rate, and a take beside them
(`View`).

Recordings are measured as they are used: retargeted to the library's skeleton and repaired (`library.repair`). Repair
leaves their jerk nearly unchanged: the 95th percentile moves by 1 % at most where clips keep their speed class, by 4 to
9 % on a library of five bodies whose clips nearly all get other feet.

Every recording is resampled to the output's frame rate and measured frame by frame; a take's own score is then a
look-up of the frames it used. Mirrored clips are not measured again: all figures here are the same for left and right.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from ..annotation import Timeline
from ..annotation.gaits import STANDING
from ..appearance.boots import build_boots
from ..appearance.mesh import BodyMesh
from ..base.errors import InputError
from ..library.clip import Clip
from ..library.keys import collect_keys
from ..library.library import Library
from ..motion.humanoid import Humanoid, estimate_stature, identify_joints
from ..motion.motion import compute_pose, concatenate_motions, forward_kinematics, resample, sample_frames
from ..motion.skeleton import Skeleton
from ..motion.track import SampledTrack, Track, sample_track, smooth_zero_phase_hann
from ..synthesis.quality import movement
from ..synthesis.quality.moments import evaluate_moments
from ..synthesis.quality.playback import Playback, find_transitions
from . import realism
from .body_physics import BodyPhysics, measure_body_physics
from .naturalness import FPS as COURSE_FPS
from .naturalness import BodyCourse, find_stands, measure_course
from .touches import Kick, find_side, is_foot_reception, is_kick, measure_kick, measure_legs, measure_reception

POSES_PER_SECOND = 10.0  # of a recording that are compared with
EXAMPLE_FPS = 1.0  # poses per second of recordings that show how boots hang on the skeleton
LEFT_OUT_POSES = 3000  # poses at most in the leave-one-clip-out estimate


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """Figures of one uncut clip at the output's frame rate, T frames.

    Attributes:
        path: of the clip.
        rate: its own frames per second.
        features: (T, 6 J) m, float32, from `realism.build_pose_features`.
        sway, surge, speed: (T,) m, m/s, m/s.
        contact_speed: (T, 2) m/s, NaN without contact.
        skating: (T,) bool.
        heel_rest: height of its heel joint on a flat foot, m.
        support: (T, 2) m, height of the feet in contact.
        tip: (T,) m, height of the lowest tip.
        jerk: (T-3,) m/s^3.
        smoothness: (T,) m from each frame to the next, NaN at the end.
        stances: (S, 3) first frame, end and side.
        travel: (S,) m, travel of the stances.
        stands: (T,) bool, whether its body stands.
        contacts: (T, 2) bool, feet on the ground.
        course: where its body faces and goes, at 30 frames per second.
        kicks: those that its labels name.
        receptions: m/s of the foot at receptions that its labels name.
        physics: how its mass moves, at 30 frames per second.
    """

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
    stands: np.ndarray
    contacts: np.ndarray
    course: BodyCourse
    kicks: tuple[Kick, ...]
    receptions: tuple[float, ...]
    physics: BodyPhysics


@dataclass(frozen=True, eq=False, kw_only=True)
class LibraryReference:
    """Figures of a library's recordings at `fps`, one after the other (N frames), and the level of real motion.

    Speed classes are those of `movement.classify_speed`.

    Attributes:
        fps: frames per second.
        index: path -> recording.
        first: (C + 1,) each recording's first row.
        rate: (C,) each recording's own frames per second.
        sway, surge, speed, contact_speed, skating, support, tip, smoothness, stances, travel, stands, contacts: those
            of `Recording`, joined.
        jerk_ratio: (N,) of the window around a frame to jerk_p95, NaN at a clip's ends.
        heel_rest: height of the heel joint on a flat foot, m.
        jerk_p95: (5,) m/s^3 by speed class.
        jerk_recorded: (5,) bool, classes with recordings of their own; others have the nearest one's jerk_p95.
        smoothness_p95: (5,) m by speed class.
        pose_p95: (5,) m by speed class, NaN where fewer than FEWEST_RECORDINGS have that speed.
        pose_recordings: (5,) int, recordings with that speed.
        poses: (M, 6 J) about ten a second of all clips, mirrored ones included.
        fastest: highest speed of a root, smoothed with a 1 s window, m/s.
        slowest: speed of the slowest gait, m/s.
        courses: of all recordings.
        kicks, receptions, physics: of all recordings, see `Recording`.
        boots: of the library's body.
    """

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
    jerk_ratio: np.ndarray
    smoothness: np.ndarray
    stances: np.ndarray
    travel: np.ndarray
    stands: np.ndarray
    contacts: np.ndarray
    heel_rest: float
    jerk_p95: np.ndarray
    jerk_recorded: np.ndarray
    smoothness_p95: np.ndarray
    poses: np.ndarray
    pose_p95: np.ndarray
    pose_recordings: np.ndarray
    fastest: float
    slowest: float
    courses: tuple[BodyCourse, ...]
    kicks: tuple[Kick, ...]
    receptions: tuple[float, ...]
    physics: tuple[BodyPhysics, ...]
    boots: BodyMesh

    def find_rows(self, clips: tuple[str, ...], clip: np.ndarray, clip_frame: np.ndarray) -> np.ndarray:
        """Find the row of each output frame's source.

        Args:
            clips: table of paths.
            clip: (T,) int, index into the table, -1 if unknown.
            clip_frame: (T,) at the clip's own frame rate.
        Returns:
            (T,) fractional rows, NaN if unknown.
        """
        table = np.array([self.index.get(path, -1) for path in clips] + [-1])
        recordings = table[clip]
        frame = np.clip(clip_frame * self.fps / self.rate[recordings], 0, np.diff(self.first)[recordings] - 1)
        return np.where((recordings >= 0) & (clip >= 0), self.first[recordings] + frame, np.nan)

    def flag_used(self, rows: np.ndarray) -> np.ndarray:
        """Flag the rows (N,) bool that a take uses; a faster playback skips none in between.

        Args:
            rows: (U,) fractional rows of the frames that it uses.
        """
        used = np.zeros(self.first[-1], dtype=bool)
        used[np.floor(rows).astype(int)] = used[np.ceil(rows).astype(int)] = True
        return used

    def select_used_travel(self, used: np.ndarray) -> np.ndarray:
        """Select the travel (S',) m of the source stances of which a used row (N,) bool is part."""
        # count[i] is the number of used rows before row i, so a stance is used if it grows over the stance.
        count = np.append(0, np.cumsum(used))
        return self.travel[count[self.stances[:, 1]] > count[self.stances[:, 0]]]

    def split_by_course(self, used: np.ndarray) -> list[np.ndarray]:
        """Split used rows (N,) bool into the frames (T,) bool of each course, at its own rate."""
        out = []
        for course, first, end in zip(self.courses, self.first, self.first[1:]):
            rows = np.rint(np.arange(len(course.heading)) * self.fps / COURSE_FPS).astype(int)
            out.append(used[first:end][np.minimum(rows, end - first - 1)])
        return out


_CACHE: WeakKeyDictionary[Library, dict[float, LibraryReference]] = WeakKeyDictionary()


def load_reference(library: Library, fps: float) -> LibraryReference:
    """Return the library's reference at a frame rate; it stays in memory as long as the library.

    Args:
        library: the library.
        fps: frames per second.
    Returns:
        The reference.
    """
    by_fps = _CACHE.setdefault(library, {})
    if fps not in by_fps:
        by_fps[fps] = build_reference(library, fps)
    return by_fps[fps]


def build_reference(library: Library, fps: float) -> LibraryReference:
    """Measure every recording of a library.

    Args:
        library: the library.
        fps: frames per second of the output.
    Returns:
        The reference.
    """
    originals, twins = _select_originals(library.clips)
    examples = concatenate_motions([resample(clip.recording, EXAMPLE_FPS) for clip in originals])
    boots = build_boots(library.skeleton, example=examples)
    measured = [measure_recording(clip, fps, boots) for clip in originals]
    lengths = [len(recording.sway) for recording in measured]
    first = np.concatenate([[0], np.cumsum(lengths)])
    windows = [movement.collect_uncut_windows(recording.jerk, recording.speed) for recording in measured]
    jerk, speed = (np.concatenate(column) for column in zip(*windows))
    jerk_p95 = movement.compute_real_p95(jerk, speed)
    poses, *limits = _select_poses(measured, twins, identify_joints(library.skeleton), fps)
    joined = {name: np.concatenate([getattr(recording, name) for recording in measured]) for name in _JOINED_FIELDS}
    return LibraryReference(
        fps=fps, index={recording.path: i for i, recording in enumerate(measured)}, first=first,
        rate=np.array([recording.rate for recording in measured]),
        jerk_ratio=np.concatenate([_measure_jerk_ratio(recording, jerk_p95) for recording in measured]),
        stances=np.concatenate([r.stances + [start, start, 0] for r, start in zip(measured, first)]),
        heel_rest=float(np.median([recording.heel_rest for recording in measured])), jerk_p95=jerk_p95,
        jerk_recorded=movement.find_recorded_classes(speed),
        smoothness_p95=realism.compute_class_p95(joined["smoothness"], joined["speed"]), poses=poses,
        pose_p95=limits[0], pose_recordings=limits[1],
        fastest=float(joined["speed"].max()), slowest=_find_slowest_speed(library),
        courses=tuple(recording.course for recording in measured),
        kicks=tuple(kick for recording in measured for kick in recording.kicks),
        receptions=tuple(speed for recording in measured for speed in recording.receptions),
        physics=tuple(recording.physics for recording in measured), boots=boots, **joined,
    )  # fmt: skip


_JOINED_FIELDS = ("sway", "surge", "speed", "contact_speed", "skating", "support", "tip", "smoothness", "travel",
                  "stands", "contacts")  # fmt: skip


def _select_originals(clips: tuple[Clip, ...]) -> tuple[list[Clip], np.ndarray]:
    """Select one recording per path, unmirrored if possible, and whether its mirrored twin is in the library too (C,).

    Synthetic clips are no recordings.
    """
    chosen: dict[str, Clip] = {}
    count: dict[str, int] = {}
    for clip in sorted((clip for clip in clips if not clip.is_synthetic), key=lambda clip: clip.mirrored):
        chosen.setdefault(clip.path, clip)
        count[clip.path] = count.get(clip.path, 0) + 1
    return list(chosen.values()), np.array([count[path] > 1 for path in chosen])


def measure_recording(clip: Clip, fps: float, boots: BodyMesh) -> Recording:
    """Measure one clip, uncut, frame by frame.

    Args:
        clip: the clip.
        fps: frames per second of the output.
        boots: of the library's body.
    Returns:
        Its figures.
    """
    motion = resample(clip.recording, fps)
    skeleton, hips = motion.skeleton, identify_joints(motion.skeleton).hips
    positions, rotations = forward_kinematics(motion)
    pelvis, feet = positions[:, hips, :2], positions[:, movement.list_foot_joints(skeleton)]
    source_frames = np.minimum(np.rint(np.arange(len(motion)) * clip.motion.fps / fps).astype(int), len(clip.motion)
                               - 1)
    contacts = clip.contacts[source_frames]
    spans = movement.list_stances(contacts)
    heel_rest, floor = movement.measure_heel_rest(feet, contacts), float(np.percentile(feet[:, :, 1, 2], 2))
    course = measure_course(skeleton, positions, fps)
    kicks, receptions = _measure_labelled_touches(clip, positions, fps, contacts, course)
    return Recording(
        path=clip.path, rate=clip.motion.fps, features=realism.build_pose_features(skeleton, positions, fps, hips),
        sway=movement.measure_sway(pelvis, fps), surge=movement.measure_surge(pelvis, fps),
        speed=movement.measure_travel_speed(pelvis, fps),
        contact_speed=np.concatenate([movement.measure_contact_speeds(feet, contacts, fps), [[np.nan, np.nan]]]),
        skating=np.append(movement.find_skating_steps(feet[:, :, 1], floor, fps), False), heel_rest=heel_rest,
        support=movement.measure_support_height(feet, contacts, heel_rest),
        tip=movement.measure_tip_height(skeleton, positions, rotations), jerk=movement.compute_jerk(positions, fps),
        smoothness=np.append(realism.measure_smoothness(skeleton, positions, fps), np.nan), stances=spans,
        travel=movement.measure_stance_travel(feet[:, :, 1], spans), course=course, kicks=kicks, receptions=receptions,
        stands=find_stands(smooth_zero_phase_hann(pelvis, fps, movement.ROOT_WINDOW), fps), contacts=contacts,
        physics=measure_body_physics(motion, positions, rotations, course, boots),
    )  # fmt: skip


def _measure_labelled_touches(
    clip: Clip, positions: np.ndarray, fps: float, contacts: np.ndarray, course: BodyCourse
) -> tuple[tuple[Kick, ...], tuple[float, ...]]:
    """Measure the kicks and receptions (m/s of the foot) that a clip's labels name."""
    keys = [key for key in collect_keys([clip]) if is_kick(key.labels) or is_foot_reception(key.labels)]
    if not keys:
        return (), ()
    legs = measure_legs(clip.motion.skeleton, positions, fps, contacts, course)
    found = [(key.labels, (key.frame / clip.motion.fps, find_side(key.labels))) for key in keys]
    return (tuple(measure_kick(legs, *at) for labels, at in found if is_kick(labels)),
            tuple(measure_reception(legs, *at) for labels, at in found if is_foot_reception(labels)))


def _measure_jerk_ratio(recording: Recording, real: np.ndarray) -> np.ndarray:
    """Measure the jerk (T,) of the window around each frame of a recording over `real`, NaN at its ends."""
    out = np.full(len(recording.sway), np.nan)
    windows, speed = movement.collect_uncut_windows(recording.jerk, recording.speed)
    start = movement.JERK_REACH + movement.TRANSITION_TO_JERK
    out[start : start + len(windows)] = windows / real[movement.classify_speed(speed)]
    return out


def _select_poses(measured: list[Recording], twins: np.ndarray, body: Humanoid, fps: float) -> tuple[np.ndarray,
        np.ndarray, np.ndarray]:
    """Select the poses to compare with (M, 6 J); compute the 95th percentile (5,) of the leave-one-clip-out distance,
    and the number of recordings (5,) behind it.

    That is the distance of a clip's own poses to all other clips' (its mirrored twin left out too), over at most 3000
    poses evenly spread.
    """
    step = max(int(round(fps / POSES_PER_SECOND)), 1)
    rows = np.concatenate([recording.features[::step] for recording in measured])
    owner = np.concatenate([np.full(len(r.features[::step]), i) for i, r in enumerate(measured)])
    speed = np.concatenate([recording.speed[::step] for recording in measured])
    has_twin = twins[owner]
    poses = np.concatenate([rows, realism.mirror_features(rows[has_twin], body)])
    owners = np.concatenate([owner, owner[has_twin]])
    sampled = np.unique(np.linspace(0, len(rows) - 1, LEFT_OUT_POSES).astype(int))
    distance = realism.measure_nearest_distance(rows[sampled], poses, owner[sampled], owners)
    recordings = realism.count_recordings(owner, speed, int(POSES_PER_SECOND))
    return poses, realism.compute_pose_limits(distance, speed[sampled], recordings), recordings


def compute_source_poses(library: Library, clips: tuple[str, ...], clip, mirrored, clip_frame) -> np.ndarray:
    """Compute the recorded pose of each output frame's source, in the body's frame.

    Args:
        library: the library, J joints.
        clips: table of paths.
        clip: (T,) int, index into the table, -1 if unknown.
        mirrored: (T,) bool.
        clip_frame: (T,) at the clip's own frame rate.
    Returns:
        (T, J, 3) m, NaN if unknown.
    """
    table = {(source.path, source.mirrored): source.motion for source in library.clips}
    out = np.full((len(clip), len(library.skeleton), 3), np.nan)
    for number, side in set(zip(clip.tolist(), mirrored.tolist())):
        motion = table.get((clips[number], side)) if number >= 0 else None
        if motion is None:
            continue
        selected = (clip == number) & (mirrored == side)
        positions = compute_pose(motion.skeleton, *sample_frames(motion, clip_frame[selected]))[0]
        out[selected] = realism.compute_local_positions(motion.skeleton, positions,
                                                        identify_joints(motion.skeleton).hips)
    return out


def _find_slowest_speed(library: Library) -> float:
    """Find the speed of the slowest gait that travels, m/s; NaN for a library without locomotion."""
    try:
        return min(gait.speed for gait in library.gaits if gait.label != STANDING)
    except InputError:
        return np.nan


class View:
    """A take beside its library and track: what all figures of a report share, computed once.

    Attributes:
        played: the motion with its sources, T frames.
        track, timeline, library: what it was synthesized from, or None.
        fps, count: frames per second and number of frames.
        reference: the library's own scores, or None.
        scale: stature relative to the library's skeleton.
        stride: clip frames per output frame at playback rate 1.
        reference_rows: (T,) fractional rows of the reference, NaN if unknown.
        used_rows: (U,) int, the rows of the known frames.
        used: (N,) bool, the rows of the reference that are used.
        transitions: first frame of each clip but the first.
        speed: (T,) m/s.
        target: (T, 2) m, the track at the output frames, or None.
        moments: the key moments with their clips.
    """

    def __init__(self, played: Playback, track: Track | None, timeline: Timeline | None, library: Library | None):
        motion = played.motion
        self.played, self.timeline, self.library, self.track = played, timeline, library, track
        self.fps, self.count = motion.fps, len(motion)
        self.reference = None if library is None else load_reference(library, motion.fps)
        self.scale = 1.0 if library is None else compute_scale(motion.skeleton, library.skeleton)
        self.stride = played.compute_stride(library)
        self.reference_rows = self._find_reference_rows()
        self.used_rows = np.rint(self.reference_rows[np.isfinite(self.reference_rows)]).astype(int)
        known = self.reference_rows[np.isfinite(self.reference_rows)]
        self.used = np.zeros(0, dtype=bool) if self.reference is None else self.reference.flag_used(known)
        self.transitions = find_transitions(*self.source)
        self.speed = movement.measure_travel_speed(played.pelvis, self.fps)
        self.target = None if track is None else movement.interpolate_track(track, played.times)
        self.moments = [] if timeline is None else evaluate_moments(played, timeline.keys, self.stride, library)

    @property
    def are_clips_known(self) -> bool:
        """Whether the played clips are known."""
        return bool(np.any(self.played.clip >= 0))

    @cached_property
    def jerk(self) -> np.ndarray:
        """(T-3,) m/s^3, of `movement.compute_jerk`."""
        return movement.compute_jerk(self.played.positions, self.fps)

    @cached_property
    def course(self) -> BodyCourse:
        """Where the body faces and goes."""
        return measure_course(self.played.motion.skeleton, self.played.positions, self.fps)

    @cached_property
    def sampled_track(self) -> SampledTrack:
        """The track, which has to be known, at the take's rate."""
        return sample_track(self.track, self.fps)

    @property
    def source(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Clip, mirrored, clip_frame and stride per frame, in the order that `played` functions take."""
        return self.played.clip, self.played.mirrored, self.played.clip_frame, self.stride

    def interpolate_planned_heading(self, times: np.ndarray) -> np.ndarray | None:
        """Interpolate the heading that was planned for the take, constant beyond its ends.

        Args:
            times: (N,) s on the track's clock.
        Returns:
            (N,) rad, unwrapped; None where it is not known.
        """
        planned = self.played.planned_heading
        known = np.zeros(0, bool) if planned is None else np.isfinite(planned)
        return np.interp(times, self.played.times[known], np.unwrap(planned[known])) if known.any() else None

    def source_values(self, name: str) -> np.ndarray:
        """Return a figure of the uncut recordings at the used frames.

        Args:
            name: a field of `LibraryReference`.
        Returns:
            (U, ...), empty without a library.
        """
        return np.zeros(0) if self.reference is None else getattr(self.reference, name)[self.used_rows]

    def _find_reference_rows(self) -> np.ndarray:
        if self.reference is None:
            return np.full(self.count, np.nan)
        return self.reference.find_rows(self.played.clips, self.played.clip, self.played.clip_frame)


def compute_scale(skeleton: Skeleton, library: Skeleton) -> float:
    """Compute the stature of a skeleton relative to the library's; InputError if the bones differ otherwise."""
    if skeleton.has_same_bones(library, 5e-3):
        return 1.0
    size = estimate_stature(skeleton) / estimate_stature(library) if skeleton.names == library.names else 1.0
    if not skeleton.has_same_bones(library.scale(size), 5e-3):
        raise InputError("motion", "its skeleton differs from the library's", "a motion from this library")
    return size
