"""The low-pass filters of a solved motion (Fredriksson §5.4): Butterworth of fourth order, run forth and back, and
Kalman smoothing, the alternative (§10.2; De Groote et al. 2008).

Butterworth: two passes of a second order filter make one of fourth order without any delay. Each pass alone lets half
of the power through at its own cutoff, both together only a quarter, so that each is given a somewhat higher one
(Winter 2009, "Biomechanics and Motor Control of Human Movement", §3.4.4.2): what is asked for is where both together
let half of it through.

Kalman: the state of every coordinate is its last three values. It goes on with the same acceleration but for a random
jerk, and is seen with noise. The smoothed curve is the most likely one given all frames, before and after: a least
squares problem, sum w_t |x_t - seen_t|^2 + q sum |x_t - 3 x_t-1 + 3 x_t-2 - x_t-3|^2, solved as one banded system a
joint, whose Cholesky factor is the filter's pass and whose back substitution that of Rauch, Tung and Striebel. It
knows how much each frame is worth: a joint whose markers are not seen is told by the frames around.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.errors import InputError
from ...base.settings import setting
from ...motion import quaternion
from ...motion.motion import Motion

CUTOFF = setting("markers", "cutoff").default  # hertz; Fredriksson §5.4
LEAST_RATE = 2.2  # frames per second for each hertz of cutoff: below twice the cutoff there is nothing to filter out

_EACH_PASS = (2.0**0.5 - 1.0) ** 0.25  # a pass's cutoff is the asked one divided by this, on the bilinear scale
_PADDED = 2.0  # periods of the cutoff by which both ends are continued before the passes
_LEAST_FRAMES = 4

_ORDER = 3  # of the difference that is noise: the jerk
_LEAST_WORTH = 1e-4  # an unseen frame's: the system stays solvable where few are seen


@dataclass(frozen=True, eq=False)
class Filtered:
    """motion: the filtered motion. notes: a line where it could not be filtered, else ()."""

    motion: Motion
    notes: tuple[str, ...] = ()


def butterworth(motion: Motion, cutoff: float = CUTOFF) -> Filtered:
    """A motion without what swings faster than `cutoff` hertz: the root's place and every joint's rotation.

    Rotations are filtered as quaternions of steady sign and brought back to length one: joints turn little between two
    frames, so the four numbers go along the same smooth curve as the rotation itself, through any angle.
    A motion of fewer than 4 frames, or of fewer than LEAST_RATE frames per second for each hertz, comes back unchanged
    with a note. Raises InputError where the cutoff is no positive number or the motion holds one that is none.
    Source: Fredriksson §5.4.
    """
    check_numbers(motion, cutoff)
    note = unfit(motion, cutoff)
    if note:
        return Filtered(motion, (note,))
    root = low_pass(motion.root_positions, motion.fps, cutoff)
    turned = quaternion.normalized(low_pass(quaternion.continuous(motion.rotations), motion.fps, cutoff))
    return Filtered(replace(motion, root_positions=root, rotations=turned))


def unfit(motion: Motion, cutoff: float) -> str:
    """Why a motion cannot be filtered at this cutoff, or ""."""
    if len(motion) < _LEAST_FRAMES:
        return f"{len(motion)} frames are too few to filter"
    if motion.fps < LEAST_RATE * cutoff:
        most = motion.fps / LEAST_RATE
        return (f"not filtered: {motion.fps:g} frames per second hold nothing above {motion.fps / 2:g} Hz; a cutoff of "
                f"{most:.3g} Hz or less would change something")
    return ""


def check_numbers(motion: Motion, cutoff: float) -> None:
    """Raises InputError where the cutoff is no positive number or the motion holds one that is none."""
    if not (np.isfinite(cutoff) and cutoff > 0):
        raise InputError("cutoff", f"{cutoff} hertz", "a positive number")
    if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
        raise InputError("motion", "places or rotations that are no numbers", "finite ones", "fill its gaps first")


def low_pass(values: np.ndarray, fps: float, cutoff: float) -> np.ndarray:
    """Values (T, ...) without what swings faster than `cutoff` hertz, zero phase, fourth order, -3 dB at the cutoff;
    both ends are continued by turning them about their last value."""
    from scipy.signal import butter, sosfiltfilt

    half = np.tan(np.pi * cutoff / fps) / _EACH_PASS  # the bilinear scale, on which the correction is exact
    sections = butter(2, np.arctan(half) / np.pi * 2.0, output="sos")
    padded = min(len(values) - 1, int(np.ceil(_PADDED * fps / cutoff)))
    return sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padded)


def kalman(motion: Motion, worth: np.ndarray | None = None, cutoff: float = CUTOFF) -> Filtered:
    """The most likely course of the root's place and of every joint's rotation.

    worth: (T, J) how much a frame tells of a joint, 1 as usual, 0 nothing (the inverse of its noise's variance); None
    for 1. cutoff: hertz at which half the power is let through where all frames are worth 1, by which the jerk's share
    of the noise is set, so that it stands beside `butterworth` at the same figure.
    A motion that is too short or too slow comes back unchanged with a note. Raises InputError for a worth of another
    shape or below 0, for a cutoff that is no positive number, and for a motion that holds numbers that are none."""
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
