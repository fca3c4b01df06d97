"""A take beside its track and the recordings of its library: what all figures of a report share."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..annotation import Timeline
from ..base.errors import InputError
from ..library.library import Library
from ..motion.humanoid import estimate_stature, identify_joints
from ..motion.motion import Motion, compute_pose, sample_frames
from ..motion.skeleton import Skeleton
from ..motion.track import SampledTrack, Track, sample_track
from ..synthesis.quality import movement
from ..synthesis.quality.moments import evaluate_moments
from ..synthesis.quality.playback import Playback, find_transitions
from .naturalness import BodyCourse, measure_course
from .reference.reference_cache import load_reference


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
    def root_error(self) -> np.ndarray:
        """(T,) m, of `movement.measure_root_error`; the track has to be known."""
        return movement.measure_root_error(self.played.pelvis, self.target, self.fps)

    @cached_property
    def pelvis_error(self) -> np.ndarray:
        """(T,) m, of `movement.measure_pelvis_error`; the track has to be known."""
        return movement.measure_pelvis_error(self.played.pelvis, self.target)

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


def measure_source_heights(library: Library, clips: tuple[str, ...], clip, mirrored, clip_frame) -> np.ndarray:
    """Measure the height of the hips in the recorded pose of each output frame's source.

    Args:
        library: the library.
        clips: table of paths.
        clip: (T,) int, index into the table, -1 if unknown.
        mirrored: (T,) bool.
        clip_frame: (T,) at the clip's own frame rate.
    Returns:
        (T,) m, rounded to float32, NaN if unknown.
    """
    table = {(source.path, source.mirrored): source.motion for source in library.clips}
    hips = identify_joints(library.skeleton).hips
    skeleton, joints = library.skeleton.select_joints([hips])
    out = np.full(len(clip), np.nan)
    for number, side in set(zip(clip.tolist(), mirrored.tolist())):
        motion = table.get((clips[number], side)) if number >= 0 else None
        if motion is None:
            continue
        selected = (clip == number) & (mirrored == side)
        chain = Motion.from_stored(skeleton, motion.root_positions, motion.rotations[:, joints], motion.fps)
        positions = compute_pose(skeleton, *sample_frames(chain, clip_frame[selected]))[0]
        out[selected] = positions[:, joints.index(hips), 2].astype(np.float32)
    return out


def compute_scale(skeleton: Skeleton, library: Skeleton) -> float:
    """Compute the stature of a skeleton relative to the library's; InputError if the bones differ otherwise."""
    if skeleton.has_same_bones(library, 5e-3):
        return 1.0
    size = estimate_stature(skeleton) / estimate_stature(library) if skeleton.names == library.names else 1.0
    if not skeleton.has_same_bones(library.scale(size), 5e-3):
        raise InputError("motion", "its skeleton differs from the library's", "a motion from this library")
    return size
