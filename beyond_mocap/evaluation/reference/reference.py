"""The scores of a library's uncut recordings, computed once per library and frame rate
(`reference_cache`).

Recordings are measured as they are used: retargeted to the library's skeleton and repaired (`library.repair`). Repair
leaves their jerk nearly unchanged: the 95th percentile moves by 1 % at most where clips keep their speed class, by 4 to
9 % on a library of five bodies whose clips nearly all get other feet.

Every recording is resampled to the output's frame rate and measured frame by frame; a take's own score is then a
look-up of the frames it used. Mirrored clips are not measured again: all figures here are the same for left and right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...annotation.gaits import STANDING
from ...appearance.boots import build_boots
from ...appearance.mesh import BodyMesh
from ...appearance.trunk import build_trunk
from ...base.errors import InputError
from ...library.clip import Clip
from ...library.library import Library
from ...motion.humanoid import Humanoid, identify_joints
from ...motion.motion import concatenate_motions, resample
from ...synthesis.quality import movement
from .. import realism
from ..body_physics import BodyPhysics
from ..naturalness import FPS as COURSE_FPS
from ..naturalness import BodyCourse
from ..touches import Kick
from .recording import Recording, measure_recording

POSES_PER_SECOND = 10.0  # of a recording that are compared with
EXAMPLE_FPS = 1.0  # poses per second of recordings that show how boots hang on the skeleton
LEFT_OUT_POSES = 3000  # poses at most in the leave-one-clip-out estimate


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
        arm_depth: (N,) m, see `Recording`.
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
    arm_depth: np.ndarray

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


def build_reference(library: Library, fps: float) -> LibraryReference:
    """Measure every recording of a library.

    Args:
        library: the library.
        fps: frames per second of the output.
    Returns:
        The reference.
    """
    originals, twins = select_originals(library.clips)
    examples = concatenate_motions([resample(clip.recording, EXAMPLE_FPS) for clip in originals])
    boots = build_boots(library.skeleton, example=examples)
    trunk = build_trunk(library.neutral_stance)
    measured = [measure_recording(clip, fps, boots, trunk) for clip in originals]
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
        fastest=float(joined["speed"].max()), slowest=find_slowest_speed(library),
        courses=tuple(recording.course for recording in measured),
        kicks=tuple(kick for recording in measured for kick in recording.kicks),
        receptions=tuple(speed for recording in measured for speed in recording.receptions),
        physics=tuple(recording.physics for recording in measured), boots=boots, **joined,
    )  # fmt: skip


_JOINED_FIELDS = ("sway", "surge", "speed", "contact_speed", "skating", "support", "tip", "smoothness", "travel",
                  "stands", "contacts", "arm_depth")  # fmt: skip


def select_originals(clips: tuple[Clip, ...]) -> tuple[list[Clip], np.ndarray]:
    """Select one recording per path, unmirrored if possible, and whether its mirrored twin is in the library too (C,).

    Synthetic clips are no recordings.
    """
    chosen: dict[str, Clip] = {}
    count: dict[str, int] = {}
    for clip in sorted((clip for clip in clips if not clip.is_synthetic), key=lambda clip: clip.mirrored):
        chosen.setdefault(clip.path, clip)
        count[clip.path] = count.get(clip.path, 0) + 1
    return list(chosen.values()), np.array([count[path] > 1 for path in chosen])


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


def find_slowest_speed(library: Library) -> float:
    """Find the speed of the slowest gait that travels, m/s; NaN for a library without locomotion."""
    try:
        return min(gait.speed for gait in library.gaits if gait.label != STANDING)
    except InputError:
        return np.nan
