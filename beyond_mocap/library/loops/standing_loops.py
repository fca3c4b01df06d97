"""Long stands from the short ones that recordings have.

People in recordings stand for a second or three between two actions; players stand for ten. Each calm stand is played
forward and backward again and again, slowing down at both ends, so that no step and no cut is needed only because a
recording is over. Reversed weight shifts look like weight shifts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...base.time_series import find_runs
from ...motion.motion import Motion, sample_frames
from ..features import Frames
from ..posture import PARTS

LOOP_SECONDS = 16.0  # of a loop
MIN_STAND_SECONDS = 1.2  # of recording; less moves too little to look alive
MAX_STANDS = 6
MAX_STANDS_OF_CLIP = 2
_STILL_SPEED = 0.15  # m/s of the root's path
# rad, m and leg lengths that a body turns, shifts its weight and sinks by in one stand: who gets ready to jump, and is
# played forward and backward, squats again and again
_MOST_TURN, _MOST_SHIFT, _MOST_SINKING = np.radians(20.0), 0.08, 0.06


def iter_standing_loops(clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray,
                        rate: float) -> Iterator[tuple[str, Motion]]:
    """Iterate over loops of the longest calm stands of a library.

    Args:
        clips: of the library.
        frames: their description, N frames.
        fps: of the frames.
        strangeness: (N,) how far each frame lies from normal locomotion (`posture`).
        rate: frames per second of the loops.
    Yields:
        The path of the recording, and the loop.
    """
    for index, first, end in find_stands(clips, frames, fps, strangeness):
        clip = clips[index]
        begin, last = frames.source[first], frames.source[end - 1]
        seconds = (last - begin) / clip.motion.fps
        # forward and backward on a cosine whose fastest moment has the recording's own rate
        phase = 2.0 * np.arange(int(LOOP_SECONDS * rate)) / rate / seconds
        source = begin + 0.5 * (last - begin) * (1.0 - np.cos(phase))
        yield clip.path, Motion(clip.motion.skeleton, *sample_frames(clip.motion, source), rate)


def find_stands(clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray) -> list[tuple[int, int, int]]:
    """Find the longest calm stands of recordings: clip, first frame and end of each, the longest first."""
    found, speed = [], frames.speed  # computed over all frames at every access
    for index, clip in enumerate(clips):
        if clip.mirrored or clip.is_synthetic:
            continue
        at = slice(frames.first[index], frames.first[index] + frames.count[index])
        nearest = np.minimum(np.rint(frames.source[at]).astype(int), len(clip.heel_toe_contacts) - 1)
        both = clip.heel_toe_contacts.any(axis=2).all(axis=1)[nearest]
        calm = both & (speed[at] < _STILL_SPEED) & (strangeness[at] <= 1.0)
        moves = np.column_stack([frames.heading[at], frames.path[at], frames.posture[at, PARTS["hips"]]])
        runs = [part for run in find_runs(calm) for part in _split_at_moves(moves, *run)
                if part[1] - part[0] >= MIN_STAND_SECONDS * fps]
        longest = sorted(runs, key=lambda run: run[0] - run[1])[:MAX_STANDS_OF_CLIP]
        found += [(index, at.start + first, at.start + end) for first, end in longest]
    return sorted(found, key=lambda stand: stand[1] - stand[2])[:MAX_STANDS]


def _split_at_moves(moves: np.ndarray, first: int, end: int) -> Iterator[tuple[int, int]]:
    """Split a stand where the body has moved too far for one: (first, end) of each part.

    Args:
        moves: (N, 4) heading rad, place m and height of the hips in leg lengths.
        first, end: frames of the stand.
    """
    values, most = moves[first:end].tolist(), (_MOST_TURN, _MOST_SHIFT, _MOST_SHIFT, _MOST_SINKING)
    start, lowest, highest = first, values[0], values[0]
    for frame, value in enumerate(values, first):
        lowest, highest = list(map(min, lowest, value)), list(map(max, highest, value))
        if any(high - low > limit for low, high, limit in zip(lowest, highest, most)):
            yield start, frame
            start, lowest, highest = frame, value, value
    yield start, end
