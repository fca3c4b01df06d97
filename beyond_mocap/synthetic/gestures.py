"""Synthetic touches of the ball while running: kicks, a dribble; and key poses over time, as all moves use
them.

Each is the gait's posture with key poses blended over it, given as tables over seconds from the key moment (the touch).
Instants, foot speeds and ranges of the instep kick follow Nunome, Asai, Ikegami and Sakurai 2002 (Med Sci Sports Exerc
34) and Lees, Asai, Andersen, Nunome and Sterzing 2010 (J Sports Sci 28): backswing to 100 degrees of knee flexion,
impact with the knee near 45 and opening, support foot down a fifth of a second before, the opposite arm swung out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..base.easing import quintic_step
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion
from ..motion.retargeting.adult import build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import Posture, compute_hip_positions, to_motion
from ..motion.skeleton import Skeleton
from . import gait_tables as tables
from .footsteps import Footsteps, compute_ground_lift
from .gait import build_posture, plan_footsteps
from .gait_legs import limit_leg_reach, measure_leg, plant_feet
from .gait_plan import GaitPlan, GaitStyle, plan_gait

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

LEFT, RIGHT = 0, 1


@dataclass(frozen=True, eq=False)
class Gesture:
    """A synthetic move.

    Attributes:
        motion: the motion.
        key: s of the key moment; None for continuous moves.
        start: s at which the move starts.
        end: s at which it ends.
    """

    motion: Motion
    key: float | None
    start: float
    end: float


@dataclass(frozen=True, kw_only=True)
class StrikeRecipe:
    """How the right foot meets the ball and how the body moves; seconds from the touch, metres of an adult, degrees.

    Attributes:
        foot: rows (time, ahead of the hips, left of them, ankle height, pitch, yaw, roll); () leaves it as it runs.
        pelvis: rows (time, list, tilt, turn).
        spine: rows (time, list, tilt, turn).
        left_arm: rows (time, flexion, abduction, inward, elbow).
        right_arm: rows (time, flexion, abduction, inward, elbow).
        speeds: rows (time, m/s).
        pace: factor on the cadence around the touch.
        at: share of the right foot's swing at which it touches.
        sink: rows (time, metres that the hips are lowered).
        head: nod in degrees.
    """

    foot: tuple
    pelvis: tuple
    spine: tuple
    left_arm: tuple
    right_arm: tuple
    speeds: tuple
    pace: float
    at: float
    sink: tuple
    head: float = 14.0


_KICK_SPEEDS = ((-2.6, 2.4), (-1.4, 2.9), (-0.6, 2.8), (0.0, 1.9), (0.45, 1.3), (1.0, 1.6), (2.2, 2.3))
STRIKES = {
    "kick low inside": StrikeRecipe(
        foot=(
            (-0.15, -0.42, -0.14, 0.34, 45, -35, 0), (0.0, 0.30, -0.11, 0.105, 2, -68, -6),
            (0.09, 0.58, -0.08, 0.22, -4, -62, -8), (0.20, 0.60, -0.09, 0.32, 0, -40, -4),
        ),
        pelvis=((-0.15, 4, 4, -20), (0.0, 5, -2, 6), (0.18, 3, -4, 16)),
        spine=((-0.15, -10, 8, 24), (0.0, -9, 10, -4), (0.18, -4, 12, -16)),
        left_arm=((-0.15, -12, 48, 10, 30), (0.0, 22, 42, 20, 38), (0.2, 36, 24, 30, 48)),
        right_arm=((-0.15, 26, 22, 25, 42), (0.0, -16, 32, 15, 34), (0.2, -28, 30, 10, 30)),
        speeds=_KICK_SPEEDS,
        pace=0.86,
        at=0.46,
        sink=((-0.1, 0.01), (0.0, 0.015), (0.2, 0.005)),
    ),
    "kick low top": StrikeRecipe(
        foot=(
            (-0.14, -0.52, -0.16, 0.50, 88, -8, 0), (0.0, 0.24, -0.09, 0.175, 36, -10, 6),
            (0.07, 0.66, 0.02, 0.42, 18, 2, 4), (0.17, 0.70, 0.10, 0.72, -10, 10, 0),
            (0.30, 0.56, 0.06, 0.48, -2, 6, 0),
        ),
        pelvis=((-0.14, 4, 6, -32), (0.0, 8, -6, 2), (0.17, 4, -12, 26)),
        spine=((-0.14, -14, 2, 42), (0.0, -16, 10, 2), (0.17, -8, 26, -30)),
        left_arm=((-0.16, -30, 78, 0, 18), (0.0, 24, 62, 15, 30), (0.18, 58, 26, 40, 42)),
        right_arm=((-0.16, 34, 24, 25, 48), (0.0, -26, 36, 10, 34), (0.18, -48, 36, 0, 22)),
        speeds=_KICK_SPEEDS,
        pace=0.80,
        at=0.42,
        sink=((-0.1, 0.015), (0.0, 0.02), (0.2, 0.0)),
    ),
}


# s that the kicking foot needs to reach the ground
_LANDING_SECONDS = 0.1


def build_strike(
    kind: str, skeleton: Skeleton | None = None, fps: float = 60.0, speed: float = 1.0, seed: int = 0, *,
    example: Motion | None = None,
) -> Gesture:
    """Build a strike of the right foot after an approach; the body faces and travels along +X and runs on.

    At the key moment the ball is at the foot, see `foot` of the Strike.

    Args:
        kind: one of STRIKES.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        speed: factor on the approach's speed.
        seed: of the gait's variation.
        example: a recording on `skeleton`, for its neutral stance.
    Returns:
        The move.
    """
    return build_touch(STRIKES[kind], skeleton, fps, speed, seed, example=example)


def build_touch(
    recipe: StrikeRecipe, skeleton: Skeleton | None = None, fps: float = 60.0, speed: float = 1.0, seed: int = 0, *,
    example: Motion | None = None,
) -> Gesture:
    """Build a touch of the ball while the body travels along +X; its right foot, if the recipe guides it, is at the
    ball.

    Args:
        recipe: how the body moves.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        speed: factor on the recipe's speeds.
        seed: of the gait's variation.
        example: a recording on `skeleton`, for its neutral stance.
    Returns:
        The move.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    key = -recipe.speeds[0][0]
    end = key + recipe.speeds[-1][0]
    times = np.arange(int(round(end * fps)) + 1) / fps
    speeds = speed * interpolate_rows(recipe.speeds, times - key)[:, 0]
    style = GaitStyle(head=np.radians(recipe.head))
    gait_plan = plan_gait(speeds, None, fps, neutral, style=style, seed=seed)
    gait_plan = _adapt_phase(gait_plan, key, recipe)
    steps = tuple(plan_footsteps(gait_plan, neutral, style, side) for side in (LEFT, RIGHT))
    posture = build_posture(gait_plan, steps, neutral, style, seed)
    posture = _blend_strike(posture, gait_plan, steps, key=key, recipe=recipe, neutral=neutral)
    begin, land = _find_swing(steps[RIGHT], key)
    return Gesture(to_motion(posture.frames(gait_plan.requested_slice), neutral), key, begin - 0.15, land + 0.1)


def _adapt_phase(gait_plan: GaitPlan, key: float, recipe: StrikeRecipe) -> GaitPlan:
    """Adapt a plan: the cadence dips around the touch, and the right foot is in its swing then."""
    rate = np.gradient(gait_plan.phase, gait_plan.times)
    dip = 1.0 - (1.0 - recipe.pace) * np.exp(-(((gait_plan.times - key - 0.1) / 0.33) ** 2))
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rate * dip)[1:] + 0.5 * (rate * dip)[:-1])])
    phase = phase * (gait_plan.times[1] - gait_plan.times[0])
    duty = float(tables.interpolate_figure("duty", np.interp(key - 0.2, gait_plan.times, gait_plan.adult_speed)))
    wanted_phase = 0.5 + duty + recipe.at * (1.0 - duty)
    return replace(gait_plan, phase=phase + wanted_phase - np.interp(key, gait_plan.times, phase))


def _find_swing(steps: Footsteps, moment: float) -> tuple[float, float]:
    """Find the seconds at which the swing around `moment` begins and ends."""
    which = int(steps.find_stance(np.array([moment]))[0])
    return float(steps.off[which]), float(steps.on[which + 1])


def _blend_strike(posture: Posture, gait_plan: GaitPlan, steps, key: float, recipe: StrikeRecipe,
                  neutral: NeutralStance) -> Posture:
    """Blend a strike's trunk, arms and foot over the posture of a run."""
    scale = neutral.leg / tables.LEG
    times = gait_plan.times - key
    hips = posture.hips.copy()
    ease = compute_envelope(times, -0.42, -0.16, 0.26, 0.65)
    hips[:, 2] -= scale * ease * interpolate_rows(recipe.sink, times)[:, 0]
    posture = plant_feet(posture.replace_arrays(hips=hips), gait_plan.times, steps, neutral)
    pelvis = blend_arrays(posture.pelvis, np.radians(interpolate_rows(recipe.pelvis, times)), ease)
    spine = blend_arrays(posture.spine, np.radians(interpolate_rows(recipe.spine, times)), ease)
    head = posture.head - (pelvis + spine - posture.pelvis - posture.spine) * np.array([0.8, 0.6, 0.95])
    arms = posture.arms.copy()
    for side, rows in ((LEFT, recipe.left_arm), (RIGHT, recipe.right_arm)):
        arms[:, side, :4] = blend_arrays(arms[:, side, :4], np.radians(interpolate_rows(rows, times)), ease)
    posture = posture.replace_arrays(pelvis=pelvis, spine=spine, head=head, arms=arms)
    if not recipe.foot:
        return posture
    return _guide_foot(posture, gait_plan, steps[RIGHT], key=key, rows=recipe.foot, neutral=neutral)


def _guide_foot(posture: Posture, gait_plan: GaitPlan, steps: Footsteps, key: float, rows,
                neutral: NeutralStance) -> Posture:
    """Guide the right foot's swing around `key` seconds through the rows of a Strike; its ends stay as they were."""
    from scipy.interpolate import CubicSpline

    swing = _find_swing(steps, key)
    scale = neutral.leg / tables.LEG
    inside = (gait_plan.times > swing[0]) & (gait_plan.times < swing[1])
    edges = np.flatnonzero(inside)[[0, -1]] + [-1, 1]
    ground = posture.hips * [1.0, 1.0, 0.0]
    into = quaternion.from_up_angle(-posture.heading)
    frame = np.concatenate([quaternion.rotate(into, posture.ankles[:, RIGHT] - ground), posture.feet[:, RIGHT]], axis=1)
    frame[:, 5] -= posture.heading
    rows = np.array([r for r in rows if swing[0] + 0.04 < key + r[0] < swing[1] - _LANDING_SECONDS], dtype=float)
    values = np.column_stack([rows[:, 1:4] * scale, np.radians(rows[:, [6, 4, 5]])])
    at = np.concatenate([gait_plan.times[edges[:1]], key + rows[:, 0], gait_plan.times[edges[1:]]])
    speeds = np.gradient(frame, gait_plan.times, axis=0)[edges + [-1, 1]]
    through = np.concatenate([frame[edges[:1]], values, frame[edges[1:]]])
    path = CubicSpline(at, through, axis=0, bc_type=((1, speeds[0]), (1, speeds[1])))(gait_plan.times[inside])
    ankles, feet = posture.ankles.copy(), posture.feet.copy()
    back = quaternion.from_up_angle(posture.heading[inside])
    free = ground[inside] + quaternion.rotate(back, path[:, :3])
    hip = compute_hip_positions(posture, neutral)[inside, RIGHT]
    ankles[inside, RIGHT] = limit_leg_reach(free, hip, gait_plan.times[inside], steps, sum(measure_leg(neutral, RIGHT)))
    edge = np.sin(np.pi * (gait_plan.times[inside] - swing[0]) / (swing[1] - swing[0]))
    ankles[inside, RIGHT, 2] += compute_ground_lift(ankles[inside, RIGHT, 2], path[:, 4], neutral) * np.sqrt(
        np.maximum(edge, 0.0)
    )
    feet[inside, RIGHT] = path[:, 3:] + np.stack([0 * path[:, 0], 0 * path[:, 0], posture.heading[inside]], axis=-1)
    return posture.replace_arrays(ankles=ankles, feet=feet)


def build_dribble(
    speed: float, duration: float, skeleton: Skeleton | None = None, fps: float = 30.0, seed: int = 0, **gait_options
) -> Motion:
    """Build a run with the ball at the feet: short strides, bent knees, the head down; each right swing ends in a
    touch.

    Args:
        speed: m/s.
        duration: s.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the gait's variation.
        gait_options: turn_rate, phase as for `build_gait`.
    Returns:
        The motion.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton())
    style = GaitStyle(cadence=1.12, crouch=np.radians(7), lean=np.radians(4), head=np.radians(30), abduct=np.radians(9))
    gait_plan = plan_gait(speed, duration, fps, neutral, style=style, seed=seed, **gait_options)
    steps = tuple(plan_footsteps(gait_plan, neutral, style, side) for side in (LEFT, RIGHT))
    posture = build_posture(gait_plan, steps, neutral, style, seed)
    ankles, feet = posture.ankles.copy(), posture.feet.copy()
    which = steps[RIGHT].find_stance(gait_plan.times)
    share = (gait_plan.times - steps[RIGHT].off[which]) / (steps[RIGHT].on[which + 1] - steps[RIGHT].off[which])
    touch = np.where(share > 0, np.exp(-(((np.clip(share, 0, 1) - 0.78) / 0.1) ** 2)), 0.0)
    touch = touch * quintic_step(np.clip((1.0 - share) / 0.1, 0, 1))
    scale = neutral.leg / tables.LEG
    ahead = np.stack([np.cos(posture.heading), np.sin(posture.heading), 0 * touch], axis=-1)
    ankles[:, RIGHT] += 0.05 * scale * touch[:, None] * ahead
    feet[:, RIGHT, 1] += np.radians(16) * touch
    feet[:, RIGHT, 2] -= np.radians(22) * touch
    ankles[:, RIGHT, 2] += touch * compute_ground_lift(ankles[:, RIGHT, 2], feet[:, RIGHT, 1], neutral)
    posture = posture.replace_arrays(ankles=ankles, feet=feet)
    return to_motion(posture.frames(gait_plan.requested_slice), neutral)


def interpolate_rows(rows, times: np.ndarray) -> np.ndarray:
    """Interpolate rows smoothly without overshoot; constant before the first and after the last row.

    Args:
        rows: (time, values...) each.
        times: (T,) s.
    Returns:
        (T, values).
    """
    first, last, curve = _build_curve(tuple(map(tuple, rows)))
    return curve(np.clip(times, first, last))


def interpolate_rounded(rows, times: np.ndarray, frames: float) -> np.ndarray:
    """Interpolate rows as `interpolate_rows`, without corners in the speed.

    Args:
        rows: (time, values...) each.
        times: (T,) s.
        frames: standard deviation of the Gaussian in frames.
    Returns:
        (T, values).
    """
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(interpolate_rows(rows, times), frames, axis=0, mode="nearest")


def build_plan_parts(style, neutral: NeutralStance, times: np.ndarray, frames: float) -> tuple:
    """Compute what synthetic throws and kicks have in common.

    Args:
        style: a throw's or kick's style.
        neutral: neutral stance of the body.
        times: (T,) s.
        frames: standard deviation over which corners of the tables are rounded, in frames.
    Returns:
        curve: function rows -> (T, values), rounded.
        pelvis: (T, 3) rad as in a `Posture`.
        spine: (T, 3) rad.
        arms: (T, 2, 5) rad.
        height: height of the hips, m.
    """

    def read_rows(rows) -> np.ndarray:
        return interpolate_rounded(rows, times, frames)

    arms = np.zeros((len(times), 2, 5))
    arms[:, RIGHT, :4], arms[:, LEFT, :4] = np.radians(read_rows(style.right_arm)), np.radians(
        read_rows(style.left_arm))
    body = identify_joints(neutral.skeleton)
    height = 0.5 * float(neutral.positions[body.left.upper_leg, 2] + neutral.positions[body.right.upper_leg, 2])
    return read_rows, np.radians(read_rows(style.pelvis)), np.radians(read_rows(style.spine)), arms, height


def choose_style(
    action: str, side: str, limb: str, *, style, styles: Mapping, speed: float, speeds: tuple[float, float]
):
    """Choose the style of a throw or kick.

    Args:
        action: "throw" or "kick", for messages.
        side: "left" or "right".
        limb: "arm" or "leg", for messages.
        style: a style, or the name of one.
        styles: styles by name.
        speed: of the ball, m/s.
        speeds: lowest and highest possible speed, m/s.
    Returns:
        The style.
    Raises:
        InputError: for an unknown style or side, or a speed out of range.
    """
    chosen = style if isinstance(style, type(next(iter(styles.values())))) else styles.get(style)
    if side not in ("left", "right") or chosen is None:
        raise InputError(action, f"{style} with the {side} {limb}", f"left or right, {' or '.join(styles)}")
    if not speeds[0] <= speed <= speeds[1]:
        raise InputError(action, f"{speed:g} m/s", f"{speeds[0]:g} to {speeds[1]:g} m/s")
    return chosen


@lru_cache(maxsize=256)
def _build_curve(rows: tuple) -> tuple[float, float, PchipInterpolator]:
    """Build the first time, last time and curve of a table; cached, because a synthetic move is planned many times."""
    from scipy.interpolate import PchipInterpolator

    table = np.array(rows, dtype=float)
    return table[0, 0], table[-1, 0], PchipInterpolator(table[:, 0], table[:, 1:], axis=0)


def compute_envelope(times: np.ndarray, begin: float, full: float, fade: float, end: float) -> np.ndarray:
    """Compute weights (T,): 0 before `begin`, 1 from `full` to `fade`, 0 after `end`."""
    return quintic_step((times - begin) / (full - begin)) * (1.0 - quintic_step((times - fade) / (end - fade)))


def blend_arrays(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Blend arrays (T, ...) by a weight (T,): 0 gives `a`, 1 gives `b`."""
    weight = weight.reshape(weight.shape + (1,) * (a.ndim - 1))
    return a * (1.0 - weight) + b * weight
