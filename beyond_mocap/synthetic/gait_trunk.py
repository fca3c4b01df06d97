"""What a walker does above the legs: the pelvis that bobs, sways and turns, the spine against it, head and arms.

All from a `Course` and the published figures of `gait_tables`.
"""

from __future__ import annotations

import numpy as np

from ..base.easing import quintic_step
from ..motion.retargeting.neutral import Neutral
from . import gait_tables as tables
from .course import Course, GaitStyle, wander
from .gait_tables import at_speed, run_share


def trunk(course: Course, neutral: Neutral, style: GaitStyle, seed: int) -> dict[str, np.ndarray]:
    """Hips, pelvis, spine and head at all moments (arrays of `Posture`)."""
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
    look[:, 2] += idle * np.radians(9.0) * wander(course.times, seed + 3, 4.0) + 0.12 * np.tanh(_turning(course))
    head = -(pelvis + spine) * np.array([0.8, 0.85, 0.95]) + look
    return {"hips": hips, "pelvis": pelvis, "spine": spine, "head": head}


def _turning(course: Course) -> np.ndarray:
    """Turn rate of the heading (N,), radians per second."""
    return np.gradient(course.heading, course.times)


def _surge(course: Course, middle: np.ndarray) -> np.ndarray:
    """How far (N,) metres the hips run ahead of a steady pace: slowest over the middle of stance (braking, then
    pushing).
    """
    swing = np.minimum(0.07 * course.speed, 0.16)
    frequency = np.maximum(np.gradient(course.phase, course.times), 0.3)
    return -swing / (4.0 * np.pi * frequency) * np.sin(4.0 * np.pi * (course.phase - middle))


def _leaning(course: Course) -> np.ndarray:
    """Extra lean (N, 2) of the body into its acceleration: list (right down positive... about X) and tilt (about Y),
    radians.
    """
    cos, sin = np.cos(course.heading), np.sin(course.heading)
    forward = course.acceleration[:, 0] * cos + course.acceleration[:, 1] * sin
    left = -course.acceleration[:, 0] * sin + course.acceleration[:, 1] * cos
    return np.stack([-0.42 * np.tanh(left / 4.5), 0.42 * np.tanh(forward / 5.0)], axis=-1)


def hip_height(course: Course, neutral: Neutral, style: GaitStyle) -> np.ndarray:
    """Height (N,) metres of the hip joints: over the middle of stance as the knee's flexion there says, and the
    bounce."""
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


def arms(course: Course, style: GaitStyle, seed: int) -> np.ndarray:
    """Arms (N, 2, 5) as in `Posture`: each forward together with the other side's leg."""
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
