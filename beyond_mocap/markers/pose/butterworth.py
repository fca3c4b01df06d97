"""The low-pass filter of a solved motion (Fredriksson §5.4): fourth order Butterworth, run forth and back.

Two passes of a second order filter make one of fourth order without any delay. Each pass alone lets half of the power
through at its own cutoff, both together only a quarter, so that each is given a somewhat higher one (Winter 2009,
"Biomechanics and Motor Control of Human Movement", §3.4.4.2): what is asked for is where both together let half of it
through.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...base.settings import setting
from ...motion import quaternion
from ...motion.motion import Motion

CUTOFF = setting("markers", "cutoff").default
"""Hertz; Fredriksson §5.4."""
LEAST_RATE = 2.2
"""Frames per second for each hertz of cutoff: below twice the cutoff there is nothing to filter out."""

_EACH_PASS = (2.0**0.5 - 1.0) ** 0.25  # a pass's cutoff is the asked one divided by this, on the bilinear scale
_PADDED = 2.0  # periods of the cutoff by which both ends are continued before the passes
_LEAST_FRAMES = 4


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
