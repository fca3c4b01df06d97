"""A body in the air: its centre of mass follows a parabola, whatever its limbs do."""

from __future__ import annotations

import numpy as np

from ...motion.humanoid import identify_joints
from ...motion.mass import compute_centre_of_mass
from ...motion.motion import forward_kinematics
from ...motion.retargeting.neutral import NeutralStance
from ...motion.retargeting.posture import Posture, to_motion
from ...motion.supports import GRAVITY

_PUSH_SECONDS = 0.25  # s before take-off and after landing in which the legs take up the change of speed


def apply_flight(posture: Posture, times: np.ndarray, flight: tuple[float, float], neutral: NeutralStance,
                 lands_on_feet: bool = True) -> Posture:
    """Move the whole body in a flight so that its centre of mass falls freely from take-off to landing.

    Its places at both ends stay, so the time of flight decides how high it rises. Before and after, the hips move at
    the speeds of the flight's ends.

    Args:
        posture: T frames.
        times: (T,) s.
        flight: s of take-off and landing.
        neutral: neutral stance of the body.
        lands_on_feet: whether the legs absorb the landing.
    Returns:
        The posture.
    """
    begin, end = flight
    motion = to_motion(posture, neutral)
    centre = compute_centre_of_mass(identify_joints(neutral.skeleton), forward_kinematics(motion)[0])
    ends = [np.array([np.interp(moment, times, column) for column in centre.T]) for moment in flight]
    share = ((times - begin) / (end - begin))[:, None]
    parabola = ends[0] + (ends[1] - ends[0]) * share
    parabola[:, 2] += 0.5 * GRAVITY * (times - begin) * (end - times)
    in_air = (times > begin) & (times < end)
    shift = np.where(in_air[:, None], parabola - centre, 0.0)
    slope = np.gradient(parabola - centre, times, axis=0)
    first, last = np.flatnonzero(in_air)[[0, -1]]
    push = _ease_speed(times - begin, slope[first + 1])
    if lands_on_feet:
        push = push - _ease_speed(end - times, slope[last - 1])
    return posture.replace_arrays(hips=posture.hips + shift + push, ankles=posture.ankles + shift[:, None])


def _ease_speed(seconds: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Compute a shift (T, 3) m that is over at 0 s with `speed` (3,) m/s and begins from rest before."""
    share = np.clip(1.0 + seconds / _PUSH_SECONDS, 0.0, 1.0)
    return np.where(seconds <= 0.0, seconds * share**2, 0.0)[:, None] * speed
