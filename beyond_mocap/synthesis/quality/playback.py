"""Playback: a body's motion, the ball, the source of every frame, and the pieces of clips that it consists of; the same
from memory and from files.

Pieces are read off clip (T,) an integer per clip (negative where unknown), mirrored (T,) bool, clip_frame (T,)
fractional in the clip's own rate, and `stride` (T,), the source frames that pass in one output frame at recorded speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...library.clip import LANDING_FOLDER, SYNTHETIC_FOLDER, SYNTHETIC_FPS
from ...library.folder.recordings import CACHE_FOLDER
from ...library.library import Library
from ...motion import contacts as foot_contacts
from ...motion.humanoid import Humanoid, identify_joints
from ...motion.motion import Motion, forward_kinematics
from ...motion.track.ball_path import BallPath
from ..take import KeyResult, Take
from .movement import list_foot_joints

LOOP_SECONDS = 4.0  # s within which a stretch shown again counts as replayed
LOOP_REACH = 80.0 / 60.0  # s of a clip around a shown frame that count as shown


@dataclass(frozen=True, eq=False, kw_only=True)
class Playback:
    """One player's take as evaluation sees it.

    Attributes:
        motion: T frames on the pitch.
        start_time: s on the track's clock of frame 0.
        clips: table of clip paths below the library.
        clip: (T,) int index into it, -1 where the source is not known.
        clip_frame: (T,) fractional frame in that clip's own rate, NaN where not known.
        mirrored: (T,) bool.
        words: T tuples, labels of the source frames, sides after mirroring; None where not known.
        contacts: (T, 2) bool, left and right foot.
        ball: as written, or None.
        correction: (T, 2) m each foot was moved by foot correction, or None.
        keys: how key moments were served, empty for a take read from files.
        planned_heading: (T,) rad from +x that was planned, NaN or None where that is not known.
    """

    motion: Motion
    start_time: float
    clips: tuple[str, ...]
    clip: np.ndarray
    clip_frame: np.ndarray
    mirrored: np.ndarray
    words: tuple[tuple[str, ...], ...] | None
    contacts: np.ndarray
    ball: BallPath | None = None
    correction: np.ndarray | None = None
    keys: tuple[KeyResult, ...] = ()
    planned_heading: np.ndarray | None = None

    @cached_property
    def times(self) -> np.ndarray:
        """(T,) s on the track's clock."""
        return self.start_time + np.arange(len(self.motion)) / self.motion.fps

    @cached_property
    def body(self) -> Humanoid:
        """The meaning of the skeleton's joints."""
        return identify_joints(self.motion.skeleton)

    @cached_property
    def _kinematics(self) -> tuple[np.ndarray, np.ndarray]:
        """World positions and rotations of the joints, computed once."""
        return forward_kinematics(self.motion)

    @property
    def positions(self) -> np.ndarray:
        """(T, J, 3) m, world positions of the joints."""
        return self._kinematics[0]

    @property
    def rotations(self) -> np.ndarray:
        """(T, J, 4) world rotations of the joints."""
        return self._kinematics[1]

    @property
    def pelvis(self) -> np.ndarray:
        """(T, 2) m, ground positions of the hips joint."""
        return self.positions[:, self.body.hips, :2]

    @property
    def feet(self) -> np.ndarray:
        """(T, 2, 2, 3) m, world positions: side, (heel, toe)."""
        return self.positions[:, list_foot_joints(self.motion.skeleton)]

    def list_unknown_clips(self, library: Library) -> list[str]:
        """List the clips that are neither in a library nor in its cache folder, where synthetic ones are."""
        known = {clip.path for clip in library.clips}
        return [clip for clip in self.clips if clip and clip not in known and not clip.startswith(CACHE_FOLDER)]

    def compute_stride(self, library: Library | None) -> np.ndarray:
        """Compute the source frames that pass per output frame at recorded speed.

        For clips whose own rate is not known, as without a library, this is their usual step.

        Args:
            library: the recordings, or None.
        Returns:
            (T,).
        """
        known = {} if library is None else {clip.path: clip.motion.fps for clip in library.clips}
        rates = np.ones(len(self.clips) + 1)
        for index, path in enumerate(self.clips):
            fps = SYNTHETIC_FPS if path.startswith(SYNTHETIC_FOLDER) else known.get(path.removeprefix(LANDING_FOLDER))
            rates[index] = fps / self.motion.fps if fps else _measure_usual_step(self.clip_frame, self.clip == index)
        return rates[self.clip]


def playback_from_take(take: Take) -> Playback:
    """Build the playback of a take in memory."""
    return Playback(
        motion=take.motion, start_time=take.start_time, clips=tuple(take.clips), clip=np.asarray(take.clip, dtype=int),
        clip_frame=np.asarray(take.clip_frame, dtype=float), mirrored=np.asarray(take.mirrored, dtype=bool),
        words=tuple(take.words), contacts=np.asarray(take.contacts, dtype=bool), ball=take.ball,
        correction=take.correction, keys=tuple(take.keys), planned_heading=take.planned_heading,
    )


def playback_from_tables(
    motion: Motion, provenance=None, ball: BallPath | None = None, start_time: float = 0.0, where: str = "provenance"
) -> Playback:
    """Build the playback of a motion read from a file, with its provenance and ball where they are known.

    Without provenance contacts are detected on the motion itself.

    Args:
        motion: T frames.
        provenance: `synthesis.provenance.Provenance`, or anything with its arrays: times (T,) s, clip (T paths),
            clip_frame (T,), mirrored (T,) bool, words (T tuples), contacts (T, 2) bool, planned_heading (T,) rad or
            None.
        ball: the ball's path.
        start_time: s of frame 0 where there is no provenance.
        where: the table's file, for messages.
    Raises:
        InputError: where the provenance has another length.
    """
    count = len(motion)
    if provenance is None:
        unknown, nowhere, plain = np.full(count, -1), np.full(count, np.nan), np.zeros(count, bool)
        return Playback(motion=motion, start_time=start_time, clips=(), clip=unknown, clip_frame=nowhere,
                        mirrored=plain, words=None, contacts=foot_contacts.detect_contacts(motion), ball=ball)
    if len(provenance.clip) != count:
        raise InputError(where, f"{len(provenance.clip)} rows", f"one per frame of the motion, {count}")
    clips, index = np.unique(np.asarray(provenance.clip, dtype=str), return_inverse=True)
    return Playback(
        motion=motion, start_time=float(provenance.times[0]), clips=tuple(str(clip) for clip in clips),
        clip=index.reshape(-1), clip_frame=np.asarray(provenance.clip_frame, dtype=float),
        mirrored=np.asarray(provenance.mirrored, dtype=bool), words=tuple(map(tuple, provenance.words)),
        contacts=np.asarray(provenance.contacts, dtype=bool), ball=ball,
        planned_heading=getattr(provenance, "planned_heading", None),
    )


def find_transitions(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Find the output frames that start a new piece: the clip (or its mirroring) changes, or clip_frame jumps.

    A jump is a step of more than 1.5 frames times the warp there, in frames of the output's rate, or of less than half
    of it (a step back, a repeated stretch). The warp is the median rate of up to four steps on either side.

    Args:
        clip: (T,) int.
        mirrored: (T,) bool.
        clip_frame: (T,).
        stride: (T,).
    Returns:
        (S,) frames.
    """
    rate = compute_playback_rate(clip, mirrored, clip_frame, stride)
    known = (clip[1:] >= 0) | (clip[:-1] >= 0)
    warp = np.maximum(_compute_neighbour_median(rate), 0.25)
    jump = (rate > 1.5 * warp) | (rate < 0.5 * warp)
    return np.flatnonzero(known & (np.isnan(rate) | jump)) + 1


def number_pieces(count: int, starts: np.ndarray) -> np.ndarray:
    """Number the pieces: (T,) int, one more at every transition in `starts`."""
    flags = np.zeros(count, dtype=int)
    flags[starts] = 1
    return np.cumsum(flags)


def compute_playback_rate(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray,
                          stride: np.ndarray) -> np.ndarray:
    """Compute the playback rate (played / recorded speed) from each frame to the next.

    Returns:
        (T-1,), NaN where the clip changes or is not known.
    """
    rate = np.diff(clip_frame) / stride[:-1]
    same = (clip[1:] == clip[:-1]) & (mirrored[1:] == mirrored[:-1]) & (clip[1:] >= 0)
    return np.where(same, rate, np.nan)


def list_warp_rates(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Compute the playback rate of every step inside a piece: (N,)."""
    rate = compute_playback_rate(clip, mirrored, clip_frame, stride)
    rate[find_transitions(clip, mirrored, clip_frame, stride) - 1] = np.nan
    return rate[np.isfinite(rate)]


def find_replayed(
    clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray, fps: float
) -> np.ndarray:
    """Find frames that replay a stretch played less than 4 s before.

    A frame replays where an earlier piece of the same clip (same side) showed a frame within 80 source frames at 60 fps
    (1.33 s of the clip) of it in the last 4 s. A piece that starts beyond everything the earlier one showed only
    skipped ahead, and does not count.

    Returns:
        (T,) bool.
    """
    number = number_pieces(len(clip), find_transitions(clip, mirrored, clip_frame, stride))
    # first and last clip frame of each piece
    first, last = np.full(number[-1] + 1, np.inf), np.full(number[-1] + 1, -np.inf)
    np.fmin.at(first, number, clip_frame)
    np.fmax.at(last, number, clip_frame)
    out = np.zeros(len(clip), dtype=bool)
    # compare every frame with the one `lag` frames earlier
    for lag in range(1, min(int(np.ceil(LOOP_SECONDS * fps)), len(clip))):
        same = (clip[lag:] == clip[:-lag]) & (mirrored[lag:] == mirrored[:-lag]) & (clip[lag:] >= 0)
        other = same & (number[lag:] != number[:-lag]) & (first[number[lag:]] < last[number[:-lag]])
        near = np.abs(clip_frame[lag:] - clip_frame[:-lag]) < LOOP_REACH * fps * stride[lag:]
        out[lag:] |= other & near
    return out


def _measure_usual_step(clip_frame: np.ndarray, of_clip: np.ndarray) -> float:
    """Return the median step forward of one clip's frames, 1 without any."""
    steps = np.diff(clip_frame)[of_clip[1:] & of_clip[:-1]]
    forward = steps[steps > 0]
    return float(np.median(forward)) if len(forward) else 1.0


def _compute_neighbour_median(rate: np.ndarray, reach: int = 4) -> np.ndarray:
    """Compute the median of the finite rates up to `reach` steps away on either side, the step itself left out.

    1 where there are none.
    """
    padded = np.pad(rate, reach, constant_values=np.nan)
    around = np.stack([padded[reach + k : reach + k + len(rate)] for k in range(-reach, reach + 1) if k])
    # sorted, NaN come last: the median is the mean of the two middle ones of the `count` finite values
    around[~np.isfinite(around)] = np.nan
    around.sort(axis=0)
    count = np.sum(np.isfinite(around), axis=0)
    column = np.arange(len(rate))
    low, high = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, np.maximum(count - 1, 0))
    return np.where(count > 0, 0.5 * (around[low, column] + around[high, column]), 1.0)
