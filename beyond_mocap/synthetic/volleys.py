"""Synthetic strikes out of standing for passing games: foot volleys, a trap, a header, chest, hand and racquet.

Each begins and ends standing. The left foot stays in place; key poses over seconds from the touch are blended over
standing, and the right foot is guided through the rows of a table and back to its place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.motion import Motion
from ..motion.retargeting.adult import build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import Posture, compute_hip_positions, to_motion
from ..motion.skeleton import Skeleton
from . import gait_tables as tables
from .footsteps import Footsteps, compute_ground_lift
from .gait_legs import ease_reach, measure_leg, plant_feet
from .gait_plan import GaitPlan
from .gestures import LEFT, RIGHT, Gesture, blend_arrays, compute_envelope, interpolate_rows
from .idle import build_ready, plan_still_feet
from .moves import build_steps

BEFORE, AFTER = 1.6, 1.9
"""Seconds of the clip before and after the touch."""

_LONGEST_REACH, _EASE_SHARE = 0.985, 0.06  # shares of a leg's length: longest reach, and range over which it is eased


@dataclass(frozen=True, kw_only=True)
class Volley:
    """How a standing body strikes with its right side; seconds from the touch, metres of an adult, degrees.

    Attributes:
        labels: labels of the vocabulary.
        span: seconds in which the body differs from standing.
        hips: rows (time, ahead, left, lowered).
        pelvis: rows (time, list, tilt, turn).
        spine: rows (time, list, tilt, turn).
        head: rows (time, nod, turn).
        left_arm: rows (time, flexion, abduction, inward, elbow).
        right_arm: rows (time, flexion, abduction, inward, elbow).
        foot: rows (time, ahead of the hips, left of them, ankle height, pitch, yaw, roll); None: it stays in place.
        wrist: rows (time, right hand's flexion).
    """

    labels: str
    span: tuple[float, float]
    hips: tuple
    pelvis: tuple
    spine: tuple
    head: tuple
    left_arm: tuple
    right_arm: tuple
    foot: tuple | None = None
    wrist: tuple = ((0.0, 8.0), (1.0, 8.0))


VOLLEYS = {
    "toss": Volley(
        labels="kick right low top standing front toss",
        span=(-0.75, 1.0),
        foot=(
            (-0.30, -0.06, -0.13, 0.15, 26, -10, 0), (-0.14, 0.14, -0.12, 0.22, 22, -12, 0),
            (0.0, 0.34, -0.10, 0.38, 12, -12, 4), (0.10, 0.38, -0.09, 0.50, 2, -12, 4),
            (0.32, 0.30, -0.10, 0.38, 6, -12, 0), (0.60, 0.08, -0.11, 0.14, 4, -10, 0),
        ),
        hips=(
            (-0.75, 0, 0, 0), (-0.42, 0.0, 0.06, 0.015), (0.0, -0.02, 0.075, 0.02), (0.5, -0.01, 0.06, 0.01),
            (1.0, 0, 0, 0),
        ),
        pelvis=((-0.5, 0, 1, -4), (0.0, -3, -6, 4), (0.3, -1, -2, 2), (0.85, 0, 0, 0)),
        spine=((-0.5, 0, 6, 4), (0.0, -2, 12, -4), (0.3, 0, 8, -2), (0.85, 0, 2, 0)),
        head=((-0.6, -8, 0), (0.0, 22, 0), (0.2, 6, 0), (0.5, -18, 0), (0.85, 0, 0)),
        left_arm=((-0.6, 6, 14, 12, 22), (0.0, 22, 42, 14, 36), (0.3, 14, 32, 14, 32), (0.85, 2, 10, 12, 16)),
        right_arm=((-0.6, 6, 14, 12, 22), (0.0, -6, 40, 10, 34), (0.3, 4, 30, 12, 30), (0.85, 2, 10, 12, 16)),
    ),
    "pass": Volley(
        labels="kick right low volley standing front pass",
        span=(-0.8, 1.0),
        foot=(
            (-0.40, -0.12, -0.13, 0.14, 30, -8, 0), (-0.22, -0.30, -0.14, 0.30, 62, -10, 0),
            (-0.09, 0.02, -0.11, 0.20, 44, -10, 4), (0.0, 0.40, -0.08, 0.31, 28, -8, 6),
            (0.09, 0.60, -0.03, 0.52, 14, 0, 4), (0.18, 0.60, 0.00, 0.60, 2, 4, 0), (0.38, 0.34, -0.06, 0.34, 4, -2, 0),
            (0.56, 0.10, -0.11, 0.13, 2, -8, 0),
        ),
        hips=(
            (-0.8, 0, 0, 0), (-0.46, -0.02, 0.06, 0.015), (0.0, 0.03, 0.075, 0.03), (0.4, 0.02, 0.06, 0.015),
            (1.0, 0, 0, 0),
        ),
        pelvis=(
            (-0.5, 0, 2, -8), (-0.2, 2, 5, -18), (0.0, -3, -6, 6), (0.18, -3, -10, 14), (0.5, 0, -2, 6), (1.0, 0, 0, 0),
        ),
        spine=(
            (-0.5, 0, 6, 8), (-0.2, -4, 4, 20), (0.0, -5, 14, -4), (0.18, -3, 20, -14), (0.5, 0, 8, -4), (1.0, 0, 2, 0),
        ),
        head=((-0.6, -6, 0), (-0.1, 16, 0), (0.05, 18, 0), (0.4, -8, 0), (1.0, 0, 0)),
        left_arm=(
            (-0.6, 4, 16, 12, 22), (-0.2, -16, 52, 5, 26), (0.02, 24, 52, 16, 34), (0.2, 44, 34, 28, 42),
            (1.0, 2, 10, 12, 16),
        ),
        right_arm=(
            (-0.6, 4, 16, 12, 22), (-0.2, 24, 28, 20, 40), (0.02, -16, 38, 10, 32), (0.2, -30, 36, 5, 26),
            (1.0, 2, 10, 12, 16),
        ),
    ),
    "attack": Volley(
        labels="kick right high top standing front attack",
        span=(-0.85, 1.1),
        foot=(
            (-0.44, -0.14, -0.15, 0.15, 30, -10, 0), (-0.24, -0.42, -0.24, 0.46, 80, -22, 0),
            (-0.10, -0.04, -0.32, 0.50, 66, -24, 10), (0.0, 0.48, -0.20, 0.66, 40, -8, 16),
            (0.07, 0.68, 0.02, 0.82, 28, 14, 14), (0.16, 0.60, 0.18, 0.84, 14, 26, 6),
            (0.38, 0.36, 0.02, 0.46, 4, 10, 0), (0.60, 0.12, -0.10, 0.14, 2, -6, 0),
        ),
        hips=(
            (-0.85, 0, 0, 0), (-0.48, -0.03, 0.065, 0.02), (0.0, 0.02, 0.085, 0.035), (0.2, 0.0, 0.08, 0.01),
            (0.5, 0.0, 0.06, 0.01), (1.1, 0, 0, 0),
        ),
        pelvis=(
            (-0.5, 0, 2, -12), (-0.22, 3, 8, -34), (0.0, -8, -12, 8), (0.16, -8, -18, 26), (0.5, -1, -4, 10),
            (1.1, 0, 0, 0),
        ),
        spine=(
            (-0.5, 0, 6, 12), (-0.22, -6, 2, 38), (0.0, -14, 10, -2), (0.16, -8, 22, -26), (0.5, -1, 10, -8),
            (1.1, 0, 2, 0),
        ),
        head=((-0.6, -8, 0), (-0.1, 4, 0), (0.08, 8, 0), (0.45, -4, 0), (1.1, 0, 0)),
        left_arm=(
            (-0.6, 4, 18, 12, 22), (-0.22, -26, 78, 0, 20), (0.02, 28, 66, 16, 30), (0.2, 56, 34, 36, 42),
            (0.6, 20, 22, 16, 30), (1.1, 2, 10, 12, 16),
        ),
        right_arm=(
            (-0.6, 4, 18, 12, 22), (-0.22, 34, 30, 24, 46), (0.02, -24, 48, 8, 32), (0.2, -42, 42, 0, 24),
            (0.6, -8, 24, 12, 24), (1.1, 2, 10, 12, 16),
        ),
    ),
    "receive": Volley(
        labels="receive right foot low inside standing front",
        span=(-0.75, 0.95),
        foot=(
            (-0.28, 0.10, -0.13, 0.14, 4, -40, 0), (-0.10, 0.32, -0.13, 0.155, -6, -66, -6),
            (0.0, 0.34, -0.13, 0.150, -6, -70, -6), (0.20, 0.16, -0.13, 0.130, -2, -68, -4),
            (0.40, 0.08, -0.12, 0.110, 2, -40, 0),
        ),
        hips=(
            (-0.75, 0, 0, 0), (-0.38, 0.0, 0.06, 0.03), (0.0, -0.01, 0.075, 0.045), (0.3, 0.0, 0.06, 0.04),
            (0.95, 0, 0, 0),
        ),
        pelvis=((-0.4, 1, 2, -4), (0.0, 0, 0, -2), (0.25, 0, 2, -10), (0.95, 0, 0, 0)),
        spine=((-0.4, 0, 9, 4), (0.0, -2, 12, 0), (0.25, 0, 14, 6), (0.95, 0, 2, 0)),
        head=((-0.6, 4, 0), (0.0, 26, 0), (0.4, 26, 0), (0.95, 0, 0)),
        left_arm=((-0.5, 8, 24, 12, 28), (0.0, 14, 42, 15, 40), (0.3, 10, 36, 15, 42), (0.95, 2, 10, 12, 16)),
        right_arm=((-0.5, 8, 24, 12, 28), (0.0, -6, 40, 15, 38), (0.3, 4, 34, 15, 40), (0.95, 2, 10, 12, 16)),
    ),
    "head": Volley(
        labels="header standing front",
        span=(-0.85, 0.95),
        hips=(
            (-0.85, 0, 0, 0), (-0.30, -0.03, 0, 0.07), (-0.1, -0.01, 0, 0.03), (0.0, 0.04, 0, 0.0),
            (0.2, 0.05, 0, 0.02), (0.95, 0, 0, 0),
        ),
        pelvis=((-0.6, 0, 2, 0), (-0.28, 0, -8, 0), (0.0, 0, 2, 0), (0.2, 0, 8, 0), (0.95, 0, 0, 0)),
        spine=((-0.6, 0, 4, 0), (-0.26, 0, -18, 0), (0.0, 0, 6, 0), (0.18, 0, 18, 0), (0.95, 0, 2, 0)),
        head=((-0.6, -12, 0), (-0.26, -20, 0), (0.0, 6, 0), (0.14, 10, 0), (0.5, -6, 0), (0.95, 0, 0)),
        left_arm=(
            (-0.6, 10, 20, 14, 30), (-0.28, 40, 46, 24, 62), (0.0, 0, 42, 20, 70), (0.25, 4, 34, 18, 52),
            (0.95, 2, 10, 12, 16),
        ),
        right_arm=(
            (-0.6, 10, 20, 14, 30), (-0.28, 40, 46, 24, 62), (0.0, 0, 42, 20, 70), (0.25, 4, 34, 18, 52),
            (0.95, 2, 10, 12, 16),
        ),
    ),
    "chest": Volley(
        labels="receive body standing front", span=(-0.75, 0.95),
        hips=((-0.75, 0, 0, 0), (-0.25, 0.02, 0, 0.05), (0.0, 0.07, 0, 0.06), (0.2, 0.05, 0, 0.05), (0.95, 0, 0, 0)),
        pelvis=((-0.5, 0, 0, 0), (0.0, 0, -12, 0), (0.22, 0, -6, 0), (0.95, 0, 0, 0)),
        spine=((-0.5, 0, 0, 0), (-0.05, 0, -20, 0), (0.2, 0, -2, 0), (0.95, 0, 2, 0)),
        head=((-0.5, -6, 0), (0.0, 22, 0), (0.3, 34, 0), (0.95, 0, 0)),
        left_arm=((-0.5, 4, 20, 10, 24), (0.0, -10, 62, 0, 50), (0.25, 0, 50, 5, 46), (0.95, 2, 10, 12, 16)),
        right_arm=((-0.5, 4, 20, 10, 24), (0.0, -10, 62, 0, 50), (0.25, 0, 50, 5, 46), (0.95, 2, 10, 12, 16)),
    ),
    "hand": Volley(
        labels="hand volley standing front",
        span=(-1.3, 1.2),
        hips=((-1.3, 0, 0, 0), (-0.25, -0.02, 0, 0.09), (0.0, 0.03, 0, 0.0), (0.25, 0.03, 0, 0.0), (1.0, 0, 0, 0)),
        pelvis=((-0.5, 0, 2, 0), (-0.2, 0, 4, -6), (0.0, 0, -2, 4), (0.25, 0, 0, 6), (1.0, 0, 0, 0)),
        spine=((-0.5, 0, 4, 0), (-0.2, 0, -6, -8), (0.0, 0, 0, 4), (0.25, 0, 6, 6), (1.0, 0, 2, 0)),
        head=((-0.6, -16, 0), (-0.1, -26, 0), (0.1, -18, 0), (0.5, -8, 0), (1.0, 0, 0)),
        left_arm=(
            (-1.2, 8, 12, 12, 30), (-0.3, 100, 14, 20, 112), (0.0, 118, 16, 16, 62), (0.14, 128, 18, 14, 24),
            (0.6, 70, 14, 14, 40), (1.2, 2, 10, 12, 16),
        ),
        right_arm=(
            (-1.2, 8, 12, 12, 30), (-0.26, 92, 14, 20, 122), (0.0, 124, 14, 18, 50), (0.09, 132, 14, 14, 14),
            (0.6, 70, 14, 14, 40), (1.2, 2, 10, 12, 16),
        ),
        wrist=((-0.5, 8), (-0.15, -40), (0.06, 10), (0.5, 8)),
    ),
    "racquet": Volley(
        labels="stroke right standing front",
        span=(-1.0, 1.2),
        hips=(
            (-1.0, 0, 0, 0), (-0.45, -0.04, -0.05, 0.05), (0.0, 0.04, 0.05, 0.05), (0.3, 0.05, 0.06, 0.03),
            (1.2, 0, 0, 0),
        ),
        pelvis=(
            (-0.9, 0, 2, 0), (-0.45, 0, 4, -34), (-0.12, 0, 4, -16), (0.0, 0, 3, 2), (0.25, 0, 2, 26), (1.2, 0, 0, 0),
        ),
        spine=(
            (-0.9, 0, 5, 0), (-0.45, 0, 8, -38), (-0.12, 2, 8, -24), (0.0, 2, 8, 4), (0.25, 0, 8, 30), (1.2, 0, 2, 0),
        ),
        head=((-0.8, -2, 0), (-0.45, 2, 50), (0.0, 6, 4), (0.25, 2, -36), (1.2, 0, 0)),
        left_arm=(
            (-0.8, 40, 16, 20, 60), (-0.45, 64, 20, 40, 50), (0.0, 34, 36, 24, 64), (0.3, 20, 24, 30, 78),
            (1.2, 2, 10, 12, 16),
        ),
        right_arm=(
            (-0.8, 30, 14, 20, 70), (-0.45, -30, 62, -20, 54), (-0.14, -26, 50, -24, 44), (0.0, 24, 44, 0, 32),
            (0.14, 70, 36, 26, 40), (0.34, 96, 18, 50, 82), (0.7, 50, 14, 30, 60), (1.2, 2, 10, 12, 16),
        ),
    ),
}  # fmt: skip


def build_volley(
    kind: str, skeleton: Skeleton | None = None, fps: float = 30.0, seed: int = 0, *, speed: float = 1.0,
    example: Motion | None = None, crouch: float = 0.0,
) -> Gesture:
    """Build a strike out of standing with the right side, facing +X.

    Args:
        kind: one of VOLLEYS.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the variation of standing.
        speed: playback rate of the strike's rows.
        example: a recording on `skeleton`, for its neutral stance.
        crouch: m of an adult by which the hips are lower before and after, see `idle`.
    Returns:
        The move.
    """
    return build_standing_touch(VOLLEYS[kind], skeleton, fps, seed, speed=speed, example=example, crouch=crouch)


def build_standing_touch(
    recipe: Volley, skeleton: Skeleton | None = None, fps: float = 30.0, seed: int = 0, *, speed: float = 1.0,
    example: Motion | None = None, crouch: float = 0.0,
) -> Gesture:
    """Build a touch of the ball out of standing as a recipe says; see `build_volley` for the other arguments.

    Args:
        recipe: how the body moves.
        skeleton, fps, seed, speed, example, crouch: as for `build_volley`.
    Returns:
        The move.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    gait_plan, posture = build_ready(neutral, BEFORE + AFTER, fps, seed, crouch)
    times = (gait_plan.times - BEFORE) * speed
    begin, end = recipe.span
    ease = compute_envelope(times, begin, 0.6 * begin, 0.55 * end, end)
    posture = _blend_recipe(posture, recipe, times, ease, neutral)
    feet = _build_still_steps(gait_plan, neutral) if crouch == 0.0 else plan_still_feet(neutral, crouch)
    posture = plant_feet(posture, gait_plan.times, feet, neutral)
    if recipe.foot is not None:
        posture = _guide_foot(posture, recipe.foot, times, neutral)
    return Gesture(
        to_motion(posture.frames(gait_plan.requested_slice), neutral), BEFORE, BEFORE + begin / speed, BEFORE + end
        / speed
    )


def _build_still_steps(gait_plan: GaitPlan, neutral: NeutralStance) -> tuple[Footsteps, ...]:
    """Build stances of both feet that stay on the ground."""
    return tuple(build_steps(gait_plan, neutral, side, 0.0, ()) for side in (LEFT, RIGHT))


def _blend_recipe(posture: Posture, recipe: Volley, times, ease, neutral: NeutralStance) -> Posture:
    """Blend a recipe's trunk, head and arms over a posture by `ease` (T,), and move its hips."""
    scale = neutral.leg / tables.LEG
    moved = scale * ease[:, None] * interpolate_rows(recipe.hips, times)
    hips = posture.hips + moved * [1.0, 1.0, -1.0]
    nothing = np.zeros_like(times)
    nod = np.radians(interpolate_rows(recipe.head, times))
    head = posture.head + ease[:, None] * np.stack([nothing, nod[:, 0], nod[:, 1]], axis=-1)
    lean = {
        name: getattr(posture, name) + ease[:, None] * np.radians(interpolate_rows(getattr(recipe, name), times))
        for name in ("pelvis", "spine")
    }
    arms, wrists = posture.arms.copy(), posture.wrists.copy()
    for side, rows in enumerate((recipe.left_arm, recipe.right_arm)):
        arms[:, side, :4] = blend_arrays(arms[:, side, :4], np.radians(interpolate_rows(rows, times)), ease)
    wrists[:, RIGHT] = blend_arrays(wrists[:, RIGHT], np.radians(interpolate_rows(recipe.wrist, times))[:, 0], ease)
    return posture.replace_arrays(hips=hips, head=head, arms=arms, wrists=wrists, **lean)


def _guide_foot(posture: Posture, rows: tuple, times: np.ndarray, neutral: NeutralStance) -> Posture:
    """Guide the right foot from its place through `rows` and back, never through the ground nor beyond the leg's reach.
    """
    from scipy.interpolate import CubicSpline

    scale, table = neutral.leg / tables.LEG, np.array(rows, dtype=float)
    begin, land = table[0, 0] - 0.16, table[-1, 0] + 0.14
    inside = (times > begin) & (times < land)
    edges = [np.flatnonzero(inside)[0] - 1, np.flatnonzero(inside)[-1] + 1]
    rest = np.column_stack([posture.ankles[:, RIGHT], posture.feet[:, RIGHT]])
    middle = posture.hips[edges[0]] * [1.0, 1.0, 0.0]
    guided = np.column_stack([table[:, 1:4] * scale + middle, np.radians(table[:, [6, 4, 5]])])
    through = np.concatenate([rest[edges[:1]], guided, rest[edges[1:]]])
    at = np.concatenate([times[edges[:1]], table[:, 0], times[edges[1:]]])
    path = CubicSpline(at, through, axis=0, bc_type="clamped")(times[inside])
    ankles, feet = posture.ankles.copy(), posture.feet.copy()
    raised = np.sqrt(np.maximum(np.sin(np.pi * (times[inside] - begin) / (land - begin)), 0.0))
    path[:, 2] += raised * compute_ground_lift(path[:, 2], path[:, 4], neutral)
    hip = compute_hip_positions(posture, neutral)[inside, RIGHT]
    from_hip, leg = path[:, :3] - hip, sum(measure_leg(neutral, RIGHT))
    share = ease_reach(np.linalg.norm(from_hip, axis=1), (_LONGEST_REACH - _EASE_SHARE) * leg, _EASE_SHARE * leg)
    ankles[inside, RIGHT] = hip + from_hip * share[:, None]
    feet[inside, RIGHT] = path[:, 3:]
    return posture.replace_arrays(ankles=ankles, feet=feet)
