"""Estimate when and how fast a ball leaves the hand from the hand alone, for recordings without a marker on the ball.

Fingers push a ball and cannot pull it. It stays with them as long as their tips accelerate in the direction of the
throw, and leaves when they no longer do: at the peak of the fingertips' forward speed, with that speed. Before that,
the ball rolls out along the fingers, like a bead on a rotating rod (r'' = w^2 r, so it needs acosh(tip / hold) / w,
some 8 ms in a pitch and 40 ms in an easy throw; thumbs were measured to leave a fastball 6 ms before the fingers:
Stevenson, "Finger release sequence for fastball and curveball pitches", Can. J. Appl. Sport Sci. 10 (1985)). A rolling
ball takes on only 2/7 of the movement of its support across the push (a solid sphere); the rest becomes spin. The
ball's direction is therefore that of the whole last stretch, and not that of the tips, which sweep across.

The distance from wrist to fingertips is not measured, but follows from the hand: finger bones are 1.22 times the third
metacarpal, on whose head the hand's marker lies (Buchholz, Armstrong & Goldstein, "Anthropometric data for describing
the kinematics of the human hand", Ergonomics 35 (1992)), bent as around a ball.

Fingers carry no markers: how they are bent, how long they are, and how far the ball rolls out along them is unknown.
What that costs is measured on synthetic throws whose fingers are known (`benchmarks/release_margins.py`): over bent
fingers estimates are 5 % too slow in the median, out of a rigid grip 4 % too fast, so nothing can be corrected; nine in
ten come within 10 % of the speed, and within 19 degrees of the direction over bent fingers and 28 out of a rigid grip,
at 120 to 360 frames per second and 8 to 36 m/s alike. These throws share one way to throw, and recordings are more
varied: of two recorded pitches one has a speed that is 0.6 % off, the other leaves 13 degrees upwards where pitches
leave level, and others are known to be worse. The margin of the speed is therefore half as wide again as what
synthetic throws need, that of the direction holds for a rigid grip too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.time_series import interpolate_columns
from ...motion.hand import Hand
from .throwing_hand import find_fastest_frame

SPEED_MARGIN = 0.15  # of the speed, half the interval that holds 90 % of the cases
DIRECTION_MARGIN = np.radians(28.0)  # rad, half the angle of the cone that holds 90 %
TIME_MARGIN = 0.0066  # seconds, half the 90 % interval of a fast throw; slower ones roll longer and have more
_ROLL_MARGIN, _FRAME_MARGIN = 0.82, 0.5  # the same, as shares of the rolling time and of a frame
PAD = 0.91  # share of the length from wrist to fingertip where the finger pads push, joints bent by some 25 degrees
HOLD = 0.70  # share of the length from wrist to fingertip where the centre of a gripped ball is
ROLLS_WITH = 2.0 / 7.0  # share of a surface's speed that a solid ball rolling on it takes on
_SMOOTHING_SECONDS = 0.014  # s, window of the parabolas from which velocities are computed
_SEARCH_SECONDS = 0.1  # s around the fastest frame of the outlier-free speed, in which the fastest time is searched
_STEPS_PER_FRAME = 8  # steps per frame
_MAX_TIP_DELAY = 2.5  # multiples of the rolling time within which the tips are fastest after the wrist
# The wrist is fastest between so many rolling times before, and so many s after, the fastest time of the ball.
_MAX_WRIST_LEAD, _MAX_WRIST_LAG = 4.0, 0.005
_PEAK_SHARE = 0.95  # share of the wrist's maximum speed there, from which on a local maximum is its peak
_FAST_SHARE = 0.8  # share of the tips' maximum speed, from which on their path gives the direction
_IGNORED_RISE = 0.35  # rad by which an overarm hand may rise or fall without the ball doing so
_MIN_STRIDE = 0.25  # metres between the feet, from which on the stride contributes to the direction


@dataclass(frozen=True, eq=False, kw_only=True)
class HandRelease:
    """A release estimated from the hand alone.

    Attributes:
        time: s from frame 0.
        position: (3,) metres, the ball's centre.
        velocity: (3,) m/s.
        time_margin: s, half the interval that holds 90 % of the cases.
        speed_margin: m/s, likewise.
        direction_margin: rad, half the angle of the cone that holds 90 %.
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray
    time_margin: float
    speed_margin: float
    direction_margin: float


def estimate_hand_release(hand: Hand, radius: float, stride: np.ndarray | None = None) -> HandRelease:
    """Estimate the release of a ball that has no marker.

    Args:
        hand: the throwing hand.
        radius: metres, of the ball.
        stride: (T, 2) metres, level, from one foot to the other; None where unknown.
    Returns:
        The release.
    """
    path = _HandPath(hand)
    times, tips, grip = path.times, path.velocities_at(PAD), path.velocities_at(HOLD)
    angular_speed = _compute_lengths(path.angular_velocity)
    gripped = path.find_fastest(HOLD, find_fastest_frame(hand.to_world(HOLD * hand.reach * hand.finger), hand.fps))
    roll = _compute_roll_time(float(np.median(angular_speed[_select_around(times, gripped, 0.01)])))
    wrist = _find_wrist_peak(path, gripped, roll)
    last = int(np.searchsorted(times, times[wrist] + max(_MAX_TIP_DELAY * roll, 2.0 / hand.fps)))
    direction = _estimate_direction(path, tips, wrist, last, stride)
    forward = tips[wrist : last + 1] @ direction
    k = wrist + int(np.argmax(forward))
    roll_time = _compute_roll_time(float(angular_speed[k]))
    start = max(int(np.searchsorted(times, times[k] - roll_time)), 0)
    push = _compute_push(path, k, direction)
    velocity = grip[start] + ROLLS_WITH * (tips[k] - tips[start])
    velocity = velocity + push * float((tips[k] - velocity) @ push)
    position = path.places_at(PAD)[k] + radius * push
    time_margin = float(np.hypot(max(TIME_MARGIN, _ROLL_MARGIN * roll_time), _FRAME_MARGIN / hand.fps))
    return HandRelease(time=float(times[k]), position=position, velocity=velocity, time_margin=time_margin,
                       speed_margin=SPEED_MARGIN * float(np.linalg.norm(velocity)), direction_margin=DIRECTION_MARGIN)


def measure_roll_time(hand: Hand, time: float) -> float:
    """Measure the s that a ball needs along the fingers of a hand.

    Args:
        hand: the hand.
        time: s at which it throws.
    Returns:
        Seconds.
    """
    path = _HandPath(hand)
    return _compute_roll_time(float(_compute_lengths(path.angular_velocity)[np.argmin(np.abs(path.times - time))]))


def _compute_roll_time(angular_speed: float) -> float:
    """Compute the s that a ball needs along the fingers of a hand that rotates by `angular_speed` rad/s."""
    return float(np.arccosh(PAD / HOLD)) / max(angular_speed, 5.0)


def _find_wrist_peak(path: _HandPath, gripped: int, roll: float) -> int:
    """Find when the wrist is fastest before the ball in the hand is, as an index of the path's times.

    The first peak is taken: the arm swings on after a throw, and the wrist may be as fast again.
    """
    first, end = np.searchsorted(path.times, path.times[gripped] + [-_MAX_WRIST_LEAD * roll, _MAX_WRIST_LAG])
    first = int(min(first, gripped))
    speed = _compute_lengths(path.velocities_at(0.0)[first : max(int(end), first + 1)])
    falls = np.append(np.diff(speed) <= 0.0, True)
    return first + int(np.argmax(falls & (speed >= _PEAK_SHARE * speed.max())))


class _HandPath:
    """Wrist and fingers between the frames: places and velocities of points along the stretched hand."""

    def __init__(self, hand: Hand):
        from scipy.interpolate import CubicSpline
        from scipy.signal import savgol_filter

        window = max(2 * int(round(0.5 * _SMOOTHING_SECONDS * hand.fps)) + 1, 3)
        tip = hand.to_world(hand.finger * hand.reach)
        wrist, tip = _fill_gaps(hand.origin), _fill_gaps(tip)
        if len(hand) > window:
            wrist, tip = (savgol_filter(points, window, 2, axis=0) for points in (wrist, tip))
        frames = np.arange(len(hand)) / hand.fps
        self.times = np.arange((len(hand) - 1) * _STEPS_PER_FRAME + 1) / (hand.fps * _STEPS_PER_FRAME)
        self._wrist, self._tip = CubicSpline(frames, wrist), CubicSpline(frames, tip)
        self._at, self._moves = self._wrist(self.times), self._wrist(self.times, 1)
        self._arm, arm_moves = self._tip(self.times) - self._at, self._tip(self.times, 1) - self._moves
        along = self._arm / np.maximum(_compute_lengths(self._arm), 1e-9)[:, None]
        self._swing = arm_moves - along * np.sum(arm_moves * along, axis=-1)[:, None]
        self.angular_velocity = self._swing / np.maximum(_compute_lengths(self._arm), 1e-9)[:, None]

    def find_fastest(self, share: float, frame: int) -> int:
        """Find the index of the time at which the point at `share` is fastest, near a frame."""
        near = _select_around(self.times, frame * _STEPS_PER_FRAME, _SEARCH_SECONDS)
        return near.start + int(np.argmax(_compute_lengths(self.velocities_at(share)[near])))

    def frame_at(self, k: int) -> int:
        """Return the frame nearest to one of the times."""
        return int(round(k / _STEPS_PER_FRAME))

    def places_at(self, share: float) -> np.ndarray:
        """Return the point at `share` of the length from wrist to fingertip, (N, 3) metres."""
        return self._at + share * self._arm

    def velocities_at(self, share: float) -> np.ndarray:
        """Return the velocity of that point for a rigid hand, (N, 3) m/s."""
        return self._moves + share * self._swing


def _estimate_direction(path: _HandPath, tips: np.ndarray, wrist: int, last: int, stride: np.ndarray
                        | None) -> np.ndarray:
    """Estimate the direction of the throw, unit (3,): from the fingers' path while they are fast, level also from
    the stride.
    """
    speed = _compute_lengths(tips)
    peak = wrist + int(np.argmax(speed[wrist : last + 1]))
    first = peak
    while first > 0 and speed[first - 1] > _FAST_SHARE * speed[peak]:
        first -= 1
    direction = path.places_at(PAD)[peak] - path.places_at(PAD)[first]
    direction = tips[peak] if np.linalg.norm(direction) < 1e-6 else direction
    direction = direction / np.linalg.norm(direction)
    level, rise = float(np.hypot(direction[0], direction[1])), float(np.arcsin(np.clip(direction[2], -1.0, 1.0)))
    rise = np.sign(rise) * max(abs(rise) - _IGNORED_RISE, 0.0)
    if level < 0.3:
        return direction
    heading = direction[:2] / level
    at = np.zeros(2) if stride is None else stride[path.frame_at(wrist)]
    size = float(np.linalg.norm(at))
    if size > _MIN_STRIDE and abs(at @ heading) > 0.5 * size:
        heading = heading + at * (np.sign(at @ heading) / size)
        heading = heading / np.linalg.norm(heading)
    return np.append(heading * np.cos(rise), np.sin(rise))


def _compute_push(path: _HandPath, k: int, direction: np.ndarray) -> np.ndarray:
    """Compute the direction of the push, unit (3,): the fingers' swing, or `direction` if they do not swing."""
    push = path.angular_velocity[k]
    size = np.linalg.norm(push)
    return direction if size < 1.0 or push @ direction < 0.5 * size else push / size


def _select_around(times: np.ndarray, k: int, seconds: float) -> slice:
    return slice(*np.searchsorted(times, [times[k] - seconds, times[k] + seconds + 1e-9]).tolist())


def _compute_lengths(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _fill_gaps(points: np.ndarray) -> np.ndarray:
    """Return points (T, 3) with gaps interpolated linearly."""
    known = np.isfinite(points).all(axis=-1)
    if known.all():
        return points
    at = np.arange(len(points))
    return interpolate_columns(at, at[known], points[known])
