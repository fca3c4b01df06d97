"""Hips, trunk, head and arms of a gait.

Above a jog they take a sprinter's form: the line from hips to neck comes up to nearly upright, whatever the posture
that the skeleton stands in, and elbows open as the arm passes the hips.
"""

from __future__ import annotations

import numpy as np

from ..base.easing import quintic_step
from ..motion.humanoid import identify_joints
from ..motion.retargeting.neutral import NeutralStance
from . import gait_tables as tables
from .gait_plan import GaitPlan, GaitStyle, compute_wander
from .gait_tables import compute_run_share, compute_sprint_share, interpolate_figure, interpolate_sprint_figure

# rad by which a sprinter's trunk and elbows keep to the style, at most
_SPRINT_LEAN, _SPRINT_ELBOW = np.radians(2.0), np.radians(6.0)
# share of the step at which a sprinter's trunk leans most, and at which the upper arm's second wave peaks
_NOD_PEAK, _ARM_PEAK = 0.2, 0.29
# size of the elbow's second wave, share of the first, and rad after the first at which it peaks
_ELBOW_SECOND, _ELBOW_PEAK = 0.46, 0.19


def pose_trunk(gait_plan: GaitPlan, neutral: NeutralStance, style: GaitStyle, seed: int) -> dict[str, np.ndarray]:
    """Compute hips, pelvis, spine and head at all N moments.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
        seed: of the variation.
    Returns:
        Arrays of a `Posture` by name.
    """
    adult_speed, phase = gait_plan.adult_speed, gait_plan.phase
    scale = neutral.leg / tables.LEG
    turn = 2.0 * np.pi * phase
    ahead = 1.0 - 0.6 * np.sin(0.5 * gait_plan.direction) ** 2
    idle = style.life * (1.0 - quintic_step(adult_speed / 0.7))
    middle = 0.5 * interpolate_figure("duty", adult_speed)
    sway = scale * interpolate_figure("sway", adult_speed) * np.cos(turn - 2.0 * np.pi
                                                                    * middle) + idle * 0.014 * compute_wander(
        gait_plan.times, seed + 1, 6.0
    )
    surge = _compute_surge(gait_plan, middle)
    across = gait_plan.heading
    hips = np.empty((len(adult_speed), 3))
    hips[:, 0] = gait_plan.path[:, 0] + surge * np.cos(across + gait_plan.direction) - sway * np.sin(across)
    hips[:, 1] = gait_plan.path[:, 1] + surge * np.sin(across + gait_plan.direction) + sway * np.cos(across)
    hips[:, 2] = compute_hip_height(gait_plan, neutral, style)
    lean = _compute_lean(gait_plan)
    wobble = 1.0 + 0.06 * style.life * compute_wander(gait_plan.times, seed + 2, 2.3)
    angle = {
        name: np.radians(interpolate_figure(name, adult_speed)) * ahead * wobble
        for name in ("pelvis_turn", "chest_turn", "list", "tilt", "lean")
    }
    pelvis = np.stack(
        [
            angle["list"] * np.cos(turn - 2.0 * np.pi * 0.2)
            + 0.35 * lean[:, 0]
            + idle * 0.02 * compute_wander(gait_plan.times, seed + 1, 6.0),
            angle["tilt"] + 0.35 * lean[:, 1] + np.radians(1.0) * compute_run_share(adult_speed) * np.cos(2.0 * turn),
            -angle["pelvis_turn"] * np.cos(turn + 2.0 * np.pi * 0.18 * compute_run_share(adult_speed)),
        ],
        axis=-1,
    )
    breath = idle * np.radians(0.9) * np.sin(2.0 * np.pi * 0.24 * gait_plan.times + seed)
    bend = angle["lean"] - angle["tilt"] + style.lean
    bend = bend + tables.compute_upright_share(adult_speed) * (
        _bend_sprinter(adult_speed, angle["tilt"], style, neutral) - bend)
    spine = np.stack(
        [
            -0.85 * (angle["list"] * np.cos(turn - 2.0 * np.pi * 0.2)) + 0.35 * lean[:, 0],
            bend
            + 0.35 * lean[:, 1]
            - breath
            + 0.02 * np.sin(2.0 * turn) * compute_run_share(adult_speed),
            style.twist * angle["chest_turn"] * np.cos(turn) - pelvis[:, 2],
        ],
        axis=-1,
    )
    look = np.stack([0.0 * adult_speed, np.radians(4.0) + style.head + 0.0 * adult_speed, 0.0 * adult_speed], axis=-1)
    turn_rate = np.gradient(gait_plan.heading, gait_plan.times)
    look[:, 2] += idle * np.radians(9.0) * compute_wander(gait_plan.times, seed + 3, 4.0) + 0.12 * np.tanh(turn_rate)
    nod = np.radians(interpolate_sprint_figure("nod", adult_speed)) * compute_sprint_share(adult_speed)
    pelvis[:, 1] += 0.5 * nod * np.cos(2.0 * turn - 2.0 * np.pi * _NOD_PEAK)
    spine[:, 1] += nod * np.cos(2.0 * turn - 2.0 * np.pi * _NOD_PEAK)
    head = -(pelvis + spine) * np.array([0.8, 0.85, 0.95]) + look
    return {"hips": hips, "pelvis": pelvis, "spine": spine, "head": head}


def _bend_sprinter(adult_speed: np.ndarray, tilt: np.ndarray, style: GaitStyle, neutral: NeutralStance) -> np.ndarray:
    """Compute how far (N,) rad a sprinter's spine bends forward, so that the line from hips to neck leans as published.
    """
    leans, slope = _measure_trunk(neutral)
    wanted = np.radians(interpolate_sprint_figure("trunk", adult_speed))
    return (wanted + np.clip(style.lean, -_SPRINT_LEAN, _SPRINT_LEAN) - tilt - leans) / slope


def _measure_trunk(neutral: NeutralStance) -> tuple[float, float]:
    """Measure how far the line from hips to neck leans forward in the neutral stance, rad, and by which share of the
    spine's bend it turns.
    """
    body = identify_joints(neutral.skeleton)
    hips = 0.5 * (neutral.positions[body.left.upper_leg] + neutral.positions[body.right.upper_leg])
    trunk = neutral.positions[body.neck_or_chest] - hips
    heights = neutral.positions[[*body.spine, body.neck_or_chest], 2]
    shares = np.arange(1, len(body.spine) + 1) / max(len(body.spine), 1)
    return float(np.arctan2(trunk[0], trunk[2])), max(float(np.sum(shares * np.diff(heights)) / trunk[2]), 0.3)


def _compute_surge(gait_plan: GaitPlan, middle: np.ndarray) -> np.ndarray:
    """Compute how far (N,) m the hips are ahead of a steady pace: slowest in mid-stance (braking, then pushing)."""
    swing = np.minimum(0.07 * gait_plan.speed, 0.16)
    frequency = np.maximum(np.gradient(gait_plan.phase, gait_plan.times), 0.3)
    return -swing / (4.0 * np.pi * frequency) * np.sin(4.0 * np.pi * (gait_plan.phase - middle))


def _compute_lean(gait_plan: GaitPlan) -> np.ndarray:
    """Compute the extra lean (N, 2) rad of the body into its acceleration: list (about X, right down positive) and tilt
    (about Y).
    """
    cos, sin = np.cos(gait_plan.heading), np.sin(gait_plan.heading)
    forward = gait_plan.acceleration[:, 0] * cos + gait_plan.acceleration[:, 1] * sin
    left = -gait_plan.acceleration[:, 0] * sin + gait_plan.acceleration[:, 1] * cos
    return np.stack([-0.42 * np.tanh(left / 4.5), 0.42 * np.tanh(forward / 5.0)], axis=-1)


def compute_hip_height(gait_plan: GaitPlan, neutral: NeutralStance, style: GaitStyle) -> np.ndarray:
    """Compute the height of the hip joints: in mid-stance by the knee's flexion there, plus the bounce.

    Args:
        gait_plan: the plan.
        neutral: neutral stance of the body.
        style: style of the gait.
    Returns:
        (N,) m.
    """
    adult_speed, phase = gait_plan.adult_speed, gait_plan.phase
    scale = neutral.leg / tables.LEG
    knee = np.radians(interpolate_figure("knee_mid", adult_speed)) + style.crouch
    half = 0.5 * neutral.leg
    chord = 2.0 * half * np.cos(0.5 * knee)
    ahead = interpolate_figure("ahead", adult_speed) * scale
    heel_up = (
        np.maximum(np.sin(tables.interpolate_stance_pitch(np.full_like(adult_speed, 0.5), adult_speed)), 0.0)
        * neutral.ball[0, 0]
        * compute_run_share(adult_speed)
    )
    at_middle = neutral.ankle_height + heel_up + np.sqrt(chord**2 - ahead**2)
    duty = interpolate_figure("duty", adult_speed)
    step_time = 0.5 / np.maximum(np.gradient(phase, gait_plan.times), 0.3)
    share = np.clip(2.0 * duty, 0.4, 1.0)
    run = compute_run_share(adult_speed)
    walking = scale * interpolate_figure("bob", adult_speed)
    bob = (1.0 - run) * walking * np.cos(4.0 * np.pi * (phase - 0.5 * duty))
    bob = bob + run * tables.compute_bounce(2.0 * phase, share, step_time)
    bob_middle = (1.0 - run) * walking + run * tables.compute_bounce(share * 0.5, share, step_time)
    return at_middle + style.bounce * (1.0 - 0.4 * np.sin(0.5 * gait_plan.direction) ** 2) * (bob - bob_middle)


def pose_arms(gait_plan: GaitPlan, style: GaitStyle, seed: int) -> np.ndarray:
    """Compute the arms: each swings forward together with the other side's leg.

    Args:
        gait_plan: the plan.
        style: style of the gait.
        seed: of the variation.
    Returns:
        (N, 2, 5) rad as in `Posture`.
    """
    adult_speed = gait_plan.adult_speed
    run = compute_run_share(adult_speed)
    less = (1.0 - 0.5 * np.sin(0.5 * gait_plan.direction) ** 2) * (1.0 - 0.4 * np.sin(gait_plan.direction) ** 2)
    figures = {
        n: np.radians(interpolate_figure(n, adult_speed))
        for n in ("arm_swing", "arm_middle", "elbow", "elbow_swing", "abduct", "inward")
    }
    idle = style.life * (1.0 - quintic_step(adult_speed / 0.7))
    sprint = compute_sprint_share(adult_speed)
    second = sprint * np.radians(interpolate_sprint_figure("arm_second", adult_speed)) * less * np.cos(
        4.0 * np.pi * gait_plan.phase - 2.0 * np.pi * _ARM_PEAK)
    sides = []
    for side, shift in ((0, 0.5), (1, 0.0)):
        uneven = 1.0 + style.life * (0.08 * compute_wander(gait_plan.times, seed + 5 + side, 2.6) + (0.04, -0.04)[side])
        turn = 2.0 * np.pi * (gait_plan.phase - shift - 0.02 + 0.17 * run)
        wave = np.cos(turn) * uneven * less * style.arm_swing
        elbow = figures["elbow"] + style.elbow + figures["elbow_swing"] * np.cos(turn - 0.3) * uneven * less
        elbow = elbow + sprint * (_bend_sprinting_elbow(gait_plan, turn, uneven * less, style) - elbow)
        slow = idle * np.radians(2.0) * compute_wander(gait_plan.times, seed + 7 + side, 5.0)
        sides.append(
            np.stack(
                [
                    figures["arm_middle"] + figures["arm_swing"] * wave + second + slow,
                    figures["abduct"] + style.abduct - np.radians(3.0) * run * wave + 0.5 * slow,
                    figures["inward"] + np.radians(9.0) * run * wave,
                    elbow,
                    np.radians(18.0) * np.ones_like(adult_speed),
                ],
                axis=-1,
            )
        )
    return np.stack(sides, axis=1)


def _bend_sprinting_elbow(gait_plan: GaitPlan, turn: np.ndarray, size: np.ndarray, style: GaitStyle) -> np.ndarray:
    """Compute the flexion (N,) rad of a sprinter's elbow: most as the hand comes up in front, least as it passes the
    hips backward.

    Arms of another style swing around their own middle, as far as the elbow's range lets them.
    """
    middle, swing = (np.radians(interpolate_sprint_figure(name, gait_plan.adult_speed))
                     for name in ("elbow", "elbow_swing"))
    middle = middle + np.clip(style.elbow, -_SPRINT_ELBOW, _SPRINT_ELBOW)
    wave = _shape_elbow_wave(turn)
    least, most = np.radians(tables.ELBOW_RANGE)
    lowest, highest = _ELBOW_EXTREMES
    room = np.minimum((most - middle) / (highest * swing), (least - middle) / (lowest * swing))
    return middle + swing * wave * np.minimum(size, room)


def _shape_elbow_wave(turn: np.ndarray) -> np.ndarray:
    """Compute how an elbow bends, (...,) about its middle, at `turn` (...,) rad from where its arm is in front."""
    return np.cos(turn) + _ELBOW_SECOND * np.cos(2.0 * (turn - _ELBOW_PEAK))


_WHOLE_WAVE = _shape_elbow_wave(np.linspace(0.0, 2.0 * np.pi, 721))
_ELBOW_EXTREMES = float(_WHOLE_WAVE.min()), float(_WHOLE_WAVE.max())
