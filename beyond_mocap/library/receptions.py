"""Receptions cut out of dribbles: touches in which the foot gives with the ball, for libraries without a labelled one.

No recording shows where its ball was. But in a dribble a foot that is held out in the air, slowly, and is then drawn
back without stepping on the ground takes or stops a ball; a foot that pushes the ball swings on, and one that steps
lands at once. The rules look at that: forward, then back, and slow against the body all the time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..annotation.ball_contact import TAKING, shows_foot_on_ball
from ..annotation.labels import list_labels
from ..annotation.vocabulary import SIDES
from .features import FPS, Frames
from .keys import Key

_AHEAD = 0.28  # least m of the toe ahead of the hips
_GIVE, _GIVE_SECONDS = 0.08, 0.17  # least m by which it comes back, and within how many seconds
_FREE_SECONDS = 0.1  # in which it does not touch the ground
_FASTEST, _AROUND_SECONDS = 2.5, 0.13  # largest m/s against the body, and seconds before and after in which that holds
_SPAN_SECONDS = 0.3  # of a cut-out before and after its key moment
_RUNNING = 2.0  # m/s of a body that runs
_MOST = 24  # cut-outs of a library; the foot is slowest in these
_CARRIES = list_labels(ball="carries")


def find_cut_receptions(clips: Sequence, frames: Frames, feet_in_contact: np.ndarray, keys: Sequence[Key]
                        ) -> tuple[Key, ...]:
    """Find receptions in the dribbles of recordings.

    Args:
        clips: of the library.
        frames: its N frames.
        feet_in_contact: (N, 2) bool, left and right.
        keys: its labelled key moments.
    Returns:
        Their key moments, labelled as receptions with the foot, in order of clips; none where a recording is labelled
        with one.
    """
    if any(TAKING & key.labels and shows_foot_on_ball(key.labels) and not clips[key.clip].is_synthetic for key in keys):
        return ()
    columns = [frames.vocabulary.index(word) for word in _CARRIES if word in frames.vocabulary]
    dribbles = frames.words[:, columns].any(axis=1) & ~np.array([clip.is_synthetic for clip in clips])[frames.clip]
    found = [(speed, frame, side) for side in (0, 1)
             for speed, frame in _find_gives(frames, dribbles, feet_in_contact[:, side], side)]
    chosen = sorted(sorted(found)[:_MOST], key=lambda one: one[1:])
    return tuple(_build_key(clips, frames, frame, SIDES[side]) for _, frame, side in chosen)


def _find_gives(frames: Frames, dribbles: np.ndarray, is_in_contact: np.ndarray, side: int) -> list[tuple[float, int]]:
    """Find the frames in which one foot begins to give, with its largest speed in m/s around them."""
    toe = frames.feet[:, 2 * side : 2 * side + 2]
    speed = np.linalg.norm(np.gradient(toe, axis=0), axis=1) * FPS
    around, back, free = (int(np.ceil(seconds * FPS)) for seconds in (_AROUND_SECONDS, _GIVE_SECONDS, _FREE_SECONDS))
    peaks, width = _find_peaks(toe[:, 0], _AHEAD), max(around, back)
    peaks = peaks[(peaks >= width) & (peaks + width < len(frames))]
    dribbled = np.concatenate([[0], np.cumsum(dribbles)])  # most peaks are steps of walks
    peaks = peaks[dribbled[peaks + width + 1] - dribbled[peaks - width] == 2 * width + 1]
    found = []
    for frame in peaks[frames.clip[peaks - width] == frames.clip[peaks + width]]:
        fastest = float(speed[frame - around : frame + around + 1].max())
        gives = toe[frame, 0] - toe[frame : frame + back + 1, 0].min() >= _GIVE
        if gives and fastest <= _FASTEST and not is_in_contact[frame : frame + free + 1].any():
            found.append((fastest, int(frame)))
    return found


def _find_peaks(values: np.ndarray, least: float) -> np.ndarray:
    """Find the peaks of values (T,) from `least` on, the middle of flat ones, as scipy.signal.find_peaks, which takes
    half a second to load.
    """
    starts = np.flatnonzero(np.append(True, np.diff(values) != 0.0)[: len(values)])
    held, ends = values[starts], np.append(starts[1:], len(values)) - 1
    is_peak = (held[1:-1] > held[:-2]) & (held[1:-1] > held[2:]) & (held[1:-1] >= least)
    return ((starts + ends)[1:-1] // 2)[is_peak]


def _build_key(clips: Sequence, frames: Frames, frame: int, side: str) -> Key:
    """Build the key moment of a cut-out at a frame of the library."""
    clip = int(frames.clip[frame])
    rate, last = clips[clip].motion.fps, len(clips[clip].motion) - 1
    at, span = float(frames.source[frame]), _SPAN_SECONDS * rate
    pace = "running" if frames.speed[frame] >= _RUNNING else "standing"
    return Key(clip, at, max(at - span, 0.0), min(at + span, float(last)),
               frozenset({"receive", "foot", "low", side, pace}))
