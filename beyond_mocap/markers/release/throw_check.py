"""Decide from the hands whether a recording shows a throw; a release that no ball shows must not be invented.

A throwing hand is fast once. What else moves hands fast:

- Walking, running, kicking and jumping swing both arms, again and again. Relative to the hips, a hand is then about as
  fast as the other one, or as it was a stride before: 313 of 365 recordings without a throw are refused by this, and 44
  are too slow. In recorded and synthetic throws no hand reaches more than 0.4 of the throwing hand's maximum speed
  within 2 s around the swing.
- A racquet is faster than the hand that holds it. After the impact it pulls the hand on, so a server's hand is fastest
  on its way straight down (76 to 84 degrees below the horizon in five serves). An empty hand is fastest at the release
  (10 to 37 degrees below the horizon in four pitches) and is braked from then on.

So the limit for slow throws is set by what else the arms do: beside a walk, whose hands reach 1.7 m/s, a throwing hand
must reach 3.4 m/s, beside standing MIN_SPEED. Two-handed throws have two equal hands: they need a marker on the ball,
or the hand chosen by the user. One arm that is flung aside in a kick is taken for a throw (7 of the 365 recordings).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.errors import InputError
from ...motion.hand import Hand
from .throwing_hand import compute_steady_speeds

MIN_SPEED = 1.5  # m/s relative to the hips that a throwing hand reaches
MAX_OTHER_SHARE = 0.5  # share of its maximum speed that hands may reach apart from the swing itself
MAX_DESCENT = np.radians(60.0)  # rad below the horizon at which a throwing hand may be fastest
_NEARBY_SECONDS = 2.0  # s before and after, in which hands are compared; a stride of a slow walk takes 1.3 s
_SWING_SECONDS = (-0.4, 0.6)  # s around the fastest time that belong to the swing: wind-up, and follow-through
_FAST_SHARE = 0.95  # share of the maximum speed, from which on the hand's direction counts


def check_throw(hand: Hand, others: Sequence[Hand], hips: np.ndarray, name: str) -> None:
    """Raise InputError if the hand does not throw.

    Args:
        hand: the hand that seems to throw, T frames.
        others: hands that must be slower, T frames each; none where the user has chosen the hand.
        hips: (T, 3) metres, in the hands' space without their shift.
        name: of the trial.
    Raises:
        InputError: if the hand is too slow, a hand is about as fast at other times, or it is fastest downwards.
    """
    speeds = _compute_speeds(hand, hips)
    peak = int(np.argmax(speeds))
    if speeds[peak] < MIN_SPEED:
        raise InputError(name, f"a {hand.side} hand of at most {speeds[peak]:.1f} m/s relative to the hips", "a throw",
                         "choose another trial" if others else "choose another trial, or the other hand")
    seconds = hand.times - hand.times[peak]
    is_near = np.abs(seconds) < _NEARBY_SECONDS
    is_swing = (seconds > _SWING_SECONDS[0]) & (seconds < _SWING_SECONDS[1])
    for other, rest in ((hand, is_near & ~is_swing), *((other, is_near) for other in others)):
        _check_rest(other, np.where(rest, _compute_speeds(other, hips), 0.0), hand, speeds, name)
    descent = _measure_descent(hand, hips, speeds, peak)
    if descent > MAX_DESCENT:
        raise InputError(name, f"a {hand.side} hand that is fastest ({speeds[peak]:.1f} m/s at {hand.times[peak]:.3f} "
                         f"s) on its way down, as with a racquet", "a throw", "choose another trial")  # fmt: skip


def _compute_speeds(hand: Hand, hips: np.ndarray) -> np.ndarray:
    """Compute the hand's speed relative to the hips, (T,) m/s."""
    return compute_steady_speeds(hand.origin - hand.shift - hips, hand.fps)


def _check_rest(other: Hand, rest: np.ndarray, hand: Hand, speeds: np.ndarray, name: str) -> None:
    """Raise InputError if `rest` (T,) m/s, the speed of a hand apart from the swing, is about as fast as the swing."""
    frame, peak = int(np.argmax(rest)), int(np.argmax(speeds))
    if rest[frame] > MAX_OTHER_SHARE * speeds[peak]:
        found = (f"a {hand.side} hand of {speeds[peak]:.1f} m/s relative to the hips at {hand.times[peak]:.3f} s, and "
                 f"a {other.side} hand of {rest[frame]:.1f} m/s at {other.times[frame]:.3f} s, as in a run or a jump")
        which = "the other hand" if other is hand else "the hand"
        raise InputError(name, found, "a throw, whose hand is twice as fast as hands are otherwise",
                         f"choose another trial, cut it to the throw, or choose {which}")


def _measure_descent(hand: Hand, hips: np.ndarray, speeds: np.ndarray, peak: int) -> float:
    """Measure the angle in rad below the horizon at which the hand moves, against the hips, while it is fastest."""
    is_slow = speeds < _FAST_SHARE * speeds[peak]
    first = peak - int(np.argmax(is_slow[peak::-1])) if is_slow[: peak + 1].any() else 0
    last = peak + int(np.argmax(is_slow[peak:])) if is_slow[peak:].any() else len(speeds) - 1
    trajectory = hand.origin - hand.shift - hips
    moved = trajectory[last] - trajectory[first]
    return float(-np.arcsin(np.clip(moved[2] / max(float(np.linalg.norm(moved)), 1e-9), -1.0, 1.0)))
