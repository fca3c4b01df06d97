"""What the eye sees: whether a body turns, stands, walks and looks like one person.

The figures are those of docs/reference/report-figures.md, *What the eye sees*.

The same code measures takes and recordings, both at 30 frames per second. The heading is that of the line through hips
and shoulders; speed is the pelvis' through a window of 0.5 s; lengths are brought to a leg of 0.86 m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import TimedMessage
from ..base.time_series import find_runs, interpolate_columns, time_derivative
from ..base.vectors import arctan2, unit_vectors
from ..library.posture import FALL_HEIGHT, LEG_LENGTH, NormalPostures, compute_postures, find_falls
from ..motion import quaternion
from ..motion.humanoid import compute_heading_from_positions, identify_joints, measure_leg_length
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann
from ..motion.track.resting_place import find_rests

FPS = 30.0  # frames per second at which all of this is measured
SPEED_WINDOW = 0.5  # s
SNAP_ANGLE, SNAP_SECONDS = np.radians(75.0), 0.3  # change of heading of a snap turn, and within what time
SPIN_ANGLE, SPIN_SECONDS = np.radians(200.0), 2.0  # the same of a spin
SLOW_SPEED = 2.0  # m/s below which dwell and postures are measured, and above which facing off travel is
STAND_SECONDS = 1.5  # of the shortest stand
SHORT_DWELL = 0.5  # s
FAST_SPEED = 4.0  # m/s above which the tempo of strides is measured
STEADY_RANGE = 0.4  # m/s within which the speeds of strides are steady; the period changes by 26 ms over it
STEADY_STRIDES = 2  # strides of the shortest steady stretch; recorded runs are short
STRIDE_SECONDS = (0.35, 1.0)  # shortest and longest stride of a run; others are missed or counted twice
ASKED_SPIN = np.radians(175.0)
"""Turn of the heading plan, in a spin's direction, that asks for it: a body may be off its plan by 25 degrees."""
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
        stride: (T,) m by which the left ankle is ahead of the right one, along the heading.
    """

    fps: float
    heading: np.ndarray
    speed: np.ndarray
    travel: np.ndarray
    pelvis_height: np.ndarray
    posture: np.ndarray
    stride: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """(T,) s from the first frame."""
        return np.arange(len(self.heading)) / self.fps


def measure_course(skeleton: Skeleton, positions: np.ndarray, fps: float) -> BodyCourse:
    """Measure where a body faces and goes, at 30 frames per second whatever the motion's rate.

    Args:
        skeleton: J joints.
        positions: (N, J, 3) m, world.
        fps: frames per second of the positions.
    """
    positions = resample_positions(positions, fps)
    body = identify_joints(skeleton)
    pelvis = positions[:, body.hips] * (LEG_LENGTH / measure_leg_length(skeleton))
    velocity = time_derivative(smooth_zero_phase_hann(pelvis[:, :2], FPS, SPEED_WINDOW), FPS)
    heading = np.unwrap(compute_heading_from_positions(skeleton, positions))
    ahead = positions[:, body.left.foot, :2] - positions[:, body.right.foot, :2]
    return BodyCourse(
        fps=FPS, heading=heading, speed=np.linalg.norm(velocity, axis=1),
        travel=arctan2(velocity[:, 1], velocity[:, 0]), pelvis_height=pelvis[:, 2],
        posture=compute_postures(positions, heading, FPS, body),
        stride=np.sum(ahead * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=1),
    )


def resample_positions(positions: np.ndarray, fps: float) -> np.ndarray:
    """Resample positions (N, J, 3) m to FPS, linearly between frames.

    Args:
        positions: at `fps`.
        fps: frames per second.
    """
    if fps == FPS:
        return positions
    times = np.arange(len(positions)) / fps
    at = np.arange(int(times[-1] * FPS + 1e-6) + 1) / FPS
    columns = interpolate_columns(at, times, positions.reshape(len(positions), -1))
    return columns.reshape(len(at), *positions.shape[1:])


def find_fast_turns(course: BodyCourse, angle: float, seconds: float) -> list[int]:
    """Find the turns by more than `angle` rad within some seconds: a frame in the middle of each.

    Windows that overlap show the same turn.
    """
    reach, heading = int(round(seconds * course.fps)), course.heading
    turned = np.zeros(len(heading), dtype=bool)
    for step in range(1, min(reach, len(heading) - 1) + 1):
        turned[:-step] |= np.abs(heading[step:] - heading[:-step]) > angle
    seen = np.zeros(len(heading), dtype=bool)
    for first, end in find_runs(turned):
        seen[first : end + reach] = True
    return [(first + end - 1) // 2 for first, end in find_runs(seen)]


def find_snap_turns(course: BodyCourse) -> list[int]:
    """Find the turns by more than 75 degrees within 0.3 s, more than a body does over one foot."""
    return find_fast_turns(course, SNAP_ANGLE, SNAP_SECONDS)


def find_spins(course: BodyCourse) -> list[int]:
    """Find the turns by more than 200 degrees within 2 s."""
    return find_fast_turns(course, SPIN_ANGLE, SPIN_SECONDS)


def find_pelvis_drops(course: BodyCourse) -> list[int]:
    """Find where the pelvis falls by more than 15 cm within 0.2 s: the first frame of each fall."""
    return [first for first, _ in find_runs(find_falls(course.pelvis_height, course.fps, FALL_HEIGHT))]


EVENTS = (
    ("snap_turns", find_snap_turns, "the body turns by more than 75 degrees within 0.3 s"),
    ("spins", find_spins, "the body turns by more than 200 degrees within 2 s"),
    ("pelvis_drops", find_pelvis_drops, "the hips fall by more than 15 cm within 0.2 s"),
)
"""Name, detector and message of each event that is counted per minute."""


def select_unasked_spins(course: BodyCourse, planned: np.ndarray) -> list[int]:
    """Select the spins that the heading plan does not contain itself.

    Args:
        course: the body.
        planned: (T,) rad, its planned heading, unwrapped.
    Returns:
        Their frames: the plan turns by no more than ASKED_SPIN that way, from a spin's time before its middle to a
        spin's time after it.
    """
    reach, last = int(round(SPIN_SECONDS * course.fps)), len(planned) - 1
    unasked = []
    for frame in find_spins(course):
        first, end = max(frame - reach // 2, 0), min(frame + reach // 2, last)
        turn = np.sign(course.heading[end] - course.heading[first])
        plan = turn * planned[max(frame - reach, 0) : frame + reach + 1]
        if (plan - np.minimum.accumulate(plan)).max() <= ASKED_SPIN:
            unasked.append(frame)
    return unasked


def measure_dwell(course: BodyCourse, cuts: np.ndarray) -> np.ndarray:
    """Measure how long each piece between two cuts lasts where the body is slow.

    Args:
        course: the body.
        cuts: (S,) s from its first frame.
    Returns:
        Seconds of each; the first and the last piece, which end with the take, are left out.
    """
    at = np.minimum(np.rint(cuts * course.fps).astype(int), len(course.speed) - 1)
    slow = [course.speed[first : max(end, first + 1)].mean() < SLOW_SPEED for first, end in zip(at, at[1:])]
    return np.diff(cuts)[np.array(slow, dtype=bool)]


def measure_facing_off_travel(course: BodyCourse) -> np.ndarray:
    """Measure the angle (T,) rad between heading and travel, NaN up to SLOW_SPEED."""
    off = np.abs(quaternion.wrap_angle(course.heading - course.travel))
    return np.where(course.speed > SLOW_SPEED, off, np.nan)


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


def find_stands(path: np.ndarray, fps: float) -> np.ndarray:
    """Find the frames (T,) bool of stands of 1.5 s and more: path (T,2) m stays in a box of 10 cm half diagonal."""
    stands = np.zeros(len(path), dtype=bool)
    for first, end in find_rests(path, fps, seconds=STAND_SECONDS):
        stands[first:end] = True
    return stands


def measure_standing(stands: np.ndarray, planted: np.ndarray, fps: float) -> dict:
    """Measure how a body stands.

    Args:
        stands: (T,) bool, of `find_stands`.
        planted: (T, 2) bool, left and right foot on the ground.
        fps: frames per second.
    Returns:
        seconds of all stands, foot lifts per minute, and the share of the time with both feet down.
    """
    seconds = int(stands.sum()) / fps
    lifts = np.sum(planted[:-1] & ~planted[1:] & (stands[:-1] & stands[1:])[:, None])
    return {"seconds": seconds, "foot_lifts_per_min": 60.0 * int(lifts) / seconds if seconds else math.nan,
            "both_down": _mean(planted[stands].all(axis=1))}


def list_steady_strides(course: BodyCourse) -> list[tuple[np.ndarray, np.ndarray]]:
    """List the strides of each stretch of steady running above 4 m/s.

    A stride lasts from one time at which the left foot passes the right one to the next; the same for the right foot.
    The moment is between two frames, so that periods are not multiples of a frame.

    Returns:
        Per stretch the middle frames (S,) int and the periods (S,) s of its strides.
    """
    return [stretch for side in (1.0, -1.0) for stretch in _split_steady(course, *_list_strides(course, side))]


def _list_strides(course: BodyCourse, side: float) -> tuple[np.ndarray, np.ndarray]:
    """List when (S + 1,) a foot passes the other one, in frames, and the mean speed (S,) m/s of each stride."""
    ahead = side * course.stride
    before = np.flatnonzero((ahead[:-1] < 0.0) & (ahead[1:] >= 0.0))
    passes = before - ahead[before] / (ahead[before + 1] - ahead[before])
    speed = [course.speed[first : end + 1].mean() for first, end in zip(before, before[1:])]
    return passes, np.array(speed)


def _split_steady(course: BodyCourse, passes: np.ndarray, speed: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Split strides into the longest stretches of steady speed, from the first one on."""
    periods, middles = np.diff(passes) / course.fps, np.rint(0.5 * (passes[1:] + passes[:-1])).astype(int)
    is_run = (speed > FAST_SPEED) & (periods >= STRIDE_SECONDS[0]) & (periods <= STRIDE_SECONDS[1])
    found, first = [], 0
    while first < len(periods):
        end = first
        while end < len(periods) and is_run[end] and np.ptp(speed[first : end + 1]) <= STEADY_RANGE:
            end += 1
        if end - first >= STEADY_STRIDES:
            found.append((middles[first:end], periods[first:end]))
        first = max(end, first + 1)
    return found


def measure_tempo(courses: Sequence[BodyCourse], used: Sequence[np.ndarray]) -> dict:
    """Measure the standard deviation of the stride period about the mean of each steady stretch above 4 m/s.

    Args:
        courses: one take, or recordings.
        used: (T,) bool for each; a stretch counts if one of its strides' middles is used.
    Returns:
        sd_ms, NaN without such a stretch, and the number of strides.
    """
    stretches = [periods for course, mask in zip(courses, used) if mask.any()
                 for middles, periods in list_steady_strides(course) if mask[middles].any()]
    strides = sum(map(len, stretches))
    squares = sum(float(np.sum((periods - periods.mean()) ** 2)) for periods in stretches)
    return {"sd_ms": 1000.0 * math.sqrt(squares / (strides - len(stretches))) if stretches else math.nan,
            "strides": strides}


def measure_course_figures(courses: Sequence[BodyCourse], used: Sequence[np.ndarray], asked: Sequence[np.ndarray],
                           postures: NormalPostures) -> dict:
    """Measure the figures that takes and recordings share.

    Args:
        courses: one take, or all recordings.
        used: (T,) bool for each: frames that count; an event counts by its middle.
        asked: (T,) bool for each: frames whose labels ask for other postures than those of locomotion.
        postures: how people of the library stand, walk, jog and run.
    Returns:
        Figures by name, NaN where there is nothing to measure, and the frames that they rest on.
    """
    counted = [(course, mask, other) for course, mask, other in zip(courses, used, asked) if mask.any()]
    frames = sum(int(mask.sum()) for _, mask, _ in counted)
    drops = sum(int((mask & ~other)[find_pelvis_drops(course)].sum()) for course, mask, other in counted)
    off = _join(np.degrees(measure_facing_off_travel(course)[mask]) for course, mask, _ in counted)
    slow = [(course, mask & ~other & (course.speed < SLOW_SPEED) & postures.select_known(course.speed))
            for course, mask, other in counted]
    strange = _join(postures.measure_strangeness(course.posture[mask], course.speed[mask]) for course, mask in slow)
    off = off[np.isfinite(off)]
    return {
        "frames": frames,
        **{f"{name}_per_min": sum(int(mask[find(course)].sum()) for course, mask, _ in counted) * 60.0 * FPS / frames
           if frames else math.nan for name, find, _ in EVENTS},
        "pelvis_drops_in_locomotion_per_min": drops * 60.0 * FPS / frames if frames else math.nan,
        "fast_frames": len(off), "off_travel_deg_median": _percentile(off, 50),
        "off_travel_deg_p90": _percentile(off, 90),
        "slow_frames": len(strange), "unusual_posture_share": _mean(strange > 1.0),
        "tempo": measure_tempo([course for course, *_ in counted], [mask for _, mask, _ in counted]),
    }


def measure_piece_figures(course: BodyCourse, cuts: np.ndarray) -> dict:
    """Measure how often a take changes its recording, and how long a slow one stays.

    Args:
        course: the take.
        cuts: (S,) s from its first frame.
    """
    dwell = measure_dwell(course, cuts)
    return {"cuts_per_min": len(cuts) * 60.0 * FPS / len(course.speed), "slow_pieces": len(dwell),
            "dwell_s_median": _percentile(dwell, 50), "short_dwell_share": _mean(dwell < SHORT_DWELL)}


def list_event_messages(
    course: BodyCourse, start: float, planned: np.ndarray | None, asked: np.ndarray
) -> tuple[list[TimedMessage], list[TimedMessage]]:
    """List a line for each kind of event that the take has, with its seconds.

    Args:
        course: the take.
        start: s on the track's clock of its first frame.
        planned: (T,) rad, its planned heading, or None.
        asked: (T,) bool, frames whose labels ask for other postures than those of locomotion.
    Returns:
        Warnings; and notes about the spins that the heading plan asks for, and the falls within actions.
    """
    warnings, notes = [], []
    for name, find, text in EVENTS:
        found = find(course)
        unasked, why = found, ""
        if name == "spins" and planned is not None:
            unasked, why = select_unasked_spins(course, planned), ", as ball and play ask"
        elif name == "pelvis_drops":
            unasked, why = [frame for frame in found if not asked[frame]], ", in an action that labels ask for"
        rest = [frame for frame in found if frame not in unasked]
        warnings += [format_event(start + course.times[unasked], text)] if unasked else []
        notes += [format_event(start + course.times[rest], text + why)] if rest else []
    return warnings, notes


def format_event(seconds: Iterable[float], text: str) -> TimedMessage:
    """Format "3.1, 7.5 s: text".

    Args:
        seconds: of each event, on the track's clock.
        text: what happens there.
    """
    at = [float(second) for second in seconds]
    more = f" and {len(at) - _MAX_LISTED} more" if len(at) > _MAX_LISTED else ""
    named = ", ".join(f"{second:.1f}" for second in at[:_MAX_LISTED])
    return TimedMessage(f"{named} s{more}: {text}", *((second, second) for second in at))


def _join(parts: Iterable[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.zeros(0), *parts])


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _percentile(values: np.ndarray, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else math.nan
