"""Automatic locomotion: the gait for a speed, and the heading of a body while it moves.

Gaits follow the thresholds of Faustino §3.1.1, with hysteresis and a minimum duration. The body faces the ball when it
is slow and its direction of travel when it is fast: heading is not the direction of travel (measured on reference data,
torso and travel differ by 77 degrees in the median at 0.5 to 1 m/s, by 47 at 1 to 2 m/s and by about 31 above), and
the difference comes mostly from the ball.
"""

from __future__ import annotations

import numpy as np

from ..base.errors import InputError
from ..base.time_series import find_equal_runs
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.track import SampledTrack, smooth_zero_phase_hann
from .labels import list_gaits, list_labels
from .vocabulary import DIRECTIONS

LOCOMOTION = list_gaits()
"""The labels that speed alone decides, slow to fast; "dribble" joins any of them when the ball is at the feet."""

STANDING = LOCOMOTION[0]
TURNING = "turning"
"""The gait without travel."""

LOCOMOTION_LABELS = frozenset((*LOCOMOTION, *list_labels(ball="carries")))

STANDING_SPEED = 0.3
"""m/s of a smoothed track; below it a player stands. Raw tracking noise alone reaches this speed; at a higher smoothed
speed the player shuffles, and a standing body would slide."""

_SPEEDS = np.array([0.8, 1.5, 2.5, 4.0, 6.0])  # m/s, with the largest heading offset in radians at each
_MAX_OFFSETS = np.array([np.pi, 1.3, 0.6, 0.2, 0.0])
_FACING_DISTANCES = (1.0, 2.5)  # m to the ball: nearer, the body does not face it; farther, it does in full
_WINDOW, _MIN_SECONDS = 2.0, 1.5  # seconds: smoothing window of the heading; minimum duration of a direction


def compute_gait_thresholds(speeds: np.ndarray, omega: float = 4.0) -> np.ndarray:
    """Compute the speed thresholds from each gait to the next faster one: s_A + (s_B - s_A) / omega.

    Faustino prints s_A + (s_A - s_B) / omega, which lies below the slower gait's own speed. The sign is changed here so
    that omega = 4 puts the threshold a quarter of the way up, as the text explains ("to limit the usage of slower
    locomotion mocaps on higher movement speed"). The threshold above standing is at least STANDING_SPEED.

    Args:
        speeds: (G,) m/s, ascending, the average speed of each gait.
        omega: at least 1.
    Returns:
        (G-1,) m/s.
    Raises:
        InputError: if speeds do not ascend or omega is below 1.
    Source: Faustino 2016, section 3.1.1.
    """
    speeds = np.asarray(speeds, dtype=float)
    if speeds.ndim != 1 or not np.all(np.isfinite(speeds)) or np.any(np.diff(speeds) <= 0):
        raise InputError("gait speeds", f"{speeds.tolist()}", "ascending speeds in m/s, one per gait")
    if not omega >= 1.0:
        raise InputError("omega", f"{omega}", "a number of at least 1")
    slow, fast = speeds[:-1], speeds[1:]
    thresholds = slow + (fast - slow) / omega
    from_standing = (slow < STANDING_SPEED) & (fast > STANDING_SPEED)
    return np.where(from_standing, np.maximum(thresholds, STANDING_SPEED), thresholds)


def estimate_gait_thresholds(speeds: np.ndarray, speed: np.ndarray, gait: np.ndarray) -> np.ndarray:
    """Estimate from a library's own annotations the speeds at which one gait changes to the next.

    Each threshold is the speed with the fewest frames of the slower gait above it and of the faster gait below it;
    between gaits that do not overlap it is half way. The threshold above standing is STANDING_SPEED, because a standing
    body cannot travel. Faustino's omega requests the faster gait a quarter of the way up, where no recording has that
    label.

    Args:
        speeds: (G,) m/s, ascending, the gaits' average speeds.
        speed: (N,) m/s of annotated frames.
        gait: (N,) index of the frames' gaits.
    Returns:
        (G-1,) m/s.
    """
    thresholds = []
    for slow, (low, high) in enumerate(zip(speeds, speeds[1:])):
        below, above = np.sort(speed[gait == slow]), np.sort(speed[gait == slow + 1])
        tried = np.linspace(low, high, 101)
        # Count the frames on the wrong side of each tried speed; `below` and `above` are sorted.
        misplaced = len(below) - np.searchsorted(below, tried) + np.searchsorted(above, tried)
        best = float(np.mean(tried[misplaced == misplaced.min()]))
        thresholds.append(STANDING_SPEED if low < STANDING_SPEED < high else best)
    return np.array(thresholds)


def choose_gaits(
    speed: np.ndarray, fps: float, speeds: np.typing.ArrayLike, thresholds: np.ndarray, hysteresis: float = 0.2,
    minimum: float = 0.4,
) -> np.ndarray:
    """Choose the gait of every frame from its speed, without flicker.

    Args:
        speed: (T,) m/s.
        fps: frames per second.
        speeds: (G,) m/s, ascending, the average speed of each gait's clips.
        thresholds: (G-1,) m/s, see `compute_gait_thresholds` and `estimate_gait_thresholds`.
        hysteresis: how far speed must pass a threshold to change the gait, as a share of the distance between the two
            gaits' speeds, at most a quarter of the threshold. The paper has none: at a boundary speed its annotation
            flickers with the noise.
        minimum: minimum duration of a gait in seconds; shorter runs take the gait of the more similar neighbour, then
            of the longer one.
    Returns:
        (T,) index into `speeds`.
    Source: Faustino 2016, section 3.1.1, pseudo-code; hysteresis and minimum duration added.
    """
    speed = np.asarray(speed, dtype=float)
    margins = np.minimum(hysteresis * np.diff(np.asarray(speeds, dtype=float)), thresholds / 4.0)
    steps = [_apply_hysteresis(speed, threshold, margin) for threshold, margin in zip(thresholds, margins)]
    gaits = np.sum(steps, axis=0, dtype=int) if steps else np.zeros(len(speed), dtype=int)
    return remove_short_runs(gaits, int(np.ceil(minimum * fps - 1e-9)))


def compute_heading_offset(track: SampledTrack) -> np.ndarray:
    """Compute the angle from the direction of travel to the heading that the body should have.

    Where the heading is planned, this is the plan's. Else it is the ball's direction, limited to what legs allow at
    that speed: any angle below 0.8 m/s, none from 6 m/s on. It is zero where the ball is unknown, and near the player's
    own feet, where they follow it along their path.

    Args:
        track: the player's track with the ball, T frames.
    Returns:
        (T,) radians, counterclockwise, -pi to pi.
    """
    if track.heading is not None:
        return quaternion.wrap_angle(track.heading - track.direction)
    to_ball, share = _compute_ball_direction(track)
    offset = np.where(np.isfinite(to_ball), quaternion.wrap_angle(to_ball - track.direction), 0.0) * share
    limit = np.interp(track.speed, _SPEEDS, _MAX_OFFSETS)
    offset = np.clip(offset, -limit, limit)
    smoothed = smooth_zero_phase_hann(np.stack([np.cos(offset), np.sin(offset)], axis=1), track.fps, _WINDOW)
    return arctan2(smoothed[:, 1], smoothed[:, 0])


def compute_standing_heading(track: SampledTrack) -> tuple[np.ndarray, np.ndarray]:
    """Compute the heading of one who stands and watches the ball, and how much they turn to it: not at all where it is
    unknown or at their feet.

    Args:
        track: the player's track with the ball, T frames.
    Returns:
        (T,) radians, world, and (T,) shares from 0 to 1.
    """
    to_ball, share = _compute_ball_direction(track)
    to_ball = np.where(share > 0.0, to_ball, 0.0)
    x, y = smooth_zero_phase_hann(share[:, None] * np.stack([np.cos(to_ball), np.sin(to_ball)], axis=1), track.fps,
                                  _WINDOW).T
    return arctan2(y, x), np.hypot(x, y)


def _compute_ball_direction(track: SampledTrack) -> tuple[np.ndarray, np.ndarray]:
    """Compute the direction (T,) rad from a player to the ball, and the share (T,) of it that the body turns to."""
    ball_offset = track.ball[:, :2] - track.positions
    known = np.isfinite(ball_offset).all(axis=1)
    distance = np.linalg.norm(np.where(known[:, None], ball_offset, 1.0), axis=1)
    share = np.where(known, np.clip((distance - _FACING_DISTANCES[0]) / (_FACING_DISTANCES[1] - _FACING_DISTANCES[0]),
                                    0.0, 1.0), 0.0)
    return arctan2(ball_offset[:, 1], ball_offset[:, 0]), share


def choose_directions(offset: np.ndarray, fps: float) -> list[str]:
    """Choose the direction label of walking at each heading offset: front, back, left or right.

    A body that faces left of its path walks to its right. No direction lasts less than _SHORTEST seconds.

    Args:
        offset: (T,) radians, see `compute_heading_offset`.
        fps: frames per second.
    Returns:
        T labels.
    """
    quarter = np.round(quaternion.wrap_angle(offset) / (np.pi / 2.0)).astype(int) % 4
    return [DIRECTIONS[-number] for number in remove_short_runs(quarter, int(_MIN_SECONDS * fps))]


def _apply_hysteresis(speed: np.ndarray, threshold: float, margin: float) -> np.ndarray:
    """Compare speed to a threshold with hysteresis: only values beyond threshold +- margin change the result.

    Args:
        speed: (T,) m/s.
        threshold, margin: m/s.
    Returns:
        (T,) bool, True above the threshold.
    """
    is_decided = np.abs(speed - threshold) >= margin
    is_decided[:1] = True
    # Index of the last frame that was beyond the margin, for every frame.
    last = np.maximum.accumulate(np.where(is_decided, np.arange(len(speed)), 0))
    return (speed >= threshold)[last]


def remove_short_runs(gaits: np.ndarray, min_length: int) -> np.ndarray:
    """Remove short runs: each takes the value of a neighbour, the shortest first.

    Args:
        gaits: (T,) int, gaits or directions.
        min_length: minimum length of a run.
    Returns:
        (T,) int.
    """
    if not len(gaits):
        return gaits
    runs = find_equal_runs(gaits)
    lengths, values = [stop - start for start, stop in runs], [int(gaits[start]) for start, _ in runs]
    while len(lengths) > 1 and (shortest := min(lengths)) < min_length:
        _join_run(lengths, values, lengths.index(shortest))
    return np.repeat(values, lengths)


def _join_run(lengths: list[int], values: list[int], index: int) -> None:
    """Join a run to the neighbour whose value is more similar, then the longer one, and to the other if that is equal.
    """
    neighbours = [at for at in (index - 1, index + 1) if 0 <= at < len(lengths)]
    value = values[min(neighbours, key=lambda at: (abs(values[at] - values[index]), -lengths[at]))]
    joined = [index, *(at for at in neighbours if values[at] == value)]
    part = slice(min(joined), max(joined) + 1)
    lengths[part], values[part] = [sum(lengths[part])], [value]
