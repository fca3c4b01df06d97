"""Synthetic gait: standing, walking, running and sprinting up to 9.5 m/s, in any direction, on any curve and humanoid
skeleton.

Speed decides cadence, stance and swing, bounce, lean and arms by published figures (`gait_tables`). Feet are planned
and planted first (`footsteps`), then the pelvis passes over them and the legs follow by inverse kinematics
(`gait_legs`). Above a jog the pelvis is where the centre of mass flies between contacts (`gait_mass`). Bodies of
another size move alike at the same Froude number v^2 / (g leg) (Alexander 1989): lengths grow with the leg, times with
its root.

    build_gait(1.4, 6.0)                           # six seconds of walking
    build_gait(np.linspace(0, 8, 150), fps=30)     # from standing to a sprint in five seconds
    build_gait(1.2, 6.0, direction=np.pi)          # backward, facing +X
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import interpolate_columns
from ..motion.motion import Motion
from ..motion.retargeting.adult import build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import Posture, to_motion
from ..motion.skeleton import Skeleton
from ..motion.supports import GRAVITY
from . import gait_tables as tables
from .footsteps import Footsteps
from .gait_legs import measure_push_off, plant_feet
from .gait_mass import follow_mass
from .gait_plan import GaitPlan, GaitStyle, plan_gait
from .gait_tables import interpolate_figure
from .gait_upper import pose_arms, pose_trunk

# farthest that a flat foot is ahead of and behind the hips, shares of the leg's length: in walking and running, and in
# a sprint, where it lands less far ahead and leaves farther behind
_LONGEST_AHEAD, _LONGEST_BEHIND = (0.41, 0.37), (0.72, 0.78)


def build_gait(
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
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    gait_plan = plan_gait(
        speed, duration, fps, neutral, phase=phase, turn_rate=turn_rate, direction=direction, style=style, seed=seed
    )
    return to_motion(build_gait_posture(gait_plan, neutral, style, seed), neutral)


def build_gait_posture(gait_plan: GaitPlan, neutral: NeutralStance, style: GaitStyle = GaitStyle(),
                       seed: int = 0) -> Posture:
    """Build the posture at the requested frames of a plan.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
        seed: of the variation.
    Returns:
        The posture, one row per requested frame.
    """
    steps = tuple(plan_footsteps(gait_plan, neutral, style, side) for side in (0, 1))
    return build_posture(gait_plan, steps, neutral, style, seed).frames(gait_plan.requested_slice)


def plan_footsteps(gait_plan: GaitPlan, neutral: NeutralStance, style: GaitStyle, side: int) -> Footsteps:
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
    cycles = np.arange(np.ceil(gait_plan.phase[0] - offset), np.floor(gait_plan.phase[-1] - offset)) + offset
    on = np.interp(cycles, gait_plan.phase, gait_plan.times)
    # share of the stride in stance, by the speed at landing, then by the speed in mid-stance
    duty = interpolate_figure("duty", np.interp(on, gait_plan.times, gait_plan.adult_speed))
    duty = interpolate_figure("duty", np.interp(cycles + 0.5 * duty, gait_plan.phase, gait_plan.adult_speed))
    off = np.interp(cycles + duty, gait_plan.phase, gait_plan.times)
    middle = 0.5 * (on + off)
    sign = 1.0 if side == 0 else -1.0
    adult_speed, heading, direction = (
        np.interp(middle, gait_plan.times, v) for v in (gait_plan.adult_speed, gait_plan.heading, gait_plan.direction)
    )
    scale = neutral.leg / tables.LEG
    ahead = interpolate_figure("ahead", adult_speed) * np.abs(np.cos(direction)) * scale
    left = sign * 0.5 * (interpolate_figure("width", adult_speed) * scale + style.width)
    # sideways the base is as wide as the body travels in half a stance, so that legs do not cross
    left = (
        left + sign * 0.5 * np.abs(np.sin(direction)) * np.interp(middle, gait_plan.times, gait_plan.speed) * (off - on)
        * 0.8
    )
    place = interpolate_columns(middle, gait_plan.times, gait_plan.path)
    place = place + np.stack(
        [ahead * np.cos(heading) - left * np.sin(heading), ahead * np.sin(heading) + left * np.cos(heading)], -1
    )
    place = place - _compute_lean_shift(gait_plan, neutral, middle)
    toe_out = sign * (np.radians(interpolate_figure("toe_out", adult_speed)) + style.toe_out)
    on, off = _limit_stances(gait_plan, place, on, off, adult_speed=adult_speed, neutral=neutral)
    return Footsteps(side=side, on=on, off=off, place=place, yaw=heading + toe_out, speed=adult_speed,
                     direction=direction)


def _limit_stances(
    gait_plan: GaitPlan, place: np.ndarray, on: np.ndarray, off: np.ndarray, adult_speed: np.ndarray,
    neutral: NeutralStance
) -> tuple[np.ndarray, np.ndarray]:
    """Cut stances (K,) where the hips are too far from the foot: when speed changes in a stance, feet lift earlier."""
    share = np.linspace(0.0, 0.5, 26)
    sprint = tables.compute_sprint_share(adult_speed)[:, None]
    ends = []
    farthest_behind = _LONGEST_BEHIND[0], min(_LONGEST_BEHIND[1], measure_push_off(neutral))
    for edge, sign, (running, sprinting) in ((on, -1.0, _LONGEST_AHEAD), (off, 1.0, farthest_behind)):
        at = 0.5 * (on + off)[:, None] + sign * share * (off - on)[:, None]
        hips = interpolate_columns(at, gait_plan.times, gait_plan.path)
        farthest = (running + (sprinting - running) * sprint) * neutral.leg
        is_near = np.linalg.norm(hips - place[:, None], axis=-1) <= farthest
        last = np.where(is_near.all(axis=1), len(share) - 1, np.argmin(is_near, axis=1))
        ends.append(
            np.where(is_near.all(axis=1), edge, np.take_along_axis(at, np.maximum(last, 8)[:, None], axis=1)[:, 0])
        )
    return ends[0], ends[1]


def _compute_lean_shift(gait_plan: GaitPlan, neutral: NeutralStance, at: np.ndarray) -> np.ndarray:
    """Compute how far the feet stay behind the hips (K, 2) m while the body leans into an acceleration."""
    height = 0.8 * (neutral.leg + neutral.ankle_height)
    shift = height * interpolate_columns(at, gait_plan.times, gait_plan.acceleration) / GRAVITY
    size = np.linalg.norm(shift, axis=-1, keepdims=True)
    limit = 0.30 * neutral.leg
    return shift * np.where(size > 1e-9, limit * np.tanh(size / limit) / np.maximum(size, 1e-9), 1.0)


def build_posture(
    gait_plan: GaitPlan, steps: tuple[Footsteps, ...], neutral: NeutralStance, style: GaitStyle, seed: int
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
    return plant_feet(build_upper_posture(gait_plan, neutral, style, seed), gait_plan.times, steps, neutral)


def build_upper_posture(gait_plan: GaitPlan, neutral: NeutralStance, style: GaitStyle, seed: int) -> Posture:
    """Build the posture at all moments of a plan without feet, which `plant_feet` sets.

    The hips of a runner are where the centre of mass flies between the plan's own contacts (`gait_mass`).

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
        seed: of the variation.
    Returns:
        The posture, N rows.
    """
    posture = pose_upper_body(gait_plan, neutral, style, seed)
    if not np.any(tables.compute_flight_share(gait_plan.adult_speed)):
        return posture
    steps = tuple(plan_footsteps(gait_plan, neutral, style, side) for side in (0, 1))
    return follow_mass(posture, gait_plan, steps, neutral)


def pose_upper_body(gait_plan: GaitPlan, neutral: NeutralStance, style: GaitStyle, seed: int) -> Posture:
    """Pose hips, trunk and arms as the tables have them, for moves whose flights are not those of a run.

    Args:
        gait_plan, neutral, style, seed: as for `build_upper_posture`.
    Returns:
        The posture, N rows.
    """
    above = pose_trunk(gait_plan, neutral, style, seed)
    count = len(gait_plan.times)
    rate = 1.0 / (gait_plan.times[1] - gait_plan.times[0])
    return Posture(
        fps=round(rate / gait_plan.stride, 6), heading=gait_plan.heading, arms=pose_arms(gait_plan, style, seed),
        wrists=np.full((count, 2), np.radians(8.0)), ankles=np.zeros((count, 2, 3)), feet=np.zeros((count, 2, 3)),
        toes=np.zeros((count, 2)), knees=np.full((count, 2), np.radians(2.0)), **above,
    )
