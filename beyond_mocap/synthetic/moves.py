"""Synthetic moves out of standing: a header, a throw-in, getting up; and a celebration while running.

Key poses over seconds from the key moment are blended over standing (the celebration: over running).
"""

from __future__ import annotations

import numpy as np

from ..base.easing import quintic_step
from ..motion.motion import Motion
from ..motion.retargeting.adult import build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import to_motion
from ..motion.skeleton import Skeleton
from ..motion.supports import GRAVITY
from . import gait_tables as tables
from .footsteps import Footsteps
from .gait import build_posture, plan_footsteps
from .gait_legs import plant_feet
from .gait_plan import GaitPlan, GaitStyle, plan_gait
from .gestures import LEFT, RIGHT, Gesture, blend_arrays, compute_envelope, interpolate_rows

# rows: seconds from the touch, then (hips up, ahead), (list, tilt, turn), spine, arms (flexion, abduction, inward,
# elbow)
_HEADER = {
    "trunk": (  # tilt of the pelvis, flexion of the spine, nod of the head
        (-1.1, 0, 2, 2),
        (-0.62, 14, 20, -22),
        (-0.30, 2, 2, -4),
        (-0.10, -8, -18, -10),
        (0.0, -2, 4, 6),
        (0.12, 8, 22, 4),
        (0.30, 10, 14, -6),
        (0.46, 18, 18, -14),
        (0.8, 6, 8, -2),
        (1.4, 0, 2, 2),
    ),
    "arms": (
        (-1.1, 2, 10, 12, 16), (-0.60, -48, 18, 5, 30), (-0.28, 78, 34, 20, 70), (-0.08, 55, 52, 30, 80),
        (0.0, 25, 50, 30, 85), (0.14, -2, 46, 20, 75), (0.34, 12, 44, 15, 50), (0.8, 6, 20, 12, 28),
        (1.4, 2, 10, 12, 16),
    ),
    "crouch": ((-1.1, 0), (-0.92, 0.01), (-0.58, 0.27), (-0.48, 0.25)),
    "absorb": ((0.42, 0.20), (0.56, 0.22), (1.0, 0.04), (1.5, 0)),
    "legs": ((-0.24, 0.0), (-0.06, 0.16), (0.08, 0.10), (0.24, 0.0)),
}
_FLIGHT = 0.25  # s, half the flight of an adult's jump
_ROLL_SECONDS = (0.2, 0.2)  # s in which the feet roll up before and down after a flight of a given height
# m of an adult that the hips are higher on the toes: legs stretched, and nearly so, which spares the knees a snap
_TOES, _SOFT_TOES = 0.085, 0.04


def build_header(
    skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0, example: Motion | None = None,
    rise: float | None = None,
) -> Gesture:
    """Build a jump from both feet out of standing: the trunk arches, strikes the ball at the top, and the body lands.

    Args:
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the variation of standing.
        example: a recording on `skeleton`, for its neutral stance.
        rise: m of the hips from standing to the top of the flight; None: what half a second in the air gives.
    Returns:
        The move; its key is the touch.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    scale = neutral.leg / tables.LEG
    key = 1.5
    gait_plan, steps, posture = build_standing(neutral, key + 1.9, fps, seed, width=0.10)
    times = gait_plan.times - key
    air, longer = float(_FLIGHT * np.sqrt(scale)), 0.0
    if rise is not None:
        air = float(np.sqrt(2.0 * max(rise - _SOFT_TOES * scale, 0.02) / GRAVITY))
        longer = air - _FLIGHT
    table_times = _adapt_times(times, air, longer)
    trunk, arms = (np.radians(interpolate_rows(_HEADER[name], table_times)) for name in ("trunk", "arms"))
    ease = compute_envelope(table_times, -1.1, -0.8, 0.9, 1.4)
    roll = (0.14, 0.12) if rise is None else _ROLL_SECONDS
    pitch = np.radians(62) * compute_envelope(times, -air - roll[0], -air, air, air + roll[1])
    hips, ankles, feet, toes = posture.hips.copy(), posture.ankles.copy(), posture.feet.copy(), posture.toes.copy()
    path, tuck = _compute_jump(times, air, hips[:, 2], neutral=neutral, longer=longer, table_times=table_times)
    hips[:, 2] = path
    for side in (LEFT, RIGHT):
        ankles[:, side], feet[:, side, 1], toes[:, side] = _compute_jumping_foot(
            ankles[:, side], feet[:, side, 2], times, air=air, rise=path, pitch=pitch, tuck=tuck * scale,
            neutral=neutral,
        )
    pelvis = posture.pelvis + np.stack([0 * times, trunk[:, 0], 0 * times], -1) * ease[:, None]
    spine = posture.spine + np.stack([0 * times, trunk[:, 1], 0 * times], -1) * ease[:, None]
    head = posture.head + np.stack([0 * times, trunk[:, 2], 0 * times], -1) * ease[:, None]
    arm_angles = posture.arms.copy()
    for side in (LEFT, RIGHT):
        arm_angles[:, side, :4] = blend_arrays(arm_angles[:, side, :4], arms, ease)
    posture = posture.replace_arrays(
        hips=hips, ankles=ankles, feet=feet, toes=toes, pelvis=pelvis, spine=spine, head=head, arms=arm_angles
    )
    return Gesture(to_motion(posture.frames(gait_plan.requested_slice), neutral), key, key - 0.9, key + 0.9)


def _adapt_times(times: np.ndarray, air: float, longer: float) -> np.ndarray:
    """Adapt seconds (N,) of tables to a flight whose half is `longer` s longer: `air`."""
    outside = times - np.sign(times) * longer
    return times if longer == 0.0 else np.where(np.abs(times) > air, outside, times * (_FLIGHT / air))


def _compute_jump(times, air: float, standing: np.ndarray, *, neutral: NeutralStance, longer: float,
                  table_times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the height of the hips (N,) m, free fall in the air, and how far (N,) the ankles are drawn up and back
    there; `longer`: s that the tables' rows on the ground are further from the contact.
    """
    from scipy.interpolate import CubicSpline

    scale = neutral.leg / tables.LEG
    take_off = np.mean(standing) + (_TOES if longer == 0.0 else _SOFT_TOES) * scale
    speed = GRAVITY * air
    flight = take_off + speed * (times + air) - 0.5 * GRAVITY * (times + air) ** 2
    crouch, absorb = (np.array(_HEADER[name]) + [shift, 0.0] for name, shift in (("crouch", -longer),
                                                                                  ("absorb", longer)))
    base = float(np.mean(standing))
    before = CubicSpline(
        np.r_[crouch[:, 0], -air], np.r_[base - scale * crouch[:, 1], take_off], bc_type=((1, 0.0), (1, speed))
    )
    after = CubicSpline(
        np.r_[air, absorb[:, 0]], np.r_[take_off, base - scale * absorb[:, 1]], bc_type=((1, -speed), (1, 0.0))
    )
    rise = np.where(np.abs(times) <= air, flight, np.where(times < 0, before(times), after(times)))
    rise = np.where((times < crouch[0, 0]) | (times > absorb[-1, 0]), standing, rise)
    return rise, interpolate_rows(_HEADER["legs"], table_times)[:, 0] * (np.abs(times) < air)


def _compute_jumping_foot(ankle, yaw, times, air, rise, pitch, tuck, neutral: NeutralStance):
    """Compute ankle (N, 3), pitch (N,) and toe bend (N,) of a foot that rolls up on its ball, hangs in the air and
    lands.
    """
    ball_ahead, drop = neutral.ball[0, 0], -neutral.ball[0, 2]
    ahead = ball_ahead - ball_ahead * np.cos(pitch) + drop * np.sin(pitch)
    up = neutral.ankle_height - drop + ball_ahead * np.sin(pitch) + drop * np.cos(pitch)
    out = ankle.copy()
    flying = np.abs(times) < air
    take_off = rise[np.argmin(np.abs(times + air))]
    up = up + np.where(flying, rise - take_off + 0.45 * tuck, 0.0)
    along = ahead - tuck
    out[:, 0] += along * np.cos(yaw)
    out[:, 1] += along * np.sin(yaw)
    out[:, 2] = up
    return out, pitch, np.where(flying, 0.3, 1.0) * pitch


def build_standing(neutral: NeutralStance, duration: float, fps: float, seed: int, width: float = 0.0):
    """Build standing.

    Args:
        neutral: neutral stance of the body.
        duration: s.
        fps: frames per second.
        seed: of the variation.
        width: m added between the feet.
    Returns:
        gait_plan: the plan.
        steps: stances of both feet.
        posture: the posture.
    """
    style = GaitStyle(width=width, life=0.6)
    gait_plan = plan_gait(0.0, duration, fps, neutral, style=style, seed=seed)
    steps = tuple(plan_footsteps(gait_plan, neutral, style, side) for side in (LEFT, RIGHT))
    return gait_plan, steps, build_posture(gait_plan, steps, neutral, style, seed)


_THROW = {
    "trunk": (  # tilt of the pelvis, flexion of the spine, nod
        (-1.9, 0, 2, 4),
        (-1.2, 2, 4, 8),
        (-0.42, -10, -22, 12),
        (-0.22, -8, -26, 14),
        (0.0, 8, 12, -6),
        (0.22, 18, 32, -24),
        (0.6, 10, 18, -12),
        (1.3, 0, 2, 4),
    ),
    "arms": (  # flexion, abduction, inward, elbow, palm
        (-1.9, 28, 2, 18, 72, 20),
        (-1.2, 60, 2, 18, 80, 20),
        (-0.42, 168, 2, 14, 118, 10),
        (-0.22, 172, 2, 14, 112, 10),
        (0.0, 150, 2, 18, 32, 10),
        (0.2, 84, 2, 18, 14, 15),
        (0.6, 36, 6, 18, 22, 18),
        (1.3, 2, 9, 12, 16, 18),
    ),
    "hips": (
        (-1.9, 0.0, 0.0), (-0.9, -0.06, 0.02), (-0.42, 0.02, 0.05), (0.0, 0.34, 0.05), (0.3, 0.46, 0.04),
        (1.2, 0.46, 0.0),
    ),
}


def build_throw_in(
    skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0, example: Motion | None = None
) -> Gesture:
    """Build a throw-in: the ball in both hands behind the head, the left foot steps ahead, the trunk whips.

    Args:
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the variation of standing.
        example: a recording on `skeleton`, for its neutral stance.
    Returns:
        The move; its key is the release.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    scale = neutral.leg / tables.LEG
    key = 2.2
    gait_plan, _, posture = build_standing(neutral, key + 2.0, fps, seed)
    times = gait_plan.times - key
    moved = interpolate_rows(_THROW["hips"], times) * scale
    hips = posture.hips.copy()
    hips[:, 0] += moved[:, 0]
    hips[:, 2] -= moved[:, 1]
    steps = (
        build_steps(gait_plan, neutral, LEFT, key, ((-0.72, -0.36, 0.52),)),
        build_steps(gait_plan, neutral, RIGHT, key, ((0.16, 0.62, 0.46),)),
    )
    trunk, arms = np.radians(interpolate_rows(_THROW["trunk"], times)), np.radians(interpolate_rows(_THROW["arms"],
            times))
    ease = compute_envelope(times, -2.2, -1.6, 0.8, 1.5)
    nothing = np.zeros_like(times)
    lean = {
        name: getattr(posture, name) + ease[:, None] * np.stack([nothing, trunk[:, column], nothing], -1)
        for column, name in enumerate(("pelvis", "spine", "head"))
    }
    arm_angles = posture.arms.copy()
    for side in (LEFT, RIGHT):
        arm_angles[:, side] = blend_arrays(arm_angles[:, side], arms, ease)
    posture = plant_feet(posture.replace_arrays(hips=hips, arms=arm_angles, **lean), gait_plan.times, steps, neutral)
    return Gesture(to_motion(posture.frames(gait_plan.requested_slice), neutral), key, key - 1.3, key + 0.8)


def build_steps(gait_plan: GaitPlan, neutral: NeutralStance, side: int, key: float, moves) -> Footsteps:
    """Build the stances of one foot that stays in place except for some steps.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        side: 0 left, 1 right.
        key: s of the key moment.
        moves: rows (leaves, lands, metres ahead), seconds from the key.
    Returns:
        The stances.
    """
    scale = neutral.leg / tables.LEG
    sign = 1.0 if side == LEFT else -1.0
    left = sign * 0.5 * tables.interpolate_figure("width", 0.0) * scale
    behind = tables.interpolate_figure("ahead", 0.0) * scale
    places = [behind] + [behind + scale * ahead for *_, ahead in moves]
    on = np.array([gait_plan.times[0] - 1.0] + [key + land for _, land, _ in moves] + [gait_plan.times[-1] + 2.0])
    off = np.array([key + leave for leave, *_ in moves] + [gait_plan.times[-1] + 1.0, gait_plan.times[-1] + 3.0])
    places = np.array(places + places[-1:])
    count = len(on)
    yaw = np.full(count, sign * np.radians(tables.interpolate_figure("toe_out", 0.3)))
    return Footsteps(side=side, on=on, off=off, place=np.stack([places, np.full(count, left)], -1), yaw=yaw,
                     speed=np.full(count, 1.2), direction=np.zeros(count))


# seconds from the beginning; hips ahead, height; tilt of pelvis, spine, head; ankles ahead (left, right), height; foot
# pitch
_UP = {
    "hips": (
        (0, 0.0, 0.125), (0.7, 0.0, 0.125), (1.25, 0.02, 0.125), (1.75, 0.18, 0.22), (2.15, 0.42, 0.44),
        (2.7, 0.52, 0.72), (3.3, 0.56, 0.90), (3.9, 0.57, 0.93),
    ),
    "tilt": (
        (0, -88, -4, 6), (0.55, -84, 16, 20), (1.25, -34, 38, 10), (1.75, 12, 44, -16), (2.15, 40, 40, -34),
        (2.7, 38, 28, -30), (3.3, 10, 10, -8), (3.9, 0, 2, 4),
    ),
    "left": (
        (0, 0.80, 0.075, -55), (0.5, 0.80, 0.075, -50), (1.1, 0.54, 0.074, -4), (1.4, 0.52, 0.0732, 0),
        (3.9, 0.52, 0.0732, 0),
    ),
    "right": (
        (0, 0.82, 0.075, -60), (0.6, 0.80, 0.075, -55), (1.25, 0.46, 0.078, 0), (1.6, 0.44, 0.0732, 0),
        (2.6, 0.44, 0.0732, 6), (2.85, 0.50, 0.12, 18), (3.15, 0.54, 0.0732, 0), (3.9, 0.54, 0.0732, 0),
    ),
    "wrists": ((0, 8), (0.75, 0), (1.0, -66), (1.25, -72), (1.6, -15), (1.85, -25), (2.05, -55), (2.35, -10), (2.8, 8)),
    "left_arm": (
        (0, 2, 26, 0, 12), (0.7, -6, 30, -8, 32), (1.25, -38, 22, -10, 24), (1.75, 8, 24, 10, 40), (2.2, 62, 8, 20, 20),
        (2.7, 48, 6, 20, 16), (3.3, 12, 10, 14, 22), (3.9, 2, 9, 12, 15),
    ),
    "right_arm": (
        (0, 4, 26, 0, 14), (0.7, -4, 30, -8, 30), (1.25, -36, 24, -10, 20), (1.6, -34, 24, -5, 12),
        (1.95, 16, 24, 5, 24), (2.3, 50, 12, 15, 24), (2.7, 42, 8, 18, 22), (3.3, 10, 10, 14, 20), (3.9, 1, 9, 12, 15),
    ),
}
_UP_TIME = 3.9


def build_get_up(
    skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0, rest: float = 0.8, example: Motion | None = None
) -> Gesture:
    """Build getting up from lying on the back: sitting up on the hands, feet drawn in, through the crouch.

    Args:
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the variation of standing.
        rest: s of lying before.
        example: a recording on `skeleton`, for its neutral stance.
    Returns:
        The move; its key is halfway.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    scale = neutral.leg / tables.LEG
    duration = rest + _UP_TIME + 0.9
    gait_plan, _, posture = build_standing(neutral, duration, fps, seed)
    times = gait_plan.times - rest
    trunk = np.radians(interpolate_rows(_UP["tilt"], times))
    hip_path = interpolate_rows(_UP["hips"], times) * scale
    on_feet = quintic_step((times - 3.2) / 0.7)
    nothing = np.zeros_like(times)
    hips = np.stack([hip_path[:, 0], posture.hips[:, 1] * on_feet, hip_path[:, 1]], -1)
    hips[:, 2] = blend_arrays(hips[:, 2], posture.hips[:, 2], on_feet)
    arms, ankles, feet = posture.arms.copy(), posture.ankles.copy(), posture.feet.copy()
    for side, name in ((LEFT, "left"), (RIGHT, "right")):
        arms[:, side, :4] = np.radians(interpolate_rows(_UP[name + "_arm"], times))
        foot = interpolate_rows(_UP[name], times)
        ankles[:, side, 0] = foot[:, 0] * scale
        ankles[:, side, 1] = (0.13, -0.13)[side] * scale
        ankles[:, side, 2] = foot[:, 1] * neutral.ankle_height / 0.0732
        feet[:, side] = np.stack([nothing, np.radians(foot[:, 2]), nothing + np.radians((14, -14)[side])], -1)
    posture = posture.replace_arrays(
        hips=hips, pelvis=np.stack([nothing, trunk[:, 0], nothing], -1), spine=np.stack([nothing, trunk[:, 1], nothing],
                                                                                        -1),
        head=np.stack([nothing, trunk[:, 2], nothing], -1), arms=arms,
        wrists=np.radians(np.repeat(interpolate_rows(_UP["wrists"], times), 2, axis=1)), ankles=ankles, feet=feet,
        toes=np.zeros_like(posture.toes),
    )
    return Gesture(to_motion(posture.frames(gait_plan.requested_slice), neutral), rest + 1.9, rest + 0.3,
                   rest + _UP_TIME)


def build_celebration(duration: float = 6.0, skeleton: Skeleton | None = None, fps: float = 30.0,
                      seed: int = 0) -> Motion:
    """Build a run in a curve with both arms spread like wings, leaning into it.

    Args:
        duration: s.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the gait's variation.
    Returns:
        The motion.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton())
    times = np.arange(int(round(duration * fps)) + 1) / fps
    turn = 0.55 * np.sin(2.0 * np.pi * times / duration)
    gait_plan = plan_gait(3.4 + 0.0 * times, None, fps, neutral, turn_rate=turn, seed=seed)
    steps = tuple(plan_footsteps(gait_plan, neutral, GaitStyle(), side) for side in (LEFT, RIGHT))
    posture = build_posture(gait_plan, steps, neutral, GaitStyle(head=np.radians(-8)), seed)
    bank = np.interp(gait_plan.times, times, turn)
    flap = np.radians(5.0) * np.sin(2.0 * np.pi * 2.0 * gait_plan.phase)
    arms = posture.arms.copy()
    for side, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
        arms[:, side] = np.stack(
            [
                np.radians(8.0) + 0.15 * posture.arms[:, side, 0], np.radians(84.0) - sign * 0.5 * bank + flap,
                np.radians(-5.0) + 0.0 * bank, np.radians(14.0) + 0.0 * bank, np.radians(70.0) + 0.0 * bank,
            ],
            axis=-1,
        )
    posture = posture.replace_arrays(arms=arms)
    return to_motion(posture.frames(gait_plan.requested_slice), neutral)
