"""When and how fast a ball leaves the hand, told by the hand alone: for recordings in which the ball bears no marker.

Fingers push a ball and cannot pull it. It stays with them as long as their tips go faster and faster in the direction
of the throw, and leaves when they no longer do: at the peak of the fingertips' forward speed, with that speed. On the
way there the ball rolls out along the fingers, as a bead on a turning rod does (r'' = w^2 r, so that it needs
acosh(tip / hold) / w, some 8 ms in a pitch and 40 ms in an easy throw; thumbs were measured to leave a fastball 6 ms
before the fingers: Stevenson, "Finger release sequence for fastball and curveball pitches", Can. J. Appl. Sport Sci. 10
(1985)). A rolling ball takes over only 2/7 of what its support does across the push (a solid sphere); the rest is its
spin. This makes the ball's direction that of the whole last stretch, and not of the tips, which sweep across.

How far the tips are from the wrist is not measured, but follows from the hand: finger bones 1.22 times the third
metacarpal, whose head the hand's marker sits on (Buchholz, Armstrong & Goldstein, "Anthropometric data for describing
the kinematics of the human hand", Ergonomics 35 (1992)), bent as around a ball.

What is not seen is what the fingers do on their own. SPEED_SIGMA is therefore a judgement, not a measurement: hands
differ by a tenth in length, which makes 4 % of the speed; an aim wrong by ten degrees 2 to 4 %; the fingers' own
flexion some more. On the one recording at hand with a radar's speed (80.8 mph), nothing having been fitted to it, the
speed comes out within 3 %.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.time_series import interpolate
from ...motion.hand import Hand
from .throwing_hand import fastest

SPEED_SIGMA = 0.06  # of the speed, one standard deviation
TIME_SIGMA = 0.004  # seconds, one standard deviation, in a fast throw; slower ones have more, as they roll longer
PAD = 0.91  # of the way from wrist to fingertip: where the fingers' pads push, each joint bent by some 25 degrees
HOLD = 0.70  # of the way from wrist to fingertip: where the ball's centre is while it is gripped
ROLLS_WITH = 2.0 / 7.0  # share of a surface's speed that a solid ball rolling on it takes on
_SMOOTH = 0.014  # s, the window of the parabolas that velocities are taken from
_NEAR = 0.1  # s about the frame in which the wrist is fastest when single frames are left aside
_FINE = 8  # steps a frame
_LATEST = 2.5  # times the rolling that the tips may be fastest after the wrist is
_EARLIER, _AFTER = 4.0, 0.005  # times the rolling, and s, about the ball's fastest, between which the wrist's is
_NEARLY = 0.95  # of the wrist's fastest there, what counts as its peak
_ACCELERATES = 0.8  # of the tips' fastest speed, from where on their way tells the direction
_ARC = 0.35  # rad by which a hand climbs or falls that goes over the top, without the ball doing so
_LEAST_STEP = 0.25  # m between the feet along the throw, from where on they tell its direction


@dataclass(frozen=True, eq=False, kw_only=True)
class HandRelease:
    """How the ball left by the hand alone. time: s from frame 0. position: (3,) m of its centre. velocity: (3,) m/s.
    time_sigma, speed_sigma, way_sigma: s, m/s and rad, one standard deviation. rolled: s that it took along the
    fingers."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    time_sigma: float
    speed_sigma: float
    way_sigma: float
    rolled: float


def release_by_hand(hand: Hand, radius: float, stride: np.ndarray | None = None) -> HandRelease:
    """The release of a ball of `radius` m that nobody sees.

    stride: (T, 2) m, level, from one foot to the other, as the body stands in its step; None where nobody knows."""
    course = _Course(hand)
    times, tips, grip = course.times, course.velocity(PAD), course.velocity(HOLD)
    turning = _length(course.turn)
    gripped = course.fastest(HOLD, fastest(hand.carried(HOLD * hand.reach * hand.finger), hand.fps))
    roll = _roll(float(np.median(turning[_about(times, gripped, 0.01)])))
    wrist = _wrist(course, gripped, roll)
    last = int(np.searchsorted(times, times[wrist] + max(_LATEST * roll, 2.0 / hand.fps)))
    aim = _aim(course, tips, wrist, last, stride)
    forward = tips[wrist : last + 1] @ aim
    k = wrist + int(np.argmax(forward))
    rolled = _roll(float(turning[k]))
    start = max(int(np.searchsorted(times, times[k] - rolled)), 0)
    push = _push(course, k, aim)
    velocity = grip[start] + ROLLS_WITH * (tips[k] - tips[start])
    velocity = velocity + push * float((tips[k] - velocity) @ push)
    position = course.place(PAD)[k] + radius * push
    time_sigma = float(np.hypot(max(TIME_SIGMA, 0.5 * rolled), 0.3 / hand.fps))
    return HandRelease(time=float(times[k]), position=position, velocity=velocity, time_sigma=time_sigma,
                       speed_sigma=SPEED_SIGMA * float(np.linalg.norm(velocity)),
                       way_sigma=_swept(grip[_about(times, start, time_sigma)]), rolled=float(rolled))  # fmt: skip


def _roll(turning: float) -> float:
    """s that a ball needs along the fingers of a hand that turns by `turning` rad/s."""
    return float(np.arccosh(PAD / HOLD)) / max(turning, 5.0)


def _wrist(course: _Course, gripped: int, roll: float) -> int:
    """Which of the times is the one at which the wrist is fastest before the ball in it is: the first peak, for the arm
    swings on after a throw, and the wrist may be as fast again."""
    first, end = np.searchsorted(course.times, course.times[gripped] + [-_EARLIER * roll, _AFTER])
    first = int(min(first, gripped))
    speed = _length(course.velocity(0.0)[first : max(int(end), first + 1)])
    falls = np.append(np.diff(speed) <= 0.0, True)
    return first + int(np.argmax(falls & (speed >= _NEARLY * speed.max())))


class _Course:
    """Wrist and fingers between the frames: places and velocities of points along the stretched hand."""

    def __init__(self, hand: Hand):
        from scipy.interpolate import CubicSpline
        from scipy.signal import savgol_filter

        window = max(2 * int(round(0.5 * _SMOOTH * hand.fps)) + 1, 3)
        tip = hand.carried(hand.finger * hand.reach)
        wrist, tip = _filled(hand.origin), _filled(tip)
        if len(hand) > window:
            wrist, tip = (savgol_filter(points, window, 2, axis=0) for points in (wrist, tip))
        frames = np.arange(len(hand)) / hand.fps
        self.times = np.arange((len(hand) - 1) * _FINE + 1) / (hand.fps * _FINE)
        self._wrist, self._tip = CubicSpline(frames, wrist), CubicSpline(frames, tip)
        self._at, self._moves = self._wrist(self.times), self._wrist(self.times, 1)
        self._arm, arm_moves = self._tip(self.times) - self._at, self._tip(self.times, 1) - self._moves
        along = self._arm / np.maximum(_length(self._arm), 1e-9)[:, None]
        self._swing = arm_moves - along * np.sum(arm_moves * along, axis=-1)[:, None]
        self.turn = self._swing / np.maximum(_length(self._arm), 1e-9)[:, None]

    def fastest(self, share: float, frame: int) -> int:
        """Which of its times is the one at which that point is fastest, near a frame."""
        near = _about(self.times, frame * _FINE, _NEAR)
        return near.start + int(np.argmax(_length(self.velocity(share)[near])))

    def frame(self, k: int) -> int:
        """The frame nearest to one of its times."""
        return int(round(k / _FINE))

    def place(self, share: float) -> np.ndarray:
        """(N, 3) m of the point at `share` of the way from wrist to fingertip."""
        return self._at + share * self._arm

    def velocity(self, share: float) -> np.ndarray:
        """(N, 3) m/s of that point, the hand being rigid."""
        return self._moves + share * self._swing


def _aim(course: _Course, tips: np.ndarray, wrist: int, last: int, stride: np.ndarray | None) -> np.ndarray:
    """Unit (3,): where the throw goes: by the fingers' way while they are fast, and level also by the stride."""
    speed = _length(tips)
    peak = wrist + int(np.argmax(speed[wrist : last + 1]))
    first = peak
    while first > 0 and speed[first - 1] > _ACCELERATES * speed[peak]:
        first -= 1
    way = course.place(PAD)[peak] - course.place(PAD)[first]
    way = tips[peak] if np.linalg.norm(way) < 1e-6 else way
    way = way / np.linalg.norm(way)
    level, rise = float(np.hypot(way[0], way[1])), float(np.arcsin(np.clip(way[2], -1.0, 1.0)))
    rise = np.sign(rise) * max(abs(rise) - _ARC, 0.0)
    if level < 0.3:
        return way
    heading = way[:2] / level
    at = np.zeros(2) if stride is None else stride[course.frame(wrist)]
    size = float(np.linalg.norm(at))
    if size > _LEAST_STEP and abs(at @ heading) > 0.5 * size:
        heading = heading + at * (np.sign(at @ heading) / size)
        heading = heading / np.linalg.norm(heading)
    return np.append(heading * np.cos(rise), np.sin(rise))


def _push(course: _Course, k: int, aim: np.ndarray) -> np.ndarray:
    """Unit (3,): out of the fingers, across them and in the direction in which they swing; as `aim` where they do not
    swing."""
    push = course.turn[k]
    size = np.linalg.norm(push)
    return aim if size < 1.0 or push @ aim < 0.5 * size else push / size


def _swept(velocities: np.ndarray) -> float:
    """rad: half the angle between the first and the last of velocities (N, 3)."""
    first, last = velocities[0], velocities[-1]
    size = max(float(np.linalg.norm(first) * np.linalg.norm(last)), 1e-9)
    return 0.5 * float(np.arccos(np.clip(first @ last / size, -1.0, 1.0)))


def _about(times: np.ndarray, k: int, seconds: float) -> slice:
    return slice(*np.searchsorted(times, [times[k] - seconds, times[k] + seconds + 1e-9]).tolist())


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _filled(points: np.ndarray) -> np.ndarray:
    """Points (T, 3) with gaps bridged straight."""
    known = np.isfinite(points).all(axis=-1)
    if known.all():
        return points
    at = np.arange(len(points))
    return interpolate(at, at[known], points[known])
