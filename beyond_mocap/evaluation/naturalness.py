"""What the eye sees: whether a body turns, stands, walks and looks like one person (`../shared/metrics.md`).

All figures are measured at 30 frames per second, with the leg length brought to 0.86 m, by the same code on takes and
on recordings. The heading is that of the line through hips and shoulders; speed is the pelvis' through a window of
0.5 s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.time_series import find_runs, time_derivative
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints, measure_leg_length
from ..motion.motion import Motion, forward_kinematics, resample
from ..motion.track import smooth_zero_phase_hann
from ..motion.track.resting_place import find_rests

FPS = 30.0
LEG_LENGTH = 0.86  # m
SPEED_WINDOW = 0.5  # s
SNAP_ANGLE, SNAP_SECONDS = np.radians(75.0), 0.3  # change of heading of a snap turn, and within what time
SPIN_ANGLE, SPIN_SECONDS = np.radians(200.0), 2.0  # the same of a spin
DROP_HEIGHT, DROP_SECONDS = 0.15, 0.2  # m by which the pelvis falls, and within what time
SLOW_SPEED = 2.0  # m/s below which dwell and body language are measured, and above which facing off travel is
STAND_SECONDS = 1.5  # of the shortest stand
TRAVEL_SECONDS = 0.5  # s, window of the direction of travel
SHORT_DWELL = 0.5  # s


@dataclass(frozen=True, eq=False)
class BodyCourse:
    """What the figures are measured on, T frames at FPS.

    Attributes:
        heading: (T,) rad, unwrapped.
        speed: (T,) m/s.
        travel: (T,) rad, direction of travel.
        pelvis_height: (T,) m.
        planted: (T, 2) bool, left and right foot in contact with the ground.
    """

    heading: np.ndarray
    speed: np.ndarray
    travel: np.ndarray
    pelvis_height: np.ndarray
    planted: np.ndarray

    @property
    def minutes(self) -> float:
        """Duration in minutes."""
        return len(self.heading) / FPS / 60.0


def measure_course(motion: Motion, contacts: np.ndarray) -> BodyCourse:
    """Measure heading, speed and height of a body.

    Args:
        motion: at any rate.
        contacts: (its frames, 2) bool, left and right foot in contact.
    Returns:
        The course at FPS.
    """
    count = max(int(round((len(motion) - 1) * FPS / motion.fps)) + 1, 1)
    nearest = np.minimum(np.rint(np.arange(count) * motion.fps / FPS).astype(int), len(motion) - 1)
    at_rate = motion if motion.fps == FPS else resample(motion, FPS)
    nearest = nearest[: len(at_rate)]
    positions, _ = forward_kinematics(at_rate)
    size = LEG_LENGTH / measure_leg_length(motion.skeleton)
    pelvis = positions[:, identify_joints(motion.skeleton).hips] * size
    velocity = time_derivative(smooth_zero_phase_hann(pelvis[:, :2], FPS, SPEED_WINDOW), FPS)
    return BodyCourse(
        heading=np.unwrap(compute_heading_from_positions(at_rate.skeleton, positions)),
        speed=np.linalg.norm(velocity, axis=1), travel=np.arctan2(velocity[:, 1], velocity[:, 0]),
        pelvis_height=pelvis[:, 2], planted=np.asarray(contacts)[nearest],
    )


def find_fast_turns(heading: np.ndarray, angle: float, seconds: float) -> list[int]:
    """Find the turns by more than `angle` rad within some seconds: the frame in the middle of each.

    Args:
        heading: (T,) rad, unwrapped, at FPS.
        angle: rad.
        seconds: the time.
    """
    reach = int(round(seconds * FPS))
    turned = np.zeros(len(heading), dtype=bool)
    for step in range(1, min(reach, len(heading) - 1) + 1):
        turned[:-step] |= np.abs(heading[step:] - heading[:-step]) > angle
    return [min((first + end - 1 + reach) // 2, len(heading) - 1) for first, end in find_runs(turned)]


def find_pelvis_drops(height: np.ndarray) -> list[int]:
    """Find where the pelvis falls by more than DROP_HEIGHT within DROP_SECONDS: the first frame of each.

    Args:
        height: (T,) m at FPS.
    """
    reach = int(round(DROP_SECONDS * FPS))
    if len(height) <= reach:
        return []
    fallen = np.zeros(len(height), dtype=bool)
    for step in range(1, reach + 1):
        fallen[:-step] |= height[:-step] - height[step:] > DROP_HEIGHT
    return [first for first, _ in find_runs(fallen)]


def measure_dwell(transitions: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Measure how long each piece between two cuts lasts, where the body is slower than SLOW_SPEED on average.

    Args:
        transitions: (S,) frames of the cuts at FPS.
        speed: (T,) m/s.
    Returns:
        Seconds of each such piece; the first and last one, which the take's ends cut off, are left out.
    """
    pieces = zip(transitions, transitions[1:])
    return np.array([(end - first) / FPS for first, end in pieces if speed[first:end].mean() < SLOW_SPEED])


def measure_facing_off_travel(course: BodyCourse) -> np.ndarray:
    """Measure the angle (N,) rad between heading and travel in the frames faster than SLOW_SPEED."""
    fast = course.speed > SLOW_SPEED
    return np.abs(quaternion.wrap_angle(course.heading - course.travel))[fast]


@dataclass(frozen=True)
class Standing:
    """How a body stands where its track does not move.

    Attributes:
        seconds: of all stands.
        foot_lifts: how often a foot leaves the ground in them.
        both_down: share of the time with both feet on the ground.
    """

    seconds: float
    foot_lifts: int
    both_down: float


def measure_standing(track: np.ndarray, planted: np.ndarray) -> Standing:
    """Measure how a body stands in the stands of its track.

    Args:
        track: (T, 2) m at FPS.
        planted: (T, 2) bool.
    """
    lifts = frames = both = 0
    for first, end in find_rests(track, FPS, seconds=STAND_SECONDS):
        inside = planted[first:end]
        lifts += int(np.sum(inside[:-1] & ~inside[1:]))
        both += int(inside.all(axis=1).sum())
        frames += end - first
    return Standing(frames / FPS, lifts, both / frames if frames else float("nan"))
