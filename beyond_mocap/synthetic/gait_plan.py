"""The plan of a gait: speed, path, heading and stride phase at every moment.

`plan_gait` turns requested speeds, turns and directions into the moments of a `GaitPlan`; feet, trunk and arms in
`gait` all read from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.easing import quintic_step
from ..base.errors import InputError
from ..base.time_series import hann_smooth
from ..motion.retargeting.neutral import NeutralStance
from . import gait_tables as tables
from .gait_tables import interpolate_figure

# the plan extends this many seconds beyond both ends, so that stances which cross them are known; less for a body that
# runs all the time, that is from this speed in m/s on
_PAD, _RUNNING_PAD, _RUNNING_SPEED = 2.5, 1.9, 2.0
# Hz: feet are planned at this rate or more, a multiple of the output's rate
_PLAN_RATE = 120.0


@dataclass(frozen=True, kw_only=True)
class GaitStyle:
    """Differences between walkers, all relative to the published figures.

    Attributes:
        cadence: factor on steps per second (longer or shorter strides).
        bounce: factor on the vertical movement of the hips, below a sprint, where contacts decide it.
        arm_swing: factor.
        twist: factor on the turn of shoulders against pelvis.
        lean: rad added to the trunk's forward lean, in a sprint 0.035 at most.
        head: rad added to the head's nod.
        abduct: rad added to how far the arms are held away.
        elbow: rad added to the elbows' flexion, in a sprint 0.1 at most.
        width: m added between the feet.
        toe_out: rad added to the outward turn of the feet.
        crouch: rad added to the knees' flexion in stance.
        life: factor on breathing, sway and the small variation from stride to stride.
    """

    cadence: float = 1.0
    bounce: float = 1.0
    arm_swing: float = 1.0
    twist: float = 1.0
    lean: float = 0.0
    head: float = 0.0
    abduct: float = 0.0
    elbow: float = 0.0
    width: float = 0.0
    toe_out: float = 0.0
    crouch: float = 0.0
    life: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class GaitPlan:
    """A gait planned over N moments, `pad` of them before the first and after the last requested frame.

    Attributes:
        times: (N,) s, 0 at the first requested frame.
        speed: (N,) m/s.
        adult_speed: (N,) m/s, the same speed scaled to an adult's leg, with which the tables are read.
        direction: (N,) rad, travel relative to the heading.
        heading: (N,) rad.
        path: (N, 2) m.
        acceleration: (N, 2) m/s^2 of the path, smoothed over a step.
        phase: (N,) strides; the left foot lands at whole numbers, the right one half a stride later.
        pad: number of moments before the first and after the last requested frame.
        stride: number of moments from one requested frame to the next.
    """

    times: np.ndarray
    speed: np.ndarray
    adult_speed: np.ndarray
    direction: np.ndarray
    heading: np.ndarray
    path: np.ndarray
    acceleration: np.ndarray
    phase: np.ndarray
    pad: int
    stride: int

    @property
    def requested_slice(self) -> slice:
        """The moments that are frames of the result."""
        return slice(self.pad, len(self.times) - self.pad, self.stride)


def plan_gait(
    speed, duration, fps: float, neutral: NeutralStance, *, phase=0.0, turn_rate=0.0, direction=0.0, style=GaitStyle(),
    seed=0
) -> GaitPlan:
    """Plan a gait.

    Args:
        speed, duration, fps, phase, turn_rate, direction, style, seed: as for `build_gait`.
        neutral: neutral stance of the body.
    Returns:
        The plan at a multiple of `fps`, _PLAN_RATE or more.
    Raises:
        InputError: for speeds below 0 or above 9.5 m/s, or arrays of different lengths.
    """
    count = _count_frames(speed, duration, fps, turn_rate, direction)
    stride = int(np.ceil(_PLAN_RATE / fps))
    rate = fps * stride
    pad = int(np.ceil((_RUNNING_PAD if np.min(speed) >= _RUNNING_SPEED else _PAD) * rate))
    times = (np.arange((count - 1) * stride + 1 + 2 * pad) - pad) / rate
    speed, turn_rate, direction = (_interpolate(values, times, fps, count) for values in (speed, turn_rate, direction))
    if np.any(speed < 0.0) or np.any(speed > tables.FASTEST + 1e-9) or not np.all(np.isfinite(speed)):
        raise InputError("gait", f"speed {np.min(speed):.3g} .. {np.max(speed):.3g} m/s", "0 .. 9.5")
    heading = _integrate(turn_rate, rate, pad)
    travel_angle = heading + direction
    velocity = speed[:, None] * np.stack([np.cos(travel_angle), np.sin(travel_angle)], axis=-1)
    path = np.stack([_integrate(velocity[:, axis], rate, pad) for axis in range(2)], axis=-1)
    acceleration = np.stack(
        [hann_smooth(np.gradient(velocity[:, axis], 1.0 / rate), int(0.35 * rate)) for axis in (0, 1)], -1
    )
    root_scale = np.sqrt(neutral.leg / tables.LEG)
    adult_speed = speed / root_scale
    frequency = compute_stride_frequency(adult_speed, direction, turn_rate * root_scale) / root_scale * style.cadence
    frequency = frequency * (1.0 + 0.015 * style.life * compute_wander(times, seed, 3.1))
    strides = phase + _integrate(frequency, rate, pad)
    return GaitPlan(times=times, speed=speed, adult_speed=adult_speed, direction=direction, heading=heading, path=path,
                    acceleration=acceleration, phase=strides, pad=pad, stride=stride)


def compute_stride_frequency(adult_speed: np.ndarray, direction: np.ndarray, turn_rate: np.ndarray) -> np.ndarray:
    """Compute the stride frequency of an adult.

    It is higher when going backward or sideways, or when turning on the spot.

    Args:
        adult_speed: (T,) m/s.
        direction: (T,) rad, travel relative to the heading.
        turn_rate: (T,) rad/s.
    Returns:
        (T,) strides per second.
    """
    walking = interpolate_figure("frequency", adult_speed) * (1.0 + 0.22 * np.sin(0.5 * direction) ** 2 + 0.5
                                                              * np.sin(direction) ** 2)
    on_the_spot = 1.0 - quintic_step(adult_speed / 1.8)
    return np.hypot(walking, on_the_spot * turn_rate / 1.3)


def compute_wander(times: np.ndarray, seed: int, period: float) -> np.ndarray:
    """Compute a slow random wave of roughly unit size: four sines around `period` seconds with seeded phases.

    Args:
        times: (N,) s.
        seed: of the phases.
        period: s.
    Returns:
        (N,) values.
    """
    random = np.random.default_rng(seed)
    rates, phases = np.array([0.6, 0.9, 1.35, 1.9]) / period, random.uniform(0.0, 2.0 * np.pi, 4)
    return np.sin(2.0 * np.pi * rates * times[:, None] + phases) @ np.array([0.5, 0.45, 0.35, 0.25])


def _count_frames(speed, duration, fps, turn_rate, direction) -> int:
    """Find the number of requested frames; InputError if duration and arrays disagree."""
    lengths = {np.size(v) for v in (speed, turn_rate, direction) if np.ndim(v)}
    if duration is not None:
        lengths.add(int(round(duration * fps)) + 1)
    if len(lengths) != 1:
        raise InputError("gait", f"{sorted(lengths) or 'no'} frames", "one length: a duration or arrays of one size")
    return lengths.pop()


def _interpolate(values, times: np.ndarray, fps: float, count: int) -> np.ndarray:
    """Interpolate one value or values (count,) of the frames to times (T,) s."""
    values = np.broadcast_to(np.asarray(values, dtype=float), (count,))
    return np.interp(times, np.arange(count) / fps, values)


def _integrate(values: np.ndarray, rate: float, zero: int) -> np.ndarray:
    """Integrate values (T,) over time by the trapezoidal rule; the result is 0 at index `zero`."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))]) / rate
    return total - total[zero]
