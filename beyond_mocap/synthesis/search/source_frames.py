"""Source frames of an edit list, fetched from their clips as poses in their own facing frame.

What is left of a clip's place in the world are differences: how the body sways about its path, how fast it moves in
which direction as seen from its facing, and how it turns. The construction decides the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...library.library import Library
from ...motion import quaternion
from ...motion.motion import sample_motions
from .edit_list import EditList, sample_edit

_HELD = 2  # frames for which a clip's end may be held in a blend


@dataclass(frozen=True, eq=False)
class SourceFrames:
    """What T output frames show.

    Attributes:
        clip: (T,) clip index.
        frame: (T,) fractional library frame.
        clip_frame: (T,) fractional frame in the clip's own rate.
        piece: (T,) number of the piece of the edit list.
    """

    clip: np.ndarray
    frame: np.ndarray
    clip_frame: np.ndarray
    piece: np.ndarray

    @property
    def transitions(self) -> np.ndarray:
        """(S,) output frames that begin another piece."""
        return np.flatnonzero(np.diff(self.piece)) + 1


@dataclass(frozen=True, eq=False)
class SourceMotion(SourceFrames):
    """T output frames with the motion that they show.

    Attributes:
        pose: (T, J, 4) local rotations, the root's relative to its facing.
        height: (T,) m of the root.
        sway: (T, 2) m from the clip's path to the root, facing frame.
        velocity: (T, 2) m/s of the path as played, facing frame.
        turn: (T,) rad of facing since the frame before, 0 at a transition.
        heel_toe_contacts: (T, 2, 2) bool, heel and toe contacts.
        ahead_pose: (S, J, 4), the same for the frame that the piece before would have shown at each transition.
        ahead_height: (S,) m of it.
        ahead_sway: (S, 2) m of it.
    """

    pose: np.ndarray
    height: np.ndarray
    sway: np.ndarray
    velocity: np.ndarray
    turn: np.ndarray
    heel_toe_contacts: np.ndarray
    ahead_pose: np.ndarray
    ahead_height: np.ndarray
    ahead_sway: np.ndarray


def output_index(frames: int, library: Library, fps: float, count: int) -> np.ndarray:
    """Convert output frames to fractional frames at the library's rate.

    Args:
        frames: number of output frames.
        library: the clips.
        fps: output frames per second.
        count: number of frames at the library's rate.
    Returns:
        (frames,) fractional frames.
    """
    return np.minimum(np.arange(frames) * (library.fps / fps), count - 1)


def look_up_frames(library: Library, edit: EditList, index: np.ndarray) -> SourceFrames:
    """Look up what output frames show.

    Args:
        library: the clips.
        edit: the edit list.
        index: (T,) fractional frames at the library's rate.
    """
    clip, frame, piece = sample_edit(edit, index)
    return SourceFrames(clip, frame, _to_clip_frames(library, clip, frame), piece)


def fetch_motion(library: Library, edit: EditList, index: np.ndarray, fps: float) -> SourceMotion:
    """Fetch source frames with their motion.

    Args:
        library: the clips.
        edit: the edit list.
        index: (T,) fractional frames at the library's rate.
        fps: output frames per second.
    """
    frames = look_up_frames(library, edit, index)
    clip, frame, transitions = frames.clip, frames.frame, frames.transitions
    pose, height, sway, heading = _fetch_poses(library, clip, frame)
    played = np.gradient(frame) if len(frame) > 1 else np.ones(len(frame))
    # library frames per output frame; a difference across a transition says nothing, so it is taken from one side
    for edge in transitions:
        played[edge - 1] = frame[edge - 1] - frame[edge - 2] if edge > 1 and edge - 1 not in transitions else 1.0
        played[edge] = frame[edge + 1] - frame[edge] if edge + 1 < len(frame) and edge + 1 not in transitions else 1.0
    velocity = _interpolate_in_clips(library, clip, frame, library.frames.velocity) * (played * fps / library.fps)[:,
            None]
    turn = np.diff(heading, prepend=heading[:1])
    turn[transitions] = 0.0
    before = transitions - 1
    ahead_frame = frame[before] + played[before]
    ahead = _fetch_poses(library, clip[before], ahead_frame)
    return SourceMotion(
        clip, frame, frames.clip_frame, frames.piece, pose, height, sway, velocity, turn,
        look_up_contacts(library, frames), *ahead[:3],
    )


@dataclass(frozen=True, eq=False)
class Overlap:
    """What the pieces on both sides of each transition show beyond it, R frames in all.

    Attributes:
        at: (R,) output frame, no frame twice.
        through: (R,) progress of the window around the transition there, between 0 and 1.
        after: (R,) bool, behind the transition, where the other piece is the one that ends.
        pose: (R, J, 4) of the other piece.
        height: (R,) m of the other piece.
        sway: (R, 2) m of the other piece.
    """

    at: np.ndarray
    through: np.ndarray
    after: np.ndarray
    pose: np.ndarray
    height: np.ndarray
    sway: np.ndarray


def fetch_overlap(library: Library, source: SourceMotion, reach: float) -> Overlap:
    """Fetch the overlap of neighbouring pieces.

    It reaches `reach` frames to either side of each transition, at most half of the shorter piece. A clip that ends
    sooner shortens its side, except for a frame or two in which its end is held.
    """
    edges = np.concatenate([[0], source.transitions, [len(source.clip)]])
    none = np.zeros(0)
    rows = [_compute_overlap(library, source, edges[n : n + 3], reach) for n in range(len(source.transitions))]
    at, through, after, clip, frame = (np.concatenate(column) for column in zip((none, none, none, none, none), *rows))
    poses = _fetch_poses(library, clip.astype(int), frame)[:3]
    return Overlap(at.astype(int), through, after.astype(bool), *poses)


def _compute_overlap(library: Library, source: SourceMotion, edges: np.ndarray, reach: float):
    """Compute the overlap around one transition.

    Args:
        edges: (3,) output frames: start of the piece before, transition, end of the piece after.
    Returns:
        Output frames, progress, whether behind the transition, and clip and frame that the other piece shows there.
    """
    low, transition, high = (int(edge) for edge in edges)
    clip, frame, frames = source.clip, source.frame, library.frames
    ends, begins = clip[transition - 1], clip[transition]
    out = frame[transition - 1] - frame[transition - 2] if transition - low > 1 else 1.0
    into = frame[transition + 1] - frame[transition] if high - transition > 1 else 1.0
    # output frames until the piece before runs out of its clip, and before the piece after begins in its clip
    left = (frames.first[ends] + frames.count[ends] - 1 - frame[transition - 1]) / max(out, 1e-3)
    room = (frame[transition] - frames.first[begins]) / max(into, 1e-3)
    before = int(min(reach, (transition - low) // 2, max(room, _HELD)))
    behind = int(min(reach, (high - transition) // 2, max(left, _HELD)))
    at = np.arange(transition - before, transition + behind)
    after = at >= transition
    # each piece continued beyond the transition at its own playback rate
    other = np.where(after, frame[transition - 1] + out * (at - transition + 1), frame[transition] + into
                     * (at - transition))
    through = np.arange(1, len(at) + 1) / (len(at) + 1.0)
    return at, through, after, np.where(after, ends, begins), other


def _to_clip_frames(library: Library, clip: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Convert library frames to fractional frames in the clips' own rates, held at the clips' ends."""
    shown, place = np.unique(clip, return_inverse=True)
    motions = [library.clips[number].motion for number in shown]
    rates = np.array([motion.fps for motion in motions]) / library.fps
    lengths = np.array([len(motion) for motion in motions])
    return np.clip((frame - library.frames.first[clip]) * rates[place], 0, lengths[place] - 1)


def _fetch_poses(library: Library, clip: np.ndarray, frame: np.ndarray):
    """Fetch pose, height, sway and heading at library frames; each clip is read once."""
    count = len(clip)
    own = _to_clip_frames(library, clip, frame)
    order = np.argsort(clip, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(clip[order])) + 1) if count else []
    root, pose = sample_motions([library.clips[clip[at[0]]].motion for at in groups], groups, own, library.skeleton)
    heading = _interpolate_in_clips(library, clip, frame, library.frames.heading)
    path = _interpolate_in_clips(library, clip, frame, library.frames.path)
    back = quaternion.from_up_angle(-heading)
    pose[:, 0] = quaternion.multiply(back, pose[:, 0])
    away = np.concatenate([root[:, :2] - path, np.zeros((count, 1))], axis=1)
    return pose, root[:, 2], quaternion.rotate(back, away)[:, :2], heading


def _interpolate_in_clips(library: Library, clip: np.ndarray, frame: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate per-frame values (N, ...) linearly within clips, held at their ends."""
    first = library.frames.first[clip]
    at = np.clip(frame, first, first + library.frames.count[clip] - 1)
    low = np.minimum(np.floor(at).astype(int), np.maximum(first + library.frames.count[clip] - 2, first))
    high = np.minimum(low + 1, first + library.frames.count[clip] - 1)
    weight = (at - low).reshape(-1, *[1] * (values.ndim - 1))
    return values[low] * (1.0 - weight) + values[high] * weight


def look_up_contacts(library: Library, frames: SourceFrames) -> np.ndarray:
    """Look up heel and toe contacts (T, 2, 2) bool at the nearest frame of each clip."""
    own = np.round(frames.clip_frame).astype(int)
    out = np.zeros((len(own), 2, 2), bool)
    for number in np.unique(frames.clip):
        at = frames.clip == number
        out[at] = library.clips[number].heel_toe_contacts[own[at]]
    return out
