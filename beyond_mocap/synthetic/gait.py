"""Synthetic gait: standing, walking, running and sprinting up to 9.5 m/s, in any direction, on any curve and humanoid
skeleton.

Speed decides cadence, stance and swing, bounce, lean and arms by published figures (`gait_tables`). Feet are planned
and planted first (`footsteps`), then the pelvis passes over them and the legs follow by inverse kinematics. Bodies of
another size move alike at the same Froude number v^2 / (g leg) (Alexander 1989): lengths grow with the leg, times with
its root.

    build_gait(1.4, 6.0)                           # six seconds of walking
    build_gait(np.linspace(0, 8, 150), fps=30)     # from standing to a sprint in five seconds
    build_gait(1.2, 6.0, direction=np.pi)          # backward, facing +X
"""

from __future__ import annotations

import numpy as np

from ..base.easing import quintic_step
from ..base.time_series import hann_smooth, interpolate
from ..motion.humanoid import identify
from ..motion.motion import Motion
from ..motion.retargeting.adult import adult_skeleton
from ..motion.retargeting.neutral import Neutral, neutral_stance
from ..motion.retargeting.posture import Posture, hip_joints, to_motion
from ..motion.skeleton import Skeleton
from . import gait_tables as tables
from .course import Course, GaitStyle, plan, wander
from .footsteps import Footsteps, travel
from .gait_tables import at_speed, run_share

# farthest that a flat foot is ahead of and behind the hips, shares of the leg's length
_AHEAD, _BEHIND = 0.41, 0.72
# longest reach of a leg, walking and running, share of its length: runners' knees stay bent by about 20
# degrees (V, and recordings), and a knee that snaps straight is the most visible error
_STRAIGHTEST = (0.9955, 0.984)
# share of the leg's length below that limit from which a swinging leg eases toward it
_EASE = 0.03


def gait(
    speed: float | np.ndarray, duration: float | None = None, fps: float = 30.0, skeleton: Skeleton | None = None, *,
    style: GaitStyle = GaitStyle(), phase: float = 0.0, turn_rate: float | np.ndarray = 0.0,
    direction: float | np.ndarray = 0.0, seed: int = 0, example: Motion | None = None,
) -> Motion:
    """Build the motion of a body that travels; it begins at the origin and faces +X.

    The pelvis stays within a few centimetres of the requested path; planted feet do not slide.

    Args:
        speed: m/s, 0 to 9.5; one value, or one per frame (T,) (then without `duration`).
        duration: s.
        fps: frames per second.
        skeleton: any humanoid skeleton; default: the project's adult.
        style: differences from the published figures.
        phase: strides at the first frame (0: left foot lands, 0.5: right foot lands).
        turn_rate: rad/s, left positive; one or (T,).
        direction: rad, travel relative to the heading (0 ahead, pi/2 left, pi back); one or (T,).
        seed: of the variation that `style.life` scales.
        example: a recording on `skeleton`, for its neutral stance.
    Returns:
        The motion.
    Raises:
        InputError: for a speed below 0 or above 9.5 m/s, or arrays of different lengths.
    """
    neutral = neutral_stance(skeleton or adult_skeleton(), example)
    course = plan(
        speed, duration, fps, neutral, phase=phase, turn_rate=turn_rate, direction=direction, style=style, seed=seed
    )
    return to_motion(gait_posture(course, neutral, style, seed), neutral)


def gait_posture(course: Course, neutral: Neutral, style: GaitStyle = GaitStyle(), seed: int = 0) -> Posture:
    """Build the posture at the requested frames of a plan.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
        seed: of the variation.
    Returns:
        The posture, one row per requested frame.
    """
    steps = tuple(footsteps(course, neutral, style, side) for side in (0, 1))
    return posture_over(course, steps, neutral, style, seed).frames(course.asked)


def footsteps(course: Course, neutral: Neutral, style: GaitStyle, side: int) -> Footsteps:
    """Plan the stances of one foot: below the hips in the middle of each stance, apart from width and lean.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
        side: 0 left, 1 right.
    Returns:
        The stances.
    """
    offset = 0.5 * side
    # stride phases at which this foot lands
    cycles = np.arange(np.ceil(course.phase[0] - offset), np.floor(course.phase[-1] - offset)) + offset
    on = np.interp(cycles, course.phase, course.times)
    # share of the stride in stance, by the speed at landing, then by the speed in mid-stance
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
    return Footsteps(side=side, on=on, off=off, place=place, yaw=heading + toe_out, speed=gear, direction=direction)


def _within_reach(
    course: Course, place: np.ndarray, on: np.ndarray, off: np.ndarray, leg: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cut stances (K,) where the hips are too far from the foot: when speed changes in a stance, feet lift earlier."""
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
    """Compute how far the feet stay behind the hips (K, 2) m while the body leans into an acceleration."""
    height = 0.8 * (neutral.leg + neutral.ankle_height)
    shift = height * interpolate(at, course.times, course.acceleration) / tables.GRAVITY
    size = np.linalg.norm(shift, axis=-1, keepdims=True)
    limit = 0.30 * neutral.leg
    return shift * np.where(size > 1e-9, limit * np.tanh(size / limit) / np.maximum(size, 1e-9), 1.0)


def posture_over(
    course: Course, steps: tuple[Footsteps, ...], neutral: Neutral, style: GaitStyle, seed: int
) -> Posture:
    """Build the posture at all moments of a plan for given stances.

    Args:
        gait_plan: the plan.
        steps: stances of the left and the right foot.
        neutral: neutral stance of the body.
        style: style of the gait.
        seed: of the variation.
    Returns:
        The posture, N rows.
    """
    above = pose_trunk(course, neutral, style, seed)
    count = len(course.times)
    rate = 1.0 / (course.times[1] - course.times[0])
    posture = Posture(
        fps=round(rate / course.stride, 6), heading=course.heading, arms=pose_arms(course, style, seed),
        wrists=np.full((count, 2), np.radians(8.0)), ankles=np.zeros((count, 2, 3)), feet=np.zeros((count, 2, 3)),
        toes=np.zeros((count, 2)), knees=np.full((count, 2), np.radians(2.0)), **above,
    )
    return with_feet(posture, course.times, steps, neutral)


def with_feet(posture: Posture, times: np.ndarray, steps: tuple[Footsteps, ...], neutral: Neutral) -> Posture:
    """Set the feet of a posture; the hips are lowered where a leg would not reach.

    Args:
        posture: the posture.
        times: (T,) s.
        steps: stances of the left and the right foot.
        neutral: neutral stance of the body.
    Returns:
        The posture with feet.
    """
    hips = posture.hips.copy()
    hips[:, 2] -= _drop(posture, times, steps, neutral)
    posture = posture.changed(hips=hips)
    tops = hip_joints(posture, neutral)
    paths = [travel(steps[s], times, tops[:, s], heading=posture.heading, neutral=neutral,
                    thigh_shank=thigh_shank(neutral, s)) for s in (0, 1)]
    ankles = [kept_bent(paths[s].ankle, tops[:, s], times, steps[s], sum(thigh_shank(neutral, s))) for s in (0, 1)]
    feet = np.stack([np.stack([np.zeros_like(p.pitch), p.pitch, p.yaw], axis=-1) for p in paths], axis=1)
    return posture.changed(ankles=np.stack(ankles, axis=1), feet=feet, toes=np.stack([p.bend for p in paths], axis=1))


def _straightest(steps: Footsteps, times: np.ndarray) -> np.ndarray:
    """Compute the longest reach of a leg at `times` (T,): (T,) share of its length."""
    walking, running = _STRAIGHTEST
    return walking + (running - walking) * tables.run_share(steps.speed[steps.current(times)])


def kept_bent(ankle: np.ndarray, hip: np.ndarray, times: np.ndarray, steps: Footsteps, leg: float) -> np.ndarray:
    """Pull the ankle toward its hip where the leg would be too straight in swing.

    Args:
        ankle: (T, 3) m.
        hip: (T, 3) m.
        times: (T,) s.
        steps: stances of the foot.
        leg: length of the leg, m.
    Returns:
        (T, 3) m.
    """
    away = ankle - hip
    far = np.linalg.norm(away, axis=1)
    share = ease_reach(far, (_straightest(steps, times) + 0.006 - _EASE) * leg, _EASE * leg)
    return hip + away * np.where(steps.standing(times), 1.0, share)[:, None]


def ease_reach(far: np.ndarray, begin: float | np.ndarray, soft: float) -> np.ndarray:
    """Compute by which factors to shorten distances so that they approach a limit softly.

    Args:
        far: (T,) m, distances.
        begin: m from which on they are shortened.
        soft: m, most that they exceed `begin`.
    Returns:
        (T,) factors, 1 below `begin`.
    """
    eased = begin + soft * np.tanh((far - begin) / soft)
    return np.where(far < begin, 1.0, eased / np.maximum(far, 1e-9))


def thigh_shank(neutral: Neutral, side: int) -> tuple[float, float]:
    """Measure the lengths of thigh and shank (m) of one side (0 left, 1 right)."""
    body = identify(neutral.skeleton)
    joints = (body.left, body.right)[side]
    hip, knee, ankle = (neutral.positions[j] for j in (joints.upper_leg, joints.lower_leg, joints.foot))
    return float(np.linalg.norm(knee - hip)), float(np.linalg.norm(ankle - knee))


def _drop(posture: Posture, times: np.ndarray, steps, neutral: Neutral) -> np.ndarray:
    """Compute how far (T,) m to lower the hips so that feet in contact are in reach, smooth in time."""
    tops = hip_joints(posture, neutral)
    need = np.zeros(len(times))
    for side in (0, 1):
        path = travel(steps[side], times, tops[:, side], heading=posture.heading, neutral=neutral,
                      thigh_shank=thigh_shank(neutral, side))
        longest = _straightest(steps[side], times) * sum(thigh_shank(neutral, side))
        flat = np.sum((tops[:, side, :2] - path.ankle[:, :2]) ** 2, axis=-1)
        highest = path.ankle[:, 2] + np.sqrt(np.maximum(longest**2 - flat, 0.0))
        need = np.maximum(need, np.where(steps[side].standing(times), tops[:, side, 2] - highest, 0.0))
    width = max(int(0.06 / (times[1] - times[0])), 1)
    # the greatest need around each frame, then smoothed: never less than needed
    around = np.lib.stride_tricks.sliding_window_view(np.pad(need, width, mode="edge"), 2 * width + 1)
    return hann_smooth(np.max(around, axis=-1), width)


def pose_trunk(course: Course, neutral: Neutral, style: GaitStyle, seed: int) -> dict[str, np.ndarray]:
    """Compute hips, pelvis, spine and head at all N moments.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
        seed: of the variation.
    Returns:
        Arrays of a `Posture` by name.
    """
    gear, phase = course.gear, course.phase
    scale = neutral.leg / tables.LEG
    turn = 2.0 * np.pi * phase
    ahead = 1.0 - 0.6 * np.sin(0.5 * course.direction) ** 2
    idle = style.life * (1.0 - quintic_step(gear / 0.7))
    middle = 0.5 * at_speed("duty", gear)
    sway = scale * at_speed("sway", gear) * np.cos(turn - 2.0 * np.pi * middle) + idle * 0.014 * wander(
        course.times, seed + 1, 6.0
    )
    surge = _surge(course, middle)
    across = course.heading
    hips = np.empty((len(gear), 3))
    hips[:, 0] = course.path[:, 0] + surge * np.cos(across + course.direction) - sway * np.sin(across)
    hips[:, 1] = course.path[:, 1] + surge * np.sin(across + course.direction) + sway * np.cos(across)
    hips[:, 2] = hip_height(course, neutral, style)
    lean = _leaning(course)
    wobble = 1.0 + 0.06 * style.life * wander(course.times, seed + 2, 2.3)
    angle = {
        name: np.radians(at_speed(name, gear)) * ahead * wobble
        for name in ("pelvis_turn", "chest_turn", "list", "tilt", "lean")
    }
    pelvis = np.stack(
        [
            angle["list"] * np.cos(turn - 2.0 * np.pi * 0.2)
            + 0.35 * lean[:, 0]
            + idle * 0.02 * wander(course.times, seed + 1, 6.0),
            angle["tilt"] + 0.35 * lean[:, 1] + np.radians(1.0) * run_share(gear) * np.cos(2.0 * turn),
            -angle["pelvis_turn"] * np.cos(turn + 2.0 * np.pi * 0.18 * run_share(gear)),
        ],
        axis=-1,
    )
    breath = idle * np.radians(0.9) * np.sin(2.0 * np.pi * 0.24 * course.times + seed)
    spine = np.stack(
        [
            -0.85 * (angle["list"] * np.cos(turn - 2.0 * np.pi * 0.2)) + 0.35 * lean[:, 0],
            angle["lean"]
            - angle["tilt"]
            + style.lean
            + 0.35 * lean[:, 1]
            - breath
            + 0.02 * np.sin(2.0 * turn) * run_share(gear),
            style.twist * angle["chest_turn"] * np.cos(turn) - pelvis[:, 2],
        ],
        axis=-1,
    )
    look = np.stack([0.0 * gear, np.radians(4.0) + style.head + 0.0 * gear, 0.0 * gear], axis=-1)
    turn_rate = np.gradient(course.heading, course.times)
    look[:, 2] += idle * np.radians(9.0) * wander(course.times, seed + 3, 4.0) + 0.12 * np.tanh(turn_rate)
    head = -(pelvis + spine) * np.array([0.8, 0.85, 0.95]) + look
    return {"hips": hips, "pelvis": pelvis, "spine": spine, "head": head}


def _surge(course: Course, middle: np.ndarray) -> np.ndarray:
    """Compute how far (N,) m the hips are ahead of a steady pace: slowest in mid-stance (braking, then pushing)."""
    swing = np.minimum(0.07 * course.speed, 0.16)
    frequency = np.maximum(np.gradient(course.phase, course.times), 0.3)
    return -swing / (4.0 * np.pi * frequency) * np.sin(4.0 * np.pi * (course.phase - middle))


def _leaning(course: Course) -> np.ndarray:
    """Compute the extra lean (N, 2) rad of the body into its acceleration: list (about X, right down positive) and tilt
    (about Y).
    """
    cos, sin = np.cos(course.heading), np.sin(course.heading)
    forward = course.acceleration[:, 0] * cos + course.acceleration[:, 1] * sin
    left = -course.acceleration[:, 0] * sin + course.acceleration[:, 1] * cos
    return np.stack([-0.42 * np.tanh(left / 4.5), 0.42 * np.tanh(forward / 5.0)], axis=-1)


def hip_height(course: Course, neutral: Neutral, style: GaitStyle) -> np.ndarray:
    """Compute the height of the hip joints: in mid-stance by the knee's flexion there, plus the bounce.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
    Returns:
        (N,) m.
    """
    gear, phase = course.gear, course.phase
    scale = neutral.leg / tables.LEG
    knee = np.radians(at_speed("knee_mid", gear)) + style.crouch
    half = 0.5 * neutral.leg
    chord = 2.0 * half * np.cos(0.5 * knee)
    ahead = at_speed("ahead", gear) * scale
    heel_up = (
        np.maximum(np.sin(tables.stance_pitch(np.full_like(gear, 0.5), gear)), 0.0)
        * neutral.ball[0, 0]
        * run_share(gear)
    )
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


def pose_arms(course: Course, style: GaitStyle, seed: int) -> np.ndarray:
    """Compute the arms: each swings forward together with the other side's leg.

    Args:
        gait_plan: the plan.
        style: style of the gait.
        seed: of the variation.
    Returns:
        (N, 2, 5) rad as in `Posture`.
    """
    gear = course.gear
    run = run_share(gear)
    less = (1.0 - 0.5 * np.sin(0.5 * course.direction) ** 2) * (1.0 - 0.4 * np.sin(course.direction) ** 2)
    figures = {
        n: np.radians(at_speed(n, gear))
        for n in ("arm_swing", "arm_middle", "elbow", "elbow_swing", "abduct", "inward")
    }
    idle = style.life * (1.0 - quintic_step(gear / 0.7))
    sides = []
    for side, shift in ((0, 0.5), (1, 0.0)):
        uneven = 1.0 + style.life * (0.08 * wander(course.times, seed + 5 + side, 2.6) + (0.04, -0.04)[side])
        turn = 2.0 * np.pi * (course.phase - shift - 0.02 + 0.17 * run)
        wave = np.cos(turn) * uneven * less * style.arm_swing
        slow = idle * np.radians(2.0) * wander(course.times, seed + 7 + side, 5.0)
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
