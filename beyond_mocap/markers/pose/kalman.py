"""Kalman smoothing, the alternative to the Butterworth filter (Fredriksson §10.2; De Groote et al. 2008).

The state of every coordinate is its last three values: it goes on with the same acceleration but for a random jerk, and
is seen with noise. The smoothed course is the most likely one given all frames, before and after. Of such a model that
is a least squares problem, sum w_t |x_t - seen_t|^2 + q sum |x_t - 3 x_t-1 + 3 x_t-2 - x_t-3|^2, whose Cholesky factor
is found by the Kalman filter's pass from the first frame to the last, and whose back substitution is the smoother's
pass of Rauch, Tung and Striebel from the last to the first. So it is solved as that: one banded system for a joint.

Other than a filter of fixed shape it knows how much each frame is worth: a joint whose markers are not seen is told by
the frames around.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.errors import InputError
from ...motion import quaternion
from ...motion.motion import Motion
from .butterworth import CUTOFF, Filtered, check_numbers, unfit

_ORDER = 3  # of the difference that is noise: the jerk
_LEAST_WORTH = 1e-4  # an unseen frame's: the system stays solvable where few are seen


def kalman(motion: Motion, worth: np.ndarray | None = None, cutoff: float = CUTOFF) -> Filtered:
    """The most likely course of the root's place and of every joint's rotation.

    worth: (T, J) how much a frame tells of a joint, 1 as usual, 0 nothing (the inverse of its noise's variance); None
    for 1. cutoff: hertz at which half the power is let through where all frames are worth 1, by which the jerk's share
    of the noise is set, so that it stands beside `butterworth` at the same figure.
    A motion that is too short or too slow comes back unchanged with a note. Raises InputError for a worth of another
    shape or below 0, for a cutoff that is no positive number, and for a motion that holds numbers that are none.
    """
    check_numbers(motion, cutoff)
    worth = _checked(worth, motion)
    note = unfit(motion, cutoff)
    if note:
        return Filtered(motion, (note,))
    turns = quaternion.continuous(motion.rotations)
    price = jerk_price(motion.fps, cutoff)
    root = smoothed(motion.root_positions, worth[:, 0], price)
    turned = np.stack([smoothed(turns[:, joint], worth[:, joint], price) for joint in range(turns.shape[1])], axis=1)
    return Filtered(replace(motion, root_positions=root, rotations=quaternion.normalized(turned)))


def _checked(worth: np.ndarray | None, motion: Motion) -> np.ndarray:
    shape = motion.rotations.shape[:2]
    if worth is None:
        return np.ones(shape)
    worth = np.asarray(worth, dtype=float)
    if worth.shape != shape or not np.isfinite(worth).all() or (worth < 0).any():
        raise InputError("worth", f"shape {worth.shape}", f"{shape}, finite and not below 0")
    return np.maximum(worth, _LEAST_WORTH)


def jerk_price(fps: float, cutoff: float) -> float:
    """q, the variance of what is seen over that of the jerk, for which half of the power at `cutoff` hertz passes:
    a wave of w radians a frame comes through as 1 / (1 + q (2 sin w/2)^6)."""
    wave = 2.0 * np.sin(np.pi * cutoff / fps)
    return (2.0**0.5 - 1.0) / wave ** (2 * _ORDER)


def smoothed(seen: np.ndarray, worth: np.ndarray, price: float) -> np.ndarray:
    """The course (T, K) that minimizes sum worth |x - seen|^2 + price |its third difference|^2; seen (T, K), worth
    (T,) above 0."""
    origin = seen.mean(axis=0)  # what is far from the origin loses no digits
    squares = BandedLeastSquares(len(seen), reach=_ORDER, columns=seen.shape[1])
    squares.add_value(worth, goal=seen - origin)
    squares.add_difference(_ORDER, price)
    return squares.solve() + origin
