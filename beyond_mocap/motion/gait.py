"""A made gait: standing, walking, running and sprinting up to 9.5 m/s, any direction, any curve, on any humanoid skeleton.

Speed decides cadence, stance and swing, bounce, lean and arms by published figures (`gait_tables`); feet are planned and
planted first (`footsteps`), then the pelvis passes over them and the legs follow by inverse kinematics (`posture`). Bodies of
another size move alike at the same Froude number v^2 / (g leg) (Alexander 1989): lengths grow with the leg, times with its root.

    gait(1.4, 6.0)                                 # six seconds of walking
    gait(np.linspace(0, 8, 150), fps=30)           # from standing to a sprint in five seconds
    gait(1.2, 6.0, direction=np.pi)                # backward, facing +X
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from . import gait_tables as tables
from .adult import adult_skeleton
from .footsteps import Footsteps, travel
from .gait_tables import at_speed, run_share, smooth_step
from .humanoid import identify
from .motion import Motion
from .neutral import Neutral, neutral_stance
from .posture import Posture, hip_joints, to_motion
from .skeleton import Skeleton

# the plan reaches this many seconds beyond both ends, so that stances which cross them are known
_PAD = 2.5
# feet are planned at this rate or a multiple of it
_PLAN_RATE = 120.0
# how far ahead of and behind the hips a flat foot stands at most, shares of the leg's length
_AHEAD, _BEHIND = 0.41, 0.72
# how far a leg is straightened at most in stance, share of its length
_STRAIGHTEST = 0.9955


@dataclass(frozen=True)
class GaitStyle:
    """What makes one walker differ from another, all relative to the published figures.

    cadence: factor on steps per second (longer or shorter strides). bounce, arm_swing, twist (shoulders against pelvis):
    factors. lean, head: radians added to the trunk's forward lean and the head's nod. abduct, elbow: radians added to how far
    arms are held away and bent. width: metres added between the feet. toe_out: radians added. crouch: radians added to the
    knees' flexion in stance. life: factor on breathing, sway and the small unevenness from stride to stride.
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


@dataclass(frozen=True, eq=False)
class Course:
    """A way planned over N moments, `pad` of them before the first and after the last frame that is asked for.

    times (N,): seconds, 0 at the first frame asked for. speed (N,): m/s. gear (N,): the same for an adult's leg, which is
    what the tables are asked with. direction (N,): travel relative to heading. heading (N,). path (N, 2): metres.
    acceleration (N, 2): m/s^2 of the path, smoothed over a step. phase (N,): strides; the left foot lands at whole numbers,
    the right one half a stride later. stride: every how many moments a frame is asked for.
    """

    times: np.ndarray
    speed: np.ndarray
    gear: np.ndarray
    direction: np.ndarray
    heading: np.ndarray
    path: np.ndarray
    acceleration: np.ndarray
    phase: np.ndarray
    pad: int
    stride: int

    @property
    def asked(self) -> slice:
        """The moments that are frames of the result."""
        return slice(self.pad, len(self.times) - self.pad, self.stride)


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

    speed: m/s, 0 .. 9.5, one or one per frame (T,) (then without `duration`). turn_rate: radians per second, left positive,
    and direction: travel relative to facing in radians (0 ahead, pi/2 left, pi back), each one or (T,). skeleton: any
    humanoid one; default the project's adult. phase: strides at the first frame (0: left foot lands, 0.5: right). seed: of
    the unevenness that `style.life` scales. example: a recording on `skeleton`, see `neutral.neutral_stance`.
    The pelvis stays within a few centimetres of the asked path; planted feet do not slide.
    Raises InputError for a speed below 0 or above 9.5, and for a wrong number of frames.
    """
    neutral = neutral_stance(skeleton or adult_skeleton(), example)
    course = plan(speed, duration, fps, neutral, phase=phase, turn_rate=turn_rate, direction=direction, style=style, seed=seed)
    return to_motion(gait_posture(course, neutral, style, seed), neutral)


def plan(
    speed, duration, fps: float, neutral: Neutral, *, phase=0.0, turn_rate=0.0, direction=0.0, style=GaitStyle(), seed=0
) -> Course:
    """The way that `gait` goes; parameters as there."""
    count = _count(speed, duration, fps, turn_rate, direction)
    stride = int(np.ceil(_PLAN_RATE / fps))
    rate = fps * stride
    pad = int(np.ceil(_PAD * rate))
    times = (np.arange((count - 1) * stride + 1 + 2 * pad) - pad) / rate
    speed, turn_rate, direction = (_at(values, times, fps, count) for values in (speed, turn_rate, direction))
    if np.any(speed < 0.0) or np.any(speed > tables.FASTEST + 1e-9) or not np.all(np.isfinite(speed)):
        raise InputError("gait", f"speed {np.min(speed):.3g} .. {np.max(speed):.3g} m/s", "0 .. 9.5")
    heading = _integral(turn_rate, rate, pad)
    way = heading + direction
    velocity = speed[:, None] * np.stack([np.cos(way), np.sin(way)], axis=-1)
    path = np.stack([_integral(velocity[:, axis], rate, pad) for axis in range(2)], axis=-1)
    acceleration = np.stack([_smooth(np.gradient(velocity[:, axis], 1.0 / rate), int(0.35 * rate)) for axis in (0, 1)], -1)
    root_scale = np.sqrt(neutral.leg / tables.LEG)
    gear = speed / root_scale
    frequency = stride_frequency(gear, direction, turn_rate * root_scale) / root_scale * style.cadence
    frequency = frequency * (1.0 + 0.015 * style.life * _wander(times, seed, 3.1))
    strides = phase + _integral(frequency, rate, pad)
    return Course(times, speed, gear, direction, heading, path, acceleration, strides, pad, stride)


def stride_frequency(gear: np.ndarray, direction: np.ndarray, turn_rate: np.ndarray) -> np.ndarray:
    """Strides per second (T,) for an adult at `gear` (T,) m/s; more when going backward or sideways or turning on the spot."""
    usual = at_speed("frequency", gear) * (1.0 + 0.22 * np.sin(0.5 * direction) ** 2 + 0.18 * np.sin(direction) ** 2)
    on_the_spot = 1.0 - smooth_step(gear / 1.8)
    return np.hypot(usual, on_the_spot * turn_rate / 1.3)


def gait_posture(course: Course, neutral: Neutral, style: GaitStyle = GaitStyle(), seed: int = 0) -> Posture:
    """The posture at the frames that `course` asks for."""
    steps = tuple(footsteps(course, neutral, style, side) for side in (0, 1))
    return posture_over(course, steps, neutral, style, seed).frames(course.asked)


def footsteps(course: Course, neutral: Neutral, style: GaitStyle, side: int) -> Footsteps:
    """When and where one foot (0 left, 1 right) stands: below the hips in the middle of each stance, width and lean apart."""
    offset = 0.5 * side
    cycles = np.arange(np.ceil(course.phase[0] - offset), np.floor(course.phase[-1] - offset)) + offset
    on = np.interp(cycles, course.phase, course.times)
    duty = at_speed("duty", np.interp(on, course.times, course.gear))
    duty = at_speed("duty", np.interp(cycles + 0.5 * duty, course.phase, course.gear))
    off = np.interp(cycles + duty, course.phase, course.times)
    middle = 0.5 * (on + off)
    sign = 1.0 if side == 0 else -1.0
    gear, heading, direction = (np.interp(middle, course.times, v) for v in (course.gear, course.heading, course.direction))
    scale = neutral.leg / tables.LEG
    ahead = at_speed("ahead", gear) * np.abs(np.cos(direction)) * scale
    left = sign * 0.5 * (at_speed("width", gear) * scale + style.width)
    # sideways the base is as wide as the body travels in half a stance, so that legs do not cross
    left = left + sign * 0.5 * np.abs(np.sin(direction)) * np.interp(middle, course.times, course.speed) * (off - on) * 0.85
    place = np.stack([np.interp(middle, course.times, course.path[:, axis]) for axis in (0, 1)], axis=-1)
    place = place + np.stack([ahead * np.cos(heading) - left * np.sin(heading), ahead * np.sin(heading) + left * np.cos(heading)], -1)
    place = place - _lean_shift(course, neutral, middle)
    toe_out = sign * (np.radians(at_speed("toe_out", gear)) + style.toe_out)
    on, off = _within_reach(course, place, on, off, neutral.leg)
    return Footsteps(side, on, off, place, heading + toe_out, gear, direction)


def _within_reach(course: Course, place: np.ndarray, on: np.ndarray, off: np.ndarray, leg: float) -> tuple[np.ndarray, np.ndarray]:
    """Stances (K,) cut where the hips are too far from the foot: when speed changes within a stance, feet lift earlier."""
    share = np.linspace(0.0, 0.5, 26)
    ends = []
    for edge, sign in ((on, -1.0), (off, 1.0)):
        at = 0.5 * (on + off)[:, None] + sign * share * (off - on)[:, None]
        hips = np.stack([np.interp(at, course.times, course.path[:, axis]) for axis in (0, 1)], axis=-1)
        near = np.linalg.norm(hips - place[:, None], axis=-1) <= (_AHEAD if sign < 0 else _BEHIND) * leg
        last = np.where(near.all(axis=1), len(share) - 1, np.argmin(near, axis=1))
        ends.append(np.where(near.all(axis=1), edge, np.take_along_axis(at, np.maximum(last, 8)[:, None], axis=1)[:, 0]))
    return ends[0], ends[1]


def _lean_shift(course: Course, neutral: Neutral, at: np.ndarray) -> np.ndarray:
    """How far the feet stay behind the hips (K, 2) metres while the body leans into an acceleration: the lean's balance."""
    height = 0.8 * (neutral.leg + neutral.ankle_height)
    shift = height * np.stack([np.interp(at, course.times, course.acceleration[:, axis]) for axis in (0, 1)], -1) / tables.GRAVITY
    size = np.linalg.norm(shift, axis=-1, keepdims=True)
    limit = 0.30 * neutral.leg
    return shift * np.where(size > 1e-9, limit * np.tanh(size / limit) / np.maximum(size, 1e-9), 1.0)


def posture_over(course: Course, steps: tuple[Footsteps, Footsteps], neutral: Neutral, style: GaitStyle, seed: int) -> Posture:
    """The posture at all moments of `course` for feet that stand as `steps` says (left, right)."""
    trunk = _trunk(course, neutral, style, seed)
    count = len(course.times)
    rate = 1.0 / (course.times[1] - course.times[0])
    posture = Posture(
        fps=round(rate / course.stride, 6),
        heading=course.heading,
        arms=_arms(course, style, seed),
        wrists=np.full((count, 2), np.radians(8.0)),
        ankles=np.zeros((count, 2, 3)),
        feet=np.zeros((count, 2, 3)),
        toes=np.zeros((count, 2)),
        knees=np.full((count, 2), np.radians(2.0)),
        **trunk,
    )
    return with_feet(posture, course.times, steps, neutral)


def with_feet(posture: Posture, times: np.ndarray, steps: tuple[Footsteps, Footsteps], neutral: Neutral) -> Posture:
    """The posture with feet that stand as `steps` says (left, right), hips lowered where a leg would not reach. times (T,)."""
    hips = posture.hips.copy()
    hips[:, 2] -= _drop(posture, times, steps, neutral)
    posture = posture.changed(hips=hips)
    tops = hip_joints(posture, neutral)
    paths = [travel(steps[s], times, tops[:, s], posture.heading, neutral, _thigh_shank(neutral, s)) for s in (0, 1)]
    feet = np.stack([np.stack([np.zeros_like(p.pitch), p.pitch, p.yaw], axis=-1) for p in paths], axis=1)
    return posture.changed(
        ankles=np.stack([p.ankle for p in paths], axis=1), feet=feet, toes=np.stack([p.bend for p in paths], axis=1)
    )


def _thigh_shank(neutral: Neutral, side: int) -> tuple[float, float]:
    body = identify(neutral.skeleton)
    joints = (body.left, body.right)[side]
    hip, knee, ankle = (neutral.positions[j] for j in (joints.upper_leg, joints.lower_leg, joints.foot))
    return float(np.linalg.norm(knee - hip)), float(np.linalg.norm(ankle - knee))


def _drop(posture: Posture, times: np.ndarray, steps, neutral: Neutral) -> np.ndarray:
    """How much (T,) metres the hips have to sink so that standing feet are in reach, smooth in time."""
    tops = hip_joints(posture, neutral)
    need = np.zeros(len(times))
    for side in (0, 1):
        path = travel(steps[side], times, tops[:, side], posture.heading, neutral, _thigh_shank(neutral, side))
        longest = _STRAIGHTEST * sum(_thigh_shank(neutral, side))
        flat = np.sum((tops[:, side, :2] - path.ankle[:, :2]) ** 2, axis=-1)
        highest = path.ankle[:, 2] + np.sqrt(np.maximum(longest**2 - flat, 0.0))
        need = np.maximum(need, np.where(steps[side].standing(times), tops[:, side, 2] - highest, 0.0))
    width = max(int(0.06 / (times[1] - times[0])), 1)
    return _smooth(_running_max(need, width), width)


def _trunk(course: Course, neutral: Neutral, style: GaitStyle, seed: int) -> dict[str, np.ndarray]:
    """Hips, pelvis, spine and head at all moments (arrays of `Posture`)."""
    gear, phase = course.gear, course.phase
    scale = neutral.leg / tables.LEG
    turn = 2.0 * np.pi * phase
    ahead = 1.0 - 0.6 * np.sin(0.5 * course.direction) ** 2
    idle = style.life * (1.0 - smooth_step(gear / 0.7))
    middle = 0.5 * at_speed("duty", gear)
    sway = scale * at_speed("sway", gear) * np.cos(turn - 2.0 * np.pi * middle) + idle * 0.014 * _wander(course.times, seed + 1, 6.0)
    surge = _surge(course, middle)
    across = course.heading
    hips = np.empty((len(gear), 3))
    hips[:, 0] = course.path[:, 0] + surge * np.cos(across + course.direction) - sway * np.sin(across)
    hips[:, 1] = course.path[:, 1] + surge * np.sin(across + course.direction) + sway * np.cos(across)
    hips[:, 2] = hip_height(course, neutral, style)
    lean = _leaning(course)
    wobble = 1.0 + 0.06 * style.life * _wander(course.times, seed + 2, 2.3)
    angle = {name: np.radians(at_speed(name, gear)) * ahead * wobble for name in ("pelvis_turn", "chest_turn", "list", "tilt", "lean")}
    pelvis = np.stack(
        [
            angle["list"] * np.cos(turn - 2.0 * np.pi * 0.2) + 0.35 * lean[:, 0] + idle * 0.02 * _wander(course.times, seed + 1, 6.0),
            angle["tilt"] + 0.35 * lean[:, 1] + np.radians(1.0) * run_share(gear) * np.cos(2.0 * turn),
            -angle["pelvis_turn"] * np.cos(turn + 2.0 * np.pi * 0.18 * run_share(gear)),
        ],
        axis=-1,
    )
    breath = idle * np.radians(0.9) * np.sin(2.0 * np.pi * 0.24 * course.times + seed)
    spine = np.stack(
        [
            -0.85 * (angle["list"] * np.cos(turn - 2.0 * np.pi * 0.2)) + 0.35 * lean[:, 0],
            angle["lean"] - angle["tilt"] + style.lean + 0.35 * lean[:, 1] - breath + 0.02 * np.sin(2.0 * turn) * run_share(gear),
            style.twist * angle["chest_turn"] * np.cos(turn) - pelvis[:, 2],
        ],
        axis=-1,
    )
    look = np.stack([0.0 * gear, np.radians(4.0) + style.head + 0.0 * gear, 0.0 * gear], axis=-1)
    look[:, 2] += idle * np.radians(9.0) * _wander(course.times, seed + 3, 4.0) + 0.12 * np.tanh(_turning(course))
    head = -(pelvis + spine) * np.array([0.8, 0.85, 0.95]) + look
    return {"hips": hips, "pelvis": pelvis, "spine": spine, "head": head}


def _turning(course: Course) -> np.ndarray:
    """Turn rate of the heading (N,), radians per second."""
    return np.gradient(course.heading, course.times)


def _surge(course: Course, middle: np.ndarray) -> np.ndarray:
    """How far (N,) metres the hips run ahead of a steady pace: slowest over the middle of stance (braking, then pushing)."""
    swing = np.minimum(0.07 * course.speed, 0.16)
    frequency = np.maximum(np.gradient(course.phase, course.times), 0.3)
    return -swing / (4.0 * np.pi * frequency) * np.sin(4.0 * np.pi * (course.phase - middle))


def _leaning(course: Course) -> np.ndarray:
    """Extra lean (N, 2) of the body into its acceleration: list (right down positive... about X) and tilt (about Y), radians."""
    cos, sin = np.cos(course.heading), np.sin(course.heading)
    forward = course.acceleration[:, 0] * cos + course.acceleration[:, 1] * sin
    left = -course.acceleration[:, 0] * sin + course.acceleration[:, 1] * cos
    return np.stack([-0.42 * np.tanh(left / 4.5), 0.42 * np.tanh(forward / 5.0)], axis=-1)


def hip_height(course: Course, neutral: Neutral, style: GaitStyle) -> np.ndarray:
    """Height (N,) metres of the hip joints: over the middle of stance as the knee's flexion there says, and the bounce."""
    gear, phase = course.gear, course.phase
    scale = neutral.leg / tables.LEG
    knee = np.radians(at_speed("knee_mid", gear)) + style.crouch
    half = 0.5 * neutral.leg
    chord = 2.0 * half * np.cos(0.5 * knee)
    ahead = at_speed("ahead", gear) * scale
    heel_up = np.maximum(np.sin(tables.stance_pitch(np.full_like(gear, 0.5), gear)), 0.0) * neutral.ball[0, 0] * run_share(gear)
    at_middle = neutral.ankle_height + heel_up + np.sqrt(chord**2 - ahead**2)
    duty = at_speed("duty", gear)
    step_time = 0.5 / np.maximum(np.gradient(phase, course.times), 0.3)
    share = np.clip(2.0 * duty, 0.4, 1.0)
    run = run_share(gear)
    walking = scale * at_speed("bob", gear)
    bob = (1.0 - run) * walking * np.cos(4.0 * np.pi * (phase - 0.5 * duty))
    bob = bob + run * tables.bounce(2.0 * phase, share, step_time)
    bob_middle = (1.0 - run) * walking + run * tables.bounce(share * 0.5, share, step_time)
    return at_middle + style.bounce * (1.0 - 0.4 * np.sin(0.5 * course.direction) ** 2) * (bob - bob_middle)


def _arms(course: Course, style: GaitStyle, seed: int) -> np.ndarray:
    """Arms (N, 2, 5) as in `Posture`: each forward together with the other side's leg."""
    gear = course.gear
    run = run_share(gear)
    less = (1.0 - 0.5 * np.sin(0.5 * course.direction) ** 2) * (1.0 - 0.4 * np.sin(course.direction) ** 2)
    figures = {n: np.radians(at_speed(n, gear)) for n in ("arm_swing", "arm_middle", "elbow", "elbow_swing", "abduct", "inward")}
    idle = style.life * (1.0 - smooth_step(gear / 0.7))
    sides = []
    for side, shift in ((0, 0.5), (1, 0.0)):
        uneven = 1.0 + style.life * (0.08 * _wander(course.times, seed + 5 + side, 2.6) + (0.04, -0.04)[side])
        turn = 2.0 * np.pi * (course.phase - shift - 0.02 + 0.07 * run)
        wave = np.cos(turn) * uneven * less * style.arm_swing
        slow = idle * np.radians(2.0) * _wander(course.times, seed + 7 + side, 5.0)
        sides.append(
            np.stack(
                [
                    figures["arm_middle"] + figures["arm_swing"] * wave + slow,
                    figures["abduct"] + style.abduct - np.radians(3.0) * run * wave + 0.5 * slow,
                    figures["inward"] + np.radians(9.0) * run * wave,
                    figures["elbow"] + style.elbow + figures["elbow_swing"] * np.cos(turn - 0.3) * uneven * less,
                    np.radians(18.0) * np.ones_like(gear),
                ],
                axis=-1,
            )
        )
    return np.stack(sides, axis=1)


def _count(speed, duration, fps, turn_rate, direction) -> int:
    lengths = {np.size(v) for v in (speed, turn_rate, direction) if np.ndim(v)}
    if duration is not None:
        lengths.add(int(round(duration * fps)) + 1)
    if len(lengths) != 1:
        raise InputError("gait", f"{sorted(lengths) or 'no'} frames", "one length: a duration or arrays of one size")
    return lengths.pop()


def _at(values, times: np.ndarray, fps: float, count: int) -> np.ndarray:
    values = np.broadcast_to(np.asarray(values, dtype=float), (count,))
    return np.interp(times, np.arange(count) / fps, values)


def _integral(values: np.ndarray, rate: float, zero: int) -> np.ndarray:
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))]) / rate
    return total - total[zero]


def _smooth(values: np.ndarray, width: int) -> np.ndarray:
    """The values (N,) through a Hann window of `width` moments to either side, ends repeated."""
    window = np.hanning(2 * width + 3)[1:-1]
    return np.convolve(np.pad(values, width, mode="edge"), window / window.sum(), mode="valid")


def _running_max(values: np.ndarray, width: int) -> np.ndarray:
    padded = np.pad(values, width, mode="edge")
    return np.max(np.lib.stride_tricks.sliding_window_view(padded, 2 * width + 1), axis=-1)


def _wander(times: np.ndarray, seed: int, period: float) -> np.ndarray:
    """A slow aimless wave (N,) of about unit size: four sines around `period` seconds with seeded phases."""
    random = np.random.default_rng(seed)
    rates, phases = (0.6, 0.9, 1.35, 1.9) / np.float64(period), random.uniform(0.0, 2.0 * np.pi, 4)
    return np.sin(2.0 * np.pi * rates * times[:, None] + phases) @ np.array([0.5, 0.45, 0.35, 0.25])
