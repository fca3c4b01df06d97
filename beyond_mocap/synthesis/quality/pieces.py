"""Pieces of clips that a take is made of, read off its provenance: runs, seams, warp rate and replayed loops.

Per output frame: clip (T,) an integer per clip (negative where unknown), mirrored (T,) bool, clip_frame (T,) fractional
in the clip's own rate, and per frame the source frames that pass in one output frame at recorded speed, `stride` (T,) =
clip's fps / output fps.
"""

from __future__ import annotations

import numpy as np

LOOP_SECONDS = 4.0
LOOP_REACH = 80.0 / 60.0


def played_rate(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Played / recorded speed from each frame to the next: (T-1,), NaN where the clip changes or is not known."""
    rate = np.diff(clip_frame) / stride[:-1]
    same = (clip[1:] == clip[:-1]) & (mirrored[1:] == mirrored[:-1]) & (clip[1:] >= 0)
    return np.where(same, rate, np.nan)


def seams(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Output frames (S,) that start a new piece: the clip (or its mirroring) changes, or clip_frame jumps.

    A jump is a step of more than 1.5 frames times the warp there, in frames of the output's rate, or of less than half
    of it (a step back, a repeated stretch). The warp is the median rate of up to four steps on either side.
    """
    rate = played_rate(clip, mirrored, clip_frame, stride)
    known = (clip[1:] >= 0) | (clip[:-1] >= 0)
    warp = np.maximum(_neighbours_median(rate), 0.25)
    jump = (rate > 1.5 * warp) | (rate < 0.5 * warp)
    return np.flatnonzero(known & (np.isnan(rate) | jump)) + 1


def warp_rates(clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray) -> np.ndarray:
    """Played / recorded speed of every step inside a run: (N,)."""
    rate = played_rate(clip, mirrored, clip_frame, stride)
    rate[seams(clip, mirrored, clip_frame, stride) - 1] = np.nan
    return rate[np.isfinite(rate)]


def runs(count: int, starts: np.ndarray) -> np.ndarray:
    """Number of the run that each of `count` frames belongs to: (T,) int, one more at every seam in `starts`."""
    flags = np.zeros(count, dtype=int)
    flags[starts] = 1
    return np.cumsum(flags)


def replayed(
    clip: np.ndarray, mirrored: np.ndarray, clip_frame: np.ndarray, stride: np.ndarray, fps: float
) -> np.ndarray:
    """Frames that replay a stretch played less than 4 s before: (T,) bool.

    A frame replays where an earlier run of the same clip (same side) showed a frame within 80 source frames at 60 fps
    (1.33 s of the clip) of it in the last 4 s. A run that starts beyond everything the earlier run showed only skipped
    ahead, and does not count.
    """
    number = runs(len(clip), seams(clip, mirrored, clip_frame, stride))
    first = np.full(number[-1] + 1, np.inf)
    last = np.full(number[-1] + 1, -np.inf)
    np.fmin.at(first, number, clip_frame)
    np.fmax.at(last, number, clip_frame)
    out = np.zeros(len(clip), dtype=bool)
    for lag in range(1, min(int(np.ceil(LOOP_SECONDS * fps)), len(clip))):
        same = (clip[lag:] == clip[:-lag]) & (mirrored[lag:] == mirrored[:-lag]) & (clip[lag:] >= 0)
        other = same & (number[lag:] != number[:-lag]) & (first[number[lag:]] < last[number[:-lag]])
        near = np.abs(clip_frame[lag:] - clip_frame[:-lag]) < LOOP_REACH * fps * stride[lag:]
        out[lag:] |= other & near
    return out


def _neighbours_median(rate: np.ndarray, reach: int = 4) -> np.ndarray:
    """Median of the finite rates up to `reach` steps away on either side, the step itself left out; 1 where there are
    none."""
    padded = np.pad(rate, reach, constant_values=np.nan)
    around = np.stack([padded[reach + k : reach + k + len(rate)] for k in range(-reach, reach + 1) if k])
    around[~np.isfinite(around)] = np.nan
    around.sort(axis=0)
    count = np.sum(np.isfinite(around), axis=0)
    column = np.arange(len(rate))
    low, high = np.maximum(count - 1, 0) // 2, count // 2
    high = np.minimum(high, np.maximum(count - 1, 0))
    return np.where(count > 0, 0.5 * (around[low, column] + around[high, column]), 1.0)
