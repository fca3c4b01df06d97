"""Low-pass filters of a solved motion (Fredriksson section 5.4): Butterworth of fourth order, forwards and backwards,
and Kalman smoothing, the alternative (section 10.2; De Groote et al. 2008).

Butterworth: two passes of a second-order filter form one of fourth order without delay. Each pass alone lets half of
the power through at its own cutoff, both together only a quarter, so each gets a somewhat higher one (Winter 2009,
"Biomechanics and Motor Control of Human Movement", section 3.4.4.2). The requested cutoff is where both together let
half of the power through.

Kalman: the state of every coordinate is its last three values. It continues with the same acceleration plus a random
jerk, and is observed with noise. The smoothed curve is the most likely one given all frames: a least-squares problem,
sum w_t |x_t - seen_t|^2 + q sum |x_t - 3 x_t-1 + 3 x_t-2 - x_t-3|^2, solved as one banded system for each joint, whose
Cholesky factor is the filter's pass and whose back substitution is that of Rauch, Tung and Striebel. It knows the
weight of each frame: a joint whose markers are occluded follows the frames around.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.errors import InputError
from ...base.settings import find_setting
from ...motion import quaternion
from ...motion.motion import Motion

CUTOFF = find_setting("markers", "cutoff").default  # hertz; Fredriksson §5.4
MIN_RATE = 2.2  # frames per second for each hertz of cutoff; below twice the cutoff there is nothing to remove

_EACH_PASS = (2.0**0.5 - 1.0) ** 0.25  # a pass's cutoff is the requested one divided by this, on the bilinear scale
_PADDING_PERIODS = 2.0  # periods of the cutoff by which both ends are extended before the passes
_MIN_FRAMES = 4  # frames that can be filtered at least

_ORDER = 3  # of the difference that is noise: the jerk
_MIN_WEIGHT = 1e-4  # weight of an occluded frame: the system stays solvable where few are visible


@dataclass(frozen=True, eq=False)
class FilterResult:
    """A filtered motion.

    Attributes:
        motion: the motion.
        notes: a message where it could not be filtered, else ().
    """

    motion: Motion
    notes: tuple[str, ...] = ()


def filter_butterworth(motion: Motion, cutoff: float = CUTOFF) -> FilterResult:
    """Remove what oscillates faster than a cutoff from the root's place and every joint's rotation.

    Rotations are filtered as quaternions of continuous sign and normalized: joints rotate little between two frames, so
    the four numbers follow the same smooth curve as the rotation itself, through any angle.

    Args:
        motion: the motion. With fewer than 4 frames, or fewer than MIN_RATE frames per second for each hertz, it is
            returned unchanged with a message.
        cutoff: hertz.
    Returns:
        The filtered motion and messages.
    Raises:
        InputError: if the cutoff is not a positive number, or the motion contains NaN or infinite values.
    Source: Fredriksson section 5.4.
    """
    check_finite(motion, cutoff)
    note = describe_unfilterable(motion, cutoff)
    if note:
        return FilterResult(motion, (note,))
    root = filter_values(motion.root_positions, motion.fps, cutoff)
    rotations = quaternion.normalize(filter_values(quaternion.unify_signs(motion.rotations), motion.fps, cutoff))
    return FilterResult(replace(motion, root_positions=root, rotations=rotations))


def describe_unfilterable(motion: Motion, cutoff: float) -> str:
    """Return why a motion cannot be filtered at this cutoff, or ""."""
    if len(motion) < _MIN_FRAMES:
        return f"not filtered: {len(motion)} frames are too few"
    if motion.fps < MIN_RATE * cutoff:
        most = motion.fps / MIN_RATE
        return (f"not filtered: {motion.fps:g} frames per second contain nothing above {motion.fps / 2:g} Hz; use a "
                f"cutoff of {most:.3g} Hz or less")
    return ""


def check_finite(motion: Motion, cutoff: float) -> None:
    """Raise InputError if the cutoff is not a positive number, or the motion contains NaN or infinite values."""
    if not (np.isfinite(cutoff) and cutoff > 0):
        raise InputError("cutoff", f"{cutoff} hertz", "a positive number")
    if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
        raise InputError("motion", "NaN or infinite places or rotations", "finite numbers", "fill its gaps first")


def filter_values(values: np.ndarray, fps: float, cutoff: float) -> np.ndarray:
    """Filter values with a zero-phase low-pass of fourth order, -3 dB at the cutoff.

    Both ends are extended by reflecting them about their last value.

    Args:
        values: (T, ...).
        fps: frames per second.
        cutoff: hertz.
    Returns:
        The filtered values, same shape.
    """
    from scipy.signal import butter, sosfiltfilt

    half = np.tan(np.pi * cutoff / fps) / _EACH_PASS  # the bilinear scale, on which the correction is exact
    sections = butter(2, np.arctan(half) / np.pi * 2.0, output="sos")
    padded = min(len(values) - 1, int(np.ceil(_PADDING_PERIODS * fps / cutoff)))
    return sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padded)


def smooth_kalman(motion: Motion, weights: np.ndarray | None = None, cutoff: float = CUTOFF) -> FilterResult:
    """Estimate the most likely curve of the root's place and of every joint's rotation.

    Args:
        motion: the motion. If it is too short or too slow, it is returned unchanged with a message.
        weights: (T, J) weight of each frame for each joint, 1 as usual, 0 for none (the inverse variance of its noise);
            None for 1.
        cutoff: hertz at which half the power passes where all weights are 1. It sets the jerk's share of the noise, so
            that it is comparable with the cutoff of `filter_butterworth`.
    Returns:
        The smoothed motion and messages.
    Raises:
        InputError: if weights have another shape or are below 0, the cutoff is not a positive number, or the motion
            contains NaN or infinite values.
    Source: De Groote et al. 2008; Fredriksson section 10.2.
    """
    check_finite(motion, cutoff)
    weights = _check_weights(weights, motion)
    note = describe_unfilterable(motion, cutoff)
    if note:
        return FilterResult(motion, (note,))
    quaternions = quaternion.unify_signs(motion.rotations)
    jerk_cost = compute_jerk_cost(motion.fps, cutoff)
    root = smooth_values(motion.root_positions, weights[:, 0], jerk_cost)
    rotations = np.stack([smooth_values(quaternions[:, joint], weights[:, joint], jerk_cost)
                          for joint in range(quaternions.shape[1])], axis=1)
    return FilterResult(replace(motion, root_positions=root, rotations=quaternion.normalize(rotations)))


def _check_weights(weights: np.ndarray | None, motion: Motion) -> np.ndarray:
    """Return the weights (T, J), all positive; raise InputError where they are not valid."""
    shape = motion.rotations.shape[:2]
    if weights is None:
        return np.ones(shape)
    weights = np.asarray(weights, dtype=float)
    if weights.shape != shape or not np.isfinite(weights).all() or (weights < 0).any():
        raise InputError("weights", f"shape {weights.shape}", f"{shape}, finite and not below 0")
    return np.maximum(weights, _MIN_WEIGHT)


def compute_jerk_cost(fps: float, cutoff: float) -> float:
    """Compute the cost of the jerk for which half of the power passes at the cutoff.

    It is q, the variance of the observations over that of the jerk: a wave of w radians per frame passes with the
    factor 1 / (1 + q (2 sin w/2)^6).

    Args:
        fps: frames per second.
        cutoff: hertz.
    """
    wave = 2.0 * np.sin(np.pi * cutoff / fps)
    return (2.0**0.5 - 1.0) / wave ** (2 * _ORDER)


def smooth_values(seen: np.ndarray, weights: np.ndarray, jerk_cost: float) -> np.ndarray:
    """Minimise sum weight |x - seen|^2 + cost |third difference of x|^2.

    Args:
        seen: (T, K) observed values.
        weights: (T,) above 0.
        jerk_cost: cost of the jerk.
    Returns:
        (T, K) the smoothed curve.
    """
    origin = seen.mean(axis=0)  # centred, so that no digits are lost far from the origin
    squares = BandedLeastSquares(len(seen), reach=_ORDER, columns=seen.shape[1])
    squares.add_value(weights, goal=seen - origin)
    squares.add_difference(_ORDER, jerk_cost)
    return squares.solve() + origin
