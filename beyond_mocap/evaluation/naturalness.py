"""What the eye sees: whether a body turns, stands, walks and looks like one person (`../shared/metrics.md`).

The same code measures takes and recordings. The heading is that of the line through hips and shoulders; speed is the
pelvis' through a window of 0.5 s; lengths are brought to a leg of 0.86 m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import TimedMessage, format_seconds
from ..base.time_series import find_runs, time_derivative
from ..base.vectors import arctan2, unit_vectors
from ..library.posture import NormalPostures, compute_postures
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints, measure_leg_length
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann
from ..motion.track.resting_place import find_rests

LEG_LENGTH = 0.86  # m
SPEED_WINDOW = 0.5  # s
SNAP_ANGLE, SNAP_SECONDS = np.radians(75.0), 0.3  # change of heading of a snap turn, and within what time
SPIN_ANGLE, SPIN_SECONDS = np.radians(200.0), 2.0  # the same of a spin
DROP_HEIGHT, DROP_SECONDS = 0.15, 0.2  # m by which the pelvis falls, and within what time
SLOW_SPEED = 2.0  # m/s below which dwell and postures are measured, and above which facing off travel is
STAND_SECONDS = 1.5  # of the shortest stand
SHORT_DWELL = 0.5  # s
_MAX_LISTED = 6  # seconds that a message lists


@dataclass(frozen=True, eq=False)
class BodyCourse:
    """Where a body faces and goes, T frames.

    Attributes:
        fps: frames per second.
        heading: (T,) rad, unwrapped.
        speed: (T,) m/s.
        travel: (T,) rad, direction of travel.
        pelvis_height: (T,) m.
        posture: (T, K) of `library.posture`.
    """

    fps: float
    heading: np.ndarray
    speed: np.ndarray
    travel: np.ndarray
    pelvis_height: np.ndarray
    posture: np.ndarray

    @property
    def minutes(self) -> float:
        """Duration in minutes."""
        return len(self.heading) / self.fps / 60.0


def measure_course(skeleton: Skeleton, positions: np.ndarray, fps: float) -> BodyCourse:
    """Measure where a body faces and goes.

    Args:
        skeleton: J joints.
        positions: (T, J, 3) m, world.
        fps: frames per second.
    """
    body = identify_joints(skeleton)
    pelvis = positions[:, body.hips] * (LEG_LENGTH / measure_leg_length(skeleton))
    velocity = time_derivative(smooth_zero_phase_hann(pelvis[:, :2], fps, SPEED_WINDOW), fps)
    heading = np.unwrap(compute_heading_from_positions(skeleton, positions))
    return BodyCourse(
        fps=fps, heading=heading, speed=np.linalg.norm(velocity, axis=1),
        travel=arctan2(velocity[:, 1], velocity[:, 0]), pelvis_height=pelvis[:, 2],
        posture=compute_postures(positions, heading, fps, body),
    )


def find_fast_turns(course: BodyCourse, angle: float, seconds: float) -> list[int]:
    """Find the turns by more than `angle` rad within some seconds: a frame in the middle of each."""
    reach, heading = int(round(seconds * course.fps)), course.heading
    turned = np.zeros(len(heading), dtype=bool)
    for step in range(1, min(reach, len(heading) - 1) + 1):
        turned[:-step] |= np.abs(heading[step:] - heading[:-step]) > angle
    return [min((first + end - 1 + reach) // 2, len(heading) - 1) for first, end in find_runs(turned)]


def find_snap_turns(course: BodyCourse) -> list[int]:
    """Find the turns by more than 75 degrees within 0.3 s, more than a body does over one foot."""
    return find_fast_turns(course, SNAP_ANGLE, SNAP_SECONDS)


def find_spins(course: BodyCourse) -> list[int]:
    """Find the turns by more than 200 degrees within 2 s."""
    return find_fast_turns(course, SPIN_ANGLE, SPIN_SECONDS)


def find_pelvis_drops(course: BodyCourse) -> list[int]:
    """Find where the pelvis falls by more than 15 cm within 0.2 s: the first frame of each fall."""
    reach, height = int(round(DROP_SECONDS * course.fps)), course.pelvis_height
    fallen = np.zeros(len(height), dtype=bool)
    for step in range(1, min(reach, len(height) - 1) + 1):
        fallen[:-step] |= height[:-step] - height[step:] > DROP_HEIGHT
    return [first for first, _ in find_runs(fallen)]


EVENTS = (
    ("snap_turns", find_snap_turns, "the body turns by more than 75 degrees within 0.3 s"),
    ("spins", find_spins, "the body turns by more than 200 degrees within 2 s"),
    ("pelvis_drops", find_pelvis_drops, "the hips fall by more than 15 cm within 0.2 s"),
)
"""Name, detector and message of each event that is counted per minute."""


def measure_dwell(course: BodyCourse, transitions: np.ndarray) -> np.ndarray:
    """Measure how long each piece between two cuts lasts where the body is slow.

    Args:
        course: the body.
        transitions: (S,) first frames of the pieces but the first one.
    Returns:
        Seconds of each; the first and the last piece, which end with the take, are left out.
    """
    pieces = [(first, end) for first, end in zip(transitions, transitions[1:])
              if course.speed[first:end].mean() < SLOW_SPEED]
    return np.array([(end - first) / course.fps for first, end in pieces])


def measure_facing_off_travel(course: BodyCourse) -> np.ndarray:
    """Measure the angle (N,) rad between heading and travel in the frames faster than SLOW_SPEED."""
    return np.abs(quaternion.wrap_angle(course.heading - course.travel))[course.speed > SLOW_SPEED]


def measure_head_off_ball(skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray, ball: np.ndarray,
                          look: np.ndarray) -> np.ndarray:
    """Measure the angle between where the head looks and the ball, where a body can turn its head to it.

    Args:
        skeleton: J joints.
        positions: (T, J, 3) m, world.
        rotations: (T, J, 4) world.
        ball: (T, 3) m, world, NaN where unknown.
        look: (3,) unit, direction in which the head joint looks, in its own frame.
    Returns:
        (N,) rad of the frames whose ball is at most a right angle off the body's heading.
    """
    head = identify_joints(skeleton).head_or_neck
    away, heading = ball - positions[:, head], compute_heading_from_positions(skeleton, positions)
    with np.errstate(invalid="ignore"):
        in_range = np.abs(quaternion.wrap_angle(arctan2(away[:, 1], away[:, 0]) - heading)) <= np.pi / 2.0
    sight = quaternion.rotate(rotations[in_range, head], look)
    return np.arccos(np.clip(np.sum(sight * unit_vectors(away[in_range]), axis=1), -1.0, 1.0))


def measure_unusual_share(course: BodyCourse, postures: NormalPostures) -> float:
    """Measure the share of slow frames whose posture is not one of the library's locomotion; NaN without any."""
    slow = course.speed < SLOW_SPEED
    return _mean(postures.measure_strangeness(course.posture[slow], course.speed[slow]) > 1.0)


def measure_standing(track: np.ndarray, planted: np.ndarray, fps: float) -> dict:
    """Measure how a body stands where its track does.

    Args:
        track: (T, 2) m, as measured.
        planted: (T, 2) bool, left and right foot on the ground.
        fps: frames per second.
    Returns:
        seconds of all stands, foot lifts per minute, and the share of the time with both feet down.
    """
    stands = find_rests(track, fps, seconds=STAND_SECONDS)
    frames = sum(end - first for first, end in stands)
    lifts = sum(int(np.sum(planted[first : end - 1] & ~planted[first + 1 : end])) for first, end in stands)
    both = sum(int(planted[first:end].all(axis=1).sum()) for first, end in stands)
    return {"seconds": frames / fps, "foot_lifts_per_min": lifts * 60.0 * fps / frames if frames else math.nan,
            "both_down": both / frames if frames else math.nan}


def measure_course_figures(courses: Sequence[BodyCourse], postures: NormalPostures) -> dict:
    """Measure the figures that takes and recordings share.

    Args:
        courses: one take, or all recordings.
        postures: how people of the library stand, walk, jog and run.
    Returns:
        Figures by name, NaN where there is nothing to measure.
    """
    minutes = sum(course.minutes for course in courses)
    off = np.degrees(np.concatenate([measure_facing_off_travel(course) for course in courses] or [np.zeros(0)]))
    slow = [int(np.sum(course.speed < SLOW_SPEED)) for course in courses]
    unusual = [measure_unusual_share(course, postures) * count for course, count in zip(courses, slow) if count]
    return {
        "minutes": minutes,
        **{f"{name}_per_min": sum(len(find(course)) for course in courses) / minutes if minutes else math.nan
           for name, find, _ in EVENTS},
        "off_travel_deg_median": _percentile(off, 50), "off_travel_deg_p90": _percentile(off, 90),
        "unusual_posture_share": sum(unusual) / sum(slow) if sum(slow) else math.nan,
    }


def measure_piece_figures(course: BodyCourse, transitions: np.ndarray) -> dict:
    """Measure how often a take changes its recording, and how long a slow one stays."""
    dwell = measure_dwell(course, transitions)
    return {"cuts_per_min": len(transitions) / course.minutes, "dwell_s_median": _percentile(dwell, 50),
            "short_dwell_share": _mean(dwell < SHORT_DWELL)}


def list_event_messages(course: BodyCourse, times: np.ndarray) -> list[TimedMessage]:
    """List a line for each kind of event that the take has, with its seconds.

    Args:
        course: the take.
        times: (T,) s on the track's clock.
    """
    return [_format_event(times[found], text) for _, find, text in EVENTS if (found := find(course))]


def _format_event(seconds: Iterable[float], text: str) -> TimedMessage:
    """Format "3.1, 7.5 s: text"."""
    at = [float(second) for second in seconds]
    more = f" and {len(at) - _MAX_LISTED} more" if len(at) > _MAX_LISTED else ""
    named = ", ".join(format_seconds(second) for second in at[:_MAX_LISTED])
    return TimedMessage(f"{named} s{more}: {text}", *((second, second) for second in at))


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _percentile(values: np.ndarray, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else math.nan
