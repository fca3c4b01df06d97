"""Automatic locomotion: which gait a speed asks for, by the thresholds of Faustino §3.1.1, kept from flickering; and
which way a body is turned while it goes: towards the ball when slow, along its way when fast.

Facing is not the direction of travel (../shared/metrics.md: torso and travel are 77 degrees apart in the median at 0.5
to 1 m/s, 47 at 1 to 2, about 31 above); what turns it away is mostly the ball.
"""

from __future__ import annotations

import numpy as np

from ..base.errors import InputError
from ..base.time_series import equal_runs
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.track import SampledTrack, zero_phase_hann
from .labels import list_gaits, list_labels
from .vocabulary import DIRECTIONS

LOCOMOTION = list_gaits()
"""The words that speed alone decides, slow to fast; "dribble" goes with any of them when the ball is at the feet."""

STANDING = LOCOMOTION[0]
"""The gait that does not travel."""

LOCOMOTION_WORDS = frozenset((*LOCOMOTION, *list_labels(ball="carries")))

STANDING_SPEED = 0.3
"""m/s of a smoothed track; below it a player stands. (Raw tracking noise alone looks like that; a smoothed track that
creeps faster is a player who shuffles: a standing body would have to glide.)"""

_SPEEDS = np.array([0.8, 1.5, 2.5, 4.0, 6.0])  # m/s, and radians off its way that a body is turned then at most
_MOST_TURNED = np.array([np.pi, 1.3, 0.6, 0.2, 0.0])
_AT_FEET = (1.0, 2.5)  # m to the ball: nearer it is not faced, farther it is in full
_WINDOW, _SHORTEST = 2.0, 1.5  # seconds over which the facing is smoothed, and that a direction lasts at least


def gait_thresholds(speeds: np.ndarray, omega: float = 4.0) -> np.ndarray:
    """(G-1,) m/s, from each gait to the next faster one: s_A + (s_B - s_A) / omega, for speeds (G,) in ascending order.

    Faustino §3.1.1 prints s_A + (s_A - s_B) / omega, which lies below the slower gait's own speed; the sign is turned
    here so that omega = 4 puts the threshold a quarter of the way up, as the text explains ("to limit the usage of
    slower locomotion mocaps on higher movement speed"). The step up from standing is never below STANDING_SPEED."""
    speeds = np.asarray(speeds, dtype=float)
    if speeds.ndim != 1 or not np.all(np.isfinite(speeds)) or np.any(np.diff(speeds) <= 0):
        raise InputError("gait speeds", f"{speeds.tolist()}", "ascending speeds in m/s, one per gait")
    if not omega >= 1.0:
        raise InputError("omega", f"{omega}", "a number of at least 1")
    slow, fast = speeds[:-1], speeds[1:]
    thresholds = slow + (fast - slow) / omega
    from_standing = (slow < STANDING_SPEED) & (fast > STANDING_SPEED)
    return np.where(from_standing, np.maximum(thresholds, STANDING_SPEED), thresholds)


def recorded_thresholds(speeds: np.ndarray, speed: np.ndarray, gait: np.ndarray) -> np.ndarray:
    """(G-1,) m/s, where a library's own annotations change from each gait to the next: the speed with fewest frames of
    the slower one above it and of the faster one below it.

    speeds (G,) m/s, ascending, the gaits' averages; speed (N,) m/s and gait (N,) index of annotated frames. Between
    gaits that do not overlap it is half way; the step up from standing is STANDING_SPEED, since a body that stands
    cannot travel. Faustino's omega asks for the faster gait already a quarter of the way up, which no recording of that
    speed is then called."""
    found = []
    for slow, (low, high) in enumerate(zip(speeds, speeds[1:])):
        below, above = np.sort(speed[gait == slow]), np.sort(speed[gait == slow + 1])
        tried = np.linspace(low, high, 101)
        wrong = len(below) - np.searchsorted(below, tried) + np.searchsorted(above, tried)
        best = float(np.mean(tried[wrong == wrong.min()]))
        found.append(STANDING_SPEED if low < STANDING_SPEED < high else best)
    return np.array(found)


def automatic_gaits(
    speed: np.ndarray, fps: float, speeds: np.typing.ArrayLike, thresholds: np.ndarray, hysteresis: float = 0.2,
    minimum: float = 0.4,
) -> np.ndarray:
    """(T,) index into `speeds`: the gait of every frame (Faustino §3.1.1's pseudo-code, made steady).

    speed: (T,) m/s at `fps` frames per second. speeds: (G,) m/s, ascending, the average speed of each gait's clips.
    thresholds: (G-1,) m/s (`gait_thresholds`, `recorded_thresholds`).
    hysteresis: how far beyond a threshold the speed must go to change gait, as a share of the distance between the two
    gaits, at most a quarter of the threshold (the paper has none: at a boundary speed its annotation flickers with the
    noise). minimum: seconds a gait lasts at least; shorter ones go to the nearer neighbour, then the longer."""
    speed = np.asarray(speed, dtype=float)
    margins = np.minimum(hysteresis * np.diff(np.asarray(speeds, dtype=float)), thresholds / 4.0)
    steps = [_trigger(speed, threshold, margin) for threshold, margin in zip(thresholds, margins)]
    gaits = np.sum(steps, axis=0, dtype=int) if steps else np.zeros(len(speed), dtype=int)
    return without_short_runs(gaits, int(np.ceil(minimum * fps - 1e-9)))


def wanted_offset(track: SampledTrack) -> np.ndarray:
    """(T,) radians from the direction of travel to where the body should face, counterclockwise, in -pi .. pi.

    The ball's direction, as far as legs can turn aside at that speed: all the way round below 0.8 m/s, not at all at 6.
    Zero where the ball is unknown; at their own feet players follow it along their way."""
    away = track.ball[:, :2] - track.positions
    known = np.isfinite(away).all(axis=1)
    distance = np.linalg.norm(np.where(known[:, None], away, 1.0), axis=1)
    share = np.where(known, np.clip((distance - _AT_FEET[0]) / (_AT_FEET[1] - _AT_FEET[0]), 0.0, 1.0), 0.0)
    to_ball = arctan2(away[:, 1], away[:, 0])
    offset = np.where(known, quaternion.wrapped(to_ball - track.direction), 0.0) * share
    most = np.interp(track.speed, _SPEEDS, _MOST_TURNED)
    offset = np.clip(offset, -most, most)
    steady = zero_phase_hann(np.stack([np.cos(offset), np.sin(offset)], axis=1), track.fps, _WINDOW)
    return arctan2(steady[:, 1], steady[:, 0])


def direction_words(offset: np.ndarray, fps: float) -> list[str]:
    """The words for walking that way at each of `offset` (T,) radians (`wanted_offset`): front, back, or to a side,
    none for less than _SHORTEST seconds. Facing to the left of one's way is walking to the right."""
    quarter = np.round(quaternion.wrapped(offset) / (np.pi / 2.0)).astype(int) % 4
    return [DIRECTIONS[-number] for number in without_short_runs(quarter, int(_SHORTEST * fps))]


def _trigger(speed: np.ndarray, threshold: float, margin: float) -> np.ndarray:
    """(T,) bool: above the threshold, where only leaving threshold +- margin changes the answer."""
    decided = np.abs(speed - threshold) >= margin
    decided[:1] = True
    last = np.maximum.accumulate(np.where(decided, np.arange(len(speed)), 0))
    return (speed >= threshold)[last]


def without_short_runs(gaits: np.ndarray, frames: int) -> np.ndarray:
    """Kinds (T,) of gait or direction with every run shorter than `frames` given to a neighbour, shortest first."""
    if not len(gaits):
        return gaits
    runs = [[stop - start, int(gaits[start])] for start, stop in equal_runs(gaits)]
    while len(runs) > 1:
        short = min(range(len(runs)), key=lambda i: runs[i][0])
        if runs[short][0] >= frames:
            break
        runs[short][1] = _adopting_gait(runs, short)
        runs = _joined(runs)
    return np.repeat([gait for _, gait in runs], [length for length, _ in runs])


def _adopting_gait(runs: list[list[int]], index: int) -> int:
    neighbours = runs[max(index - 1, 0) : index] + runs[index + 1 : index + 2]
    return min(neighbours, key=lambda run: (abs(run[1] - runs[index][1]), -run[0]))[1]


def _joined(runs: list[list[int]]) -> list[list[int]]:
    out: list[list[int]] = []
    for length, gait in runs:
        if out and out[-1][1] == gait:
            out[-1][0] += length
        else:
            out.append([length, gait])
    return out
