"""The frames of an edit list, fetched from their clips and taken off the ground: poses in their own facing frame.

What is left of a clip's place in the world are differences: how the body sways about its path, how fast it goes in
which direction as seen from its facing, and how it turns. Whoever lays the motion on the ground decides the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...library.library import Library
from ...motion import quaternion
from ...motion.motion import at_frames
from .edit_list import EditList, at_times

_HELD = 2  # frames for which a clip's end may be held in a fade


@dataclass(frozen=True, eq=False)
class Shown:
    """What T output frames show: clip (T,), frame (T,) place among the library's frames, clip_frame (T,) in the clip's
    own rate, piece (T,) of the edit list."""

    clip: np.ndarray
    frame: np.ndarray
    clip_frame: np.ndarray
    piece: np.ndarray

    @property
    def seams(self) -> np.ndarray:
        """Output frames (S,) that begin another piece."""
        return np.flatnonzero(np.diff(self.piece)) + 1


@dataclass(frozen=True, eq=False)
class Footage(Shown):
    """T output frames with what they show.

    pose (T, J, 4) local rotations, the root's relative to its facing; height (T,) m of the root; sway (T, 2) m from the
    clip's path to the root, in the facing frame; velocity (T, 2) m/s of the path as played, in the facing frame; turn
    (T,) radians of facing since the frame before, 0 at a seam; standing (T, 2, 2) bool of heels and toes. ahead_*: the
    same for the frame that the piece before would have shown at each seam, (S, ...)."""

    pose: np.ndarray
    height: np.ndarray
    sway: np.ndarray
    velocity: np.ndarray
    turn: np.ndarray
    standing: np.ndarray
    ahead_pose: np.ndarray
    ahead_height: np.ndarray
    ahead_sway: np.ndarray


def output_index(frames: int, library: Library, fps: float, count: int) -> np.ndarray:
    """(frames,) output frames at `fps` as fractional frames of the library's rate, of which there are `count`."""
    return np.minimum(np.arange(frames) * (library.fps / fps), count - 1)


def shown(library: Library, edit: EditList, index: np.ndarray) -> Shown:
    """What fractional output frames `index` (T,) of the library's rate show."""
    clip, frame, piece = at_times(edit, index)
    return Shown(clip, frame, _clip_frames(library, clip, frame), piece)


def fetch(library: Library, edit: EditList, index: np.ndarray, rate: float) -> Footage:
    """Footage at fractional output frames `index` (T,) of the library's rate; `rate`: output frames per second."""
    what = shown(library, edit, index)
    clip, frame, seams = what.clip, what.frame, what.seams
    pose, height, sway, heading = _poses(library, clip, frame)
    played = np.gradient(frame) if len(frame) > 1 else np.ones(len(frame))
    for edge in seams:  # the difference across a seam says nothing about speed
        played[edge - 1] = frame[edge - 1] - frame[edge - 2] if edge > 1 and edge - 1 not in seams else 1.0
        played[edge] = frame[edge + 1] - frame[edge] if edge + 1 < len(frame) and edge + 1 not in seams else 1.0
    velocity = _interpolated(library, clip, frame, library.frames.velocity) * (played * rate / library.fps)[:, None]
    turn = np.diff(heading, prepend=heading[:1])
    turn[seams] = 0.0
    before = seams - 1
    ahead_frame = frame[before] + played[before]
    ahead = _poses(library, clip[before], ahead_frame)
    return Footage(
        clip, frame, what.clip_frame, what.piece, pose, height, sway, velocity, turn, _standing(library, clip, frame),
        *ahead[:3],
    )


@dataclass(frozen=True, eq=False)
class Overlap:
    """What the pieces on both sides of a seam show beyond it, R frames in all.

    at (R,) output frame, no frame twice; through (R,) how far the window around the seam has come there, between 0 and
    1; after (R,) bool: behind the seam, where the other piece is the one that ends. pose (R, J, 4), height (R,) m, sway
    (R, 2) m of the other piece."""

    at: np.ndarray
    through: np.ndarray
    after: np.ndarray
    pose: np.ndarray
    height: np.ndarray
    sway: np.ndarray


def overlap(library: Library, footage: Footage, reach: float) -> Overlap:
    """At most `reach` frames on either side of each seam, and half of the shorter neighbouring piece.

    A clip that ends sooner shortens its side, but for a frame or two in which its end is held."""
    edges = np.concatenate([[0], footage.seams, [len(footage.clip)]])
    none = np.zeros(0)
    rows = [_around(library, footage, edges[n : n + 3], reach) for n in range(len(footage.seams))]
    at, through, after, clip, frame = (np.concatenate(column) for column in zip((none, none, none, none, none), *rows))
    shown = _poses(library, clip.astype(int), frame)[:3]
    return Overlap(at.astype(int), through, after.astype(bool), *shown)


def _around(library: Library, footage: Footage, edges: np.ndarray, reach: float):
    """Output frames around the seam between two pieces, edges (3,), how far through, whether behind it, and clip and
    frame that the other piece shows there."""
    low, seam, high = (int(edge) for edge in edges)
    clip, frame, frames = footage.clip, footage.frame, library.frames
    ends, begins = clip[seam - 1], clip[seam]
    out = frame[seam - 1] - frame[seam - 2] if seam - low > 1 else 1.0
    into = frame[seam + 1] - frame[seam] if high - seam > 1 else 1.0
    left = (frames.first[ends] + frames.count[ends] - 1 - frame[seam - 1]) / max(out, 1e-3)
    room = (frame[seam] - frames.first[begins]) / max(into, 1e-3)
    before = int(min(reach, (seam - low) // 2, max(room, _HELD)))
    behind = int(min(reach, (high - seam) // 2, max(left, _HELD)))
    at = np.arange(seam - before, seam + behind)
    after = at >= seam
    other = np.where(after, frame[seam - 1] + out * (at - seam + 1), frame[seam] + into * (at - seam))
    through = np.arange(1, len(at) + 1) / (len(at) + 1.0)
    return at, through, after, np.where(after, ends, begins), other


def _clip_frames(library: Library, clip: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Fractional frames in the clips' own rates, held at the clips' ends."""
    rates = np.array([c.motion.fps for c in library.clips]) / library.fps
    lengths = np.array([len(c.motion) for c in library.clips])
    return np.clip((frame - library.frames.first[clip]) * rates[clip], 0, lengths[clip] - 1)


def _poses(library: Library, clip: np.ndarray, frame: np.ndarray):
    """Pose, height, sway and heading at library frames; each clip is read once."""
    count, joints = len(clip), len(library.skeleton)
    pose, root = np.empty((count, joints, 4)), np.empty((count, 3))
    own = _clip_frames(library, clip, frame)
    for number in np.unique(clip):
        at = np.flatnonzero(clip == number)
        root[at], pose[at] = at_frames(library.clips[number].motion, own[at])
    heading = _interpolated(library, clip, frame, library.frames.heading)
    path = _interpolated(library, clip, frame, library.frames.path)
    back = quaternion.about_up(-heading)
    pose[:, 0] = quaternion.multiply(back, pose[:, 0])
    away = np.concatenate([root[:, :2] - path, np.zeros((count, 1))], axis=1)
    return pose, root[:, 2], quaternion.rotate(back, away)[:, :2], heading


def _interpolated(library: Library, clip: np.ndarray, frame: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Linear interpolation of per-frame `values` (N, ...) within clips, held at their ends."""
    first = library.frames.first[clip]
    at = np.clip(frame, first, first + library.frames.count[clip] - 1)
    low = np.minimum(np.floor(at).astype(int), np.maximum(first + library.frames.count[clip] - 2, first))
    high = np.minimum(low + 1, first + library.frames.count[clip] - 1)
    weight = (at - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1.0 - weight) + values[high] * weight


def _standing(library: Library, clip: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """(T, 2, 2) bool, from the nearest frame of each clip."""
    own = np.round(_clip_frames(library, clip, frame)).astype(int)
    out = np.zeros((len(clip), 2, 2), bool)
    for number in np.unique(clip):
        at = clip == number
        out[at] = library.clips[number].standing[own[at]]
    return out
