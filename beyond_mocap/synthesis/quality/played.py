"""What was played: a body's motion, the ball, where every frame came from, and the pieces of clips that it is made of;
the same from memory and from files.

Pieces are read off clip (T,) an integer per clip (negative where unknown), mirrored (T,) bool, clip_frame (T,)
fractional in the clip's own rate, and `stride` (T,), the source frames that pass in one output frame at recorded speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...library.landings import LANDING_FOLDER
from ...library.library import Library
from ...library.made import FPS as MADE_FPS
from ...library.made import MADE_FOLDER
from ...motion import contacts as foot_contacts
from ...motion.humanoid import Humanoid, identify
from ...motion.motion import Motion, forward_kinematics
from ...motion.track.ball_path import BallPath
from ..take import KeyResult, Take
from .movement import foot_joints

LOOP_SECONDS = 4.0
LOOP_REACH = 80.0 / 60.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Played:
    """One player's take as evaluation sees it.

    motion: T frames on the pitch; frame 0 is at `start_time` s on the track's clock. clips: table of clip paths below
    the library; clip (T,) int index into it, -1 where the source is not known; clip_frame (T,) fractional frame in that
    clip's own rate, NaN where not known; mirrored (T,) bool. words: T word tuples of the source frames, sides after
    mirroring, or None. contacts (T, 2) bool, left and right. ball: as written out, or None. correction (T, 2) m each
    foot was moved by polish, or None. keys: how key moments were served, empty where only files tell."""

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

    @property
    def times(self) -> np.ndarray:
        """Seconds (T,) on the track's clock."""
        return self.start_time + np.arange(len(self.motion)) / self.motion.fps

    @cached_property
    def body(self) -> Humanoid:
        """The meaning of the skeleton's joints."""
        return identify(self.motion.skeleton)

    @cached_property
    def _kinematics(self) -> tuple[np.ndarray, np.ndarray]:
        return forward_kinematics(self.motion)

    @property
    def positions(self) -> np.ndarray:
        """World positions (T, J, 3) m of the joints."""
        return self._kinematics[0]

    @property
    def rotations(self) -> np.ndarray:
        """World rotations (T, J, 4) of the joints."""
        return self._kinematics[1]

    @property
    def pelvis(self) -> np.ndarray:
        """Ground positions (T, 2) m of the hips joint."""
        return self.positions[:, self.body.hips, :2]

    @property
    def feet(self) -> np.ndarray:
        """World positions (T, 2, 2, 3) m: side, (heel, toe)."""
        return self.positions[:, foot_joints(self.motion.skeleton)]

    def stride(self, library: Library | None) -> np.ndarray:
        """Source frames that pass per output frame at recorded speed, (T,); the usual step of clips whose own rate is
        not known, as it is without a library."""
        known = {} if library is None else {clip.path: clip.motion.fps for clip in library.clips}
        rates = np.ones(len(self.clips) + 1)
        for index, path in enumerate(self.clips):
            fps = MADE_FPS if path.startswith(MADE_FOLDER) else known.get(path.removeprefix(LANDING_FOLDER))
            rates[index] = fps / self.motion.fps if fps else _usual_step(self.clip_frame, self.clip == index)
        return rates[self.clip]


def played_from_take(take: Take) -> Played:
    """What a take in memory plays."""
    return Played(
        motion=take.motion, start_time=take.start_time, clips=tuple(take.clips), clip=np.asarray(take.clip, dtype=int),
        clip_frame=np.asarray(take.clip_frame, dtype=float), mirrored=np.asarray(take.mirrored, dtype=bool),
        words=tuple(take.words), contacts=np.asarray(take.contacts, dtype=bool), ball=take.ball,
        correction=take.correction, keys=tuple(take.keys),
    )


def played_from_tables(
    motion: Motion, provenance=None, ball: BallPath | None = None, start_time: float = 0.0, where: str = "provenance"
) -> Played:
    """What a motion read from a file plays, with its provenance and ball where they are known.

    provenance: `synthesis.provenance.Provenance`, or anything with its arrays: times (T,) s, clip (T paths),
    clip_frame (T,), mirrored (T,) bool, words (T tuples), contacts (T, 2) bool. Without it the motion starts at
    `start_time` and contacts are detected on the motion itself. where: the table's file, for messages. InputError where
    it has another length."""
    count = len(motion)
    if provenance is None:
        unknown, nowhere, plain = np.full(count, -1), np.full(count, np.nan), np.zeros(count, bool)
        return Played(motion=motion, start_time=start_time, clips=(), clip=unknown, clip_frame=nowhere, mirrored=plain,
                      words=None, contacts=foot_contacts.detect(motion), ball=ball)
    if len(provenance.clip) != count:
        raise InputError(where, f"{len(provenance.clip)} rows", f"one per frame of the motion, {count}")
    clips, index = np.unique(np.asarray(provenance.clip, dtype=str), return_inverse=True)
    return Played(
        motion=motion, start_time=float(provenance.times[0]), clips=tuple(str(clip) for clip in clips),
        clip=index.reshape(-1), clip_frame=np.asarray(provenance.clip_frame, dtype=float),
        mirrored=np.asarray(provenance.mirrored, dtype=bool), words=tuple(map(tuple, provenance.words)),
        contacts=np.asarray(provenance.contacts, dtype=bool), ball=ball,
    )


def find_transitions(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Output frames (S,) that start a new piece: the clip (or its mirroring) changes, or clip_frame jumps.

    A jump is a step of more than 1.5 frames times the warp there, in frames of the output's rate, or of less than half
    of it (a step back, a repeated stretch). The warp is the median rate of up to four steps on either side."""
    rate = played_rate(clip, mirrored, clip_frame, stride)
    known = (clip[1:] >= 0) | (clip[:-1] >= 0)
    warp = np.maximum(_neighbours_median(rate), 0.25)
    jump = (rate > 1.5 * warp) | (rate < 0.5 * warp)
    return np.flatnonzero(known & (np.isnan(rate) | jump)) + 1


def number_pieces(count: int, starts: np.ndarray) -> np.ndarray:
    """Number of the run that each of `count` frames belongs to: (T,) int, one more at every seam in `starts`."""
    flags = np.zeros(count, dtype=int)
    flags[starts] = 1
    return np.cumsum(flags)


def played_rate(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Played / recorded speed from each frame to the next: (T-1,), NaN where the clip changes or is not known."""
    rate = np.diff(clip_frame) / stride[:-1]
    same = (clip[1:] == clip[:-1]) & (mirrored[1:] == mirrored[:-1]) & (clip[1:] >= 0)
    return np.where(same, rate, np.nan)


def warp_rates(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Played / recorded speed of every step inside a run: (N,)."""
    rate = played_rate(clip, mirrored, clip_frame, stride)
    rate[find_transitions(clip, mirrored, clip_frame, stride) - 1] = np.nan
    return rate[np.isfinite(rate)]


def find_replayed(
    clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray, fps: float
) -> np.ndarray:
    """Frames that replay a stretch played less than 4 s before: (T,) bool.

    A frame replays where an earlier run of the same clip (same side) showed a frame within 80 source frames at 60 fps
    (1.33 s of the clip) of it in the last 4 s. A run that starts beyond everything the earlier run showed only skipped
    ahead, and does not count."""
    number = number_pieces(len(clip), find_transitions(clip, mirrored, clip_frame, stride))
    first, last = np.full(number[-1] + 1, np.inf), np.full(number[-1] + 1, -np.inf)
    np.fmin.at(first, number, clip_frame)
    np.fmax.at(last, number, clip_frame)
    out = np.zeros(len(clip), dtype=bool)
    for lag in range(1, min(int(np.ceil(LOOP_SECONDS * fps)), len(clip))):
        same = (clip[lag:] == clip[:-lag]) & (mirrored[lag:] == mirrored[:-lag]) & (clip[lag:] >= 0)
        other = same & (number[lag:] != number[:-lag]) & (first[number[lag:]] < last[number[:-lag]])
        near = np.abs(clip_frame[lag:] - clip_frame[:-lag]) < LOOP_REACH * fps * stride[lag:]
        out[lag:] |= other & near
    return out


def _usual_step(clip_frame: np.ndarray, mine: np.ndarray) -> float:
    steps = np.diff(clip_frame)[mine[1:] & mine[:-1]]
    forward = steps[steps > 0]
    return float(np.median(forward)) if len(forward) else 1.0


def _neighbours_median(rate: np.ndarray, reach: int = 4) -> np.ndarray:
    """Median of the finite rates up to `reach` steps away on either side, the step itself left out; 1 where there are
    none."""
    padded = np.pad(rate, reach, constant_values=np.nan)
    around = np.stack([padded[reach + k : reach + k + len(rate)] for k in range(-reach, reach + 1) if k])
    around[~np.isfinite(around)] = np.nan
    around.sort(axis=0)
    count = np.sum(np.isfinite(around), axis=0)
    column = np.arange(len(rate))
    low, high = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, np.maximum(count - 1, 0))
    return np.where(count > 0, 0.5 * (around[low, column] + around[high, column]), 1.0)
