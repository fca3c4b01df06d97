"""A made gait: standing, walking, running and sprinting up to 9.5 m/s, any direction, any curve, on any humanoid
skeleton.

Speed decides cadence, stance and swing, bounce, lean and arms by published figures (`gait_tables`); feet are planned
and planted first (`footsteps`), then the pelvis passes over them and the legs follow by inverse kinematics (`posture`).
Bodies of another size move alike at the same Froude number v^2 / (g leg) (Alexander 1989): lengths grow with the leg,
times with its root.

    gait(1.4, 6.0)                                 # six seconds of walking
    gait(np.linspace(0, 8, 150), fps=30)           # from standing to a sprint in five seconds
    gait(1.2, 6.0, direction=np.pi)                # backward, facing +X
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import hann_smooth, interpolate
from ..motion.humanoid import identify
from ..motion.motion import Motion
from ..motion.retargeting.adult import adult_skeleton
from ..motion.retargeting.neutral import Neutral, neutral_stance
from ..motion.retargeting.posture import Posture, hip_joints, to_motion
from ..motion.skeleton import Skeleton
from . import gait_tables as tables
from .course import Course, GaitStyle, plan
from .footsteps import Footsteps, travel
from .gait_tables import at_speed
from .gait_trunk import arms, trunk

# how far ahead of and behind the hips a flat foot stands at most, shares of the leg's length
_AHEAD, _BEHIND = 0.41, 0.72
# how far a leg is straightened at most, walking and running, share of its length: runners' knees stay bent by some 20
# degrees (V, and recordings), and a knee that snaps straight is what eyes notice first
_STRAIGHTEST = (0.9955, 0.984)
# where a swinging leg begins to ease towards that, share of its length below it
_EASE = 0.03


def gait(
    speed: float | np.ndarray,
    duration: float | None = None,
    fps: float = 30.0,
    skeleton: Skeleton | None = None,
    *,
    style: GaitStyle = GaitStyle(),
    phase: float = 0.0,
    turn_rate: float | np.ndarray = 0.0,
    direction: float | np.ndarray = 0.0,
    seed: int = 0,
    example: Motion | None = None,
) -> Motion:
    """A body that travels at `speed` for `duration` seconds; it begins at the origin and faces +X.

    speed: m/s, 0 .. 9.5, one or one per frame (T,) (then without `duration`). turn_rate: radians per second, left
    positive, and direction: travel relative to facing in radians (0 ahead, pi/2 left, pi back), each one or (T,).
    skeleton: any humanoid one; default the project's adult. phase: strides at the first frame (0: left foot lands, 0.5:
    right). seed: of the unevenness that `style.life` scales. example: a recording on `skeleton`, see
    `neutral.neutral_stance`. The pelvis stays within a few centimetres of the asked path; planted feet do not slide.
    Raises InputError for a speed below 0 or above 9.5, and for a wrong number of frames."""
    neutral = neutral_stance(skeleton or adult_skeleton(), example)
    course = plan(
        speed, duration, fps, neutral, phase=phase, turn_rate=turn_rate, direction=direction, style=style, seed=seed
    )
    return to_motion(gait_posture(course, neutral, style, seed), neutral)


def gait_posture(course: Course, neutral: Neutral, style: GaitStyle = GaitStyle(), seed: int = 0) -> Posture:
    """The posture at the frames that `course` asks for."""
    steps = tuple(footsteps(course, neutral, style, side) for side in (0, 1))
    return posture_over(course, steps, neutral, style, seed).frames(course.asked)


def footsteps(course: Course, neutral: Neutral, style: GaitStyle, side: int) -> Footsteps:
    """When and where one foot (0 left, 1 right) stands: below the hips in the middle of each stance, width and lean
    apart.
    """
    offset = 0.5 * side
    cycles = np.arange(np.ceil(course.phase[0] - offset), np.floor(course.phase[-1] - offset)) + offset
    on = np.interp(cycles, course.phase, course.times)
    duty = at_speed("duty", np.interp(on, course.times, course.gear))
    duty = at_speed("duty", np.interp(cycles + 0.5 * duty, course.phase, course.gear))
    off = np.interp(cycles + duty, course.phase, course.times)
    middle = 0.5 * (on + off)
    sign = 1.0 if side == 0 else -1.0
    gear, heading, direction = (
        np.interp(middle, course.times, v) for v in (course.gear, course.heading, course.direction)
    )
    scale = neutral.leg / tables.LEG
    ahead = at_speed("ahead", gear) * np.abs(np.cos(direction)) * scale
    left = sign * 0.5 * (at_speed("width", gear) * scale + style.width)
    # sideways the base is as wide as the body travels in half a stance, so that legs do not cross
    left = (
        left + sign * 0.5 * np.abs(np.sin(direction)) * np.interp(middle, course.times, course.speed) * (off - on) * 0.8
    )
    place = interpolate(middle, course.times, course.path)
    place = place + np.stack(
        [ahead * np.cos(heading) - left * np.sin(heading), ahead * np.sin(heading) + left * np.cos(heading)], -1
    )
    place = place - _lean_shift(course, neutral, middle)
    toe_out = sign * (np.radians(at_speed("toe_out", gear)) + style.toe_out)
    on, off = _within_reach(course, place, on, off, neutral.leg)
    return Footsteps(side, on, off, place, heading + toe_out, gear, direction)


def _within_reach(
    course: Course, place: np.ndarray, on: np.ndarray, off: np.ndarray, leg: float
) -> tuple[np.ndarray, np.ndarray]:
    """Stances (K,) cut where the hips are too far from the foot: when speed changes within a stance, feet lift
    earlier."""
    share = np.linspace(0.0, 0.5, 26)
    ends = []
    for edge, sign in ((on, -1.0), (off, 1.0)):
        at = 0.5 * (on + off)[:, None] + sign * share * (off - on)[:, None]
        hips = interpolate(at, course.times, course.path)
        near = np.linalg.norm(hips - place[:, None], axis=-1) <= (_AHEAD if sign < 0 else _BEHIND) * leg
        last = np.where(near.all(axis=1), len(share) - 1, np.argmin(near, axis=1))
        ends.append(
            np.where(near.all(axis=1), edge, np.take_along_axis(at, np.maximum(last, 8)[:, None], axis=1)[:, 0])
        )
    return ends[0], ends[1]


def _lean_shift(course: Course, neutral: Neutral, at: np.ndarray) -> np.ndarray:
    """How far the feet stay behind the hips (K, 2) metres while the body leans into an acceleration: the lean's
    balance.
    """
    height = 0.8 * (neutral.leg + neutral.ankle_height)
    shift = (
        height
        * interpolate(at, course.times, course.acceleration)
        / tables.GRAVITY
    )
    size = np.linalg.norm(shift, axis=-1, keepdims=True)
    limit = 0.30 * neutral.leg
    return shift * np.where(size > 1e-9, limit * np.tanh(size / limit) / np.maximum(size, 1e-9), 1.0)


def posture_over(
    course: Course, steps: tuple[Footsteps, ...], neutral: Neutral, style: GaitStyle, seed: int
) -> Posture:
    """The posture at all moments of `course` for feet that stand as `steps` says (left, right)."""
    above = trunk(course, neutral, style, seed)
    count = len(course.times)
    rate = 1.0 / (course.times[1] - course.times[0])
    posture = Posture(
        fps=round(rate / course.stride, 6),
        heading=course.heading,
        arms=arms(course, style, seed),
        wrists=np.full((count, 2), np.radians(8.0)),
        ankles=np.zeros((count, 2, 3)),
        feet=np.zeros((count, 2, 3)),
        toes=np.zeros((count, 2)),
        knees=np.full((count, 2), np.radians(2.0)),
        **above,
    )
    return with_feet(posture, course.times, steps, neutral)


def with_feet(posture: Posture, times: np.ndarray, steps: tuple[Footsteps, ...], neutral: Neutral) -> Posture:
    """The posture with feet that stand as `steps` says (left, right), hips lowered where a leg would not reach. times
    (T,).
    """
    hips = posture.hips.copy()
    hips[:, 2] -= _drop(posture, times, steps, neutral)
    posture = posture.changed(hips=hips)
    tops = hip_joints(posture, neutral)
    paths = [travel(steps[s], times, tops[:, s], posture.heading, neutral, thigh_shank(neutral, s)) for s in (0, 1)]
    ankles = [kept_bent(paths[s].ankle, tops[:, s], times, steps[s], sum(thigh_shank(neutral, s))) for s in (0, 1)]
    feet = np.stack([np.stack([np.zeros_like(p.pitch), p.pitch, p.yaw], axis=-1) for p in paths], axis=1)
    return posture.changed(
        ankles=np.stack(ankles, axis=1), feet=feet, toes=np.stack([p.bend for p in paths], axis=1)
    )


def _straightest(steps: Footsteps, times: np.ndarray) -> np.ndarray:
    """How far a leg may be straightened at `times` (T,): (T,) share of its length."""
    walking, running = _STRAIGHTEST
    return walking + (running - walking) * tables.run_share(steps.speed[steps.current(times)])


def kept_bent(ankle: np.ndarray, hip: np.ndarray, times: np.ndarray, steps: Footsteps, leg: float) -> np.ndarray:
    """The ankle (T, 3) drawn to its hip (T, 3) where the leg, `leg` metres long, would be straightened too far in
    swing."""
    away = ankle - hip
    far = np.linalg.norm(away, axis=1)
    begin = (_straightest(steps, times) + 0.006 - _EASE) * leg
    eased = begin + _EASE * leg * np.tanh((far - begin) / (_EASE * leg))
    share = np.where(steps.standing(times) | (far < begin), 1.0, eased / np.maximum(far, 1e-9))
    return hip + away * share[:, None]


def thigh_shank(neutral: Neutral, side: int) -> tuple[float, float]:
    body = identify(neutral.skeleton)
    joints = (body.left, body.right)[side]
    hip, knee, ankle = (neutral.positions[j] for j in (joints.upper_leg, joints.lower_leg, joints.foot))
    return float(np.linalg.norm(knee - hip)), float(np.linalg.norm(ankle - knee))


def _drop(posture: Posture, times: np.ndarray, steps, neutral: Neutral) -> np.ndarray:
    """How much (T,) metres the hips have to sink so that standing feet are in reach, smooth in time."""
    tops = hip_joints(posture, neutral)
    need = np.zeros(len(times))
    for side in (0, 1):
        path = travel(steps[side], times, tops[:, side], posture.heading, neutral, thigh_shank(neutral, side))
        longest = _straightest(steps[side], times) * sum(thigh_shank(neutral, side))
        flat = np.sum((tops[:, side, :2] - path.ankle[:, :2]) ** 2, axis=-1)
        highest = path.ankle[:, 2] + np.sqrt(np.maximum(longest**2 - flat, 0.0))
        need = np.maximum(need, np.where(steps[side].standing(times), tops[:, side, 2] - highest, 0.0))
    width = max(int(0.06 / (times[1] - times[0])), 1)
    return hann_smooth(_running_max(need, width), width)


def _running_max(values: np.ndarray, width: int) -> np.ndarray:
    padded = np.pad(values, width, mode="edge")
    return np.max(np.lib.stride_tricks.sliding_window_view(padded, 2 * width + 1), axis=-1)
