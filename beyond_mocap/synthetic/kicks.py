"""Synthetic kicks: three steps to a ball on the ground, the other foot planted beside it, and a leg that whips through
it.

Instants, angles and rates of the instep kick follow Lees and Nolan 1998 (J. Sports Sci. 16, 211-234), Nunome, Asai,
Ikegami and Sakurai 2002 (Med. Sci. Sports Exerc. 34, 2028-2036) and Kellis and Katis 2007 (J. Sports Sci. Med. 6,
154-165): an approach of 3 m/s at about 35 degrees, the foot planted beside the ball 0.11 s before the contact, the
pelvis turned back by 30 degrees and then through, a knee bent by 105 degrees that extends at 1500 degrees per second,
the trunk inclined to the support leg. This module has the body alone, not the ball that leaves its foot.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.easing import quintic_step
from ..motion import quaternion
from ..motion.humanoid import identify_joints
from ..motion.mirror import mirror
from ..motion.motion import Motion, compute_pose, place_motion, sample_frames
from ..motion.retargeting.neutral import NeutralStance
from ..motion.retargeting.posture import Posture, compute_hip_positions, to_motion
from . import gait_tables as tables
from .footsteps import lift_foot
from .gestures import RIGHT, build_plan_parts

BEFORE, AFTER = 1.5, 1.3
"""Seconds of a hard kick before and after the contact; slower ones take longer."""
_PLAN_RATE = 480.0  # Hz at which a kick is planned
_CONTACT_SECONDS = 0.05  # s around the contact that are enough to compute it
_ROUNDING_SECONDS = 0.008  # s over which corners of the tables are rounded
_LIFT_SECONDS = 0.07  # s, standard deviation of the time in which the foot is guided higher or lower around the contact
_TOE_BEND = 0.35  # rad by which the toes are bent up at the contact
_SWING_START, _SWING_END = (-0.29, -0.19), (0.26, 0.50)  # s from contact: the leg leaves the ground, and returns to it


@dataclass(frozen=True, kw_only=True)
class KickStyle:
    """How a right foot kicks along +X; seconds from the contact, degrees, metres of an adult.

    Attributes:
        approach: degrees that the run-up is turned toward the kicking leg.
        strides: lengths of the three steps.
        leg: rows (time, thigh forward, knee bent).
        plane: rows (time, turn of the plane in which the leg swings, abduction).
        foot: rows (time, bent down at the ankle, toes turned out).
        pelvis: rows (time, list, tilt, turn) as in a `Posture`.
        spine: rows (time, list, tilt, turn) as in a `Posture`.
        left_arm: rows (time, brought forward, abduction, inward turn, elbow).
        right_arm: rows (time, brought forward, abduction, inward turn, elbow).
        hips: rows (time, ahead of their place at the contact, left of it, lowered), from the planting on.
    """

    approach: float
    strides: tuple[float, ...]
    leg: tuple
    plane: tuple
    foot: tuple
    pelvis: tuple
    spine: tuple
    left_arm: tuple
    right_arm: tuple
    hips: tuple


_INSTEP = KickStyle(
    approach=35.0,
    strides=(0.70, 1.00, 1.30),
    leg=(
        (-0.32, -14, 18), (-0.26, -22, 30), (-0.20, -34, 62), (-0.145, -34, 96), (-0.105, -21, 110), (-0.065, 4, 106),
        (-0.03, 23, 83), (0.0, 33, 44), (0.025, 40, 9), (0.07, 53, 5), (0.15, 72, 14), (0.24, 70, 36), (0.38, 44, 48),
        (0.5, 18, 26),
    ),
    plane=((-0.3, -30, 4), (-0.16, -30, 20), (-0.06, -18, 18), (0.0, -8, 9), (0.08, 2, 0), (0.18, 10, -8), (0.5, 0, 2)),
    foot=((-0.3, 5, 4), (-0.18, 28, 10), (-0.05, 40, 20), (0.05, 40, 18), (0.2, 26, 8), (0.42, 4, 4), (0.5, 0, 4)),
    pelvis=(
        (-1.5, 0, 2, -35), (-0.95, 2, 5, -32), (-0.72, -2, 6, -40), (-0.5, -2, 6, -34), (-0.26, 1, 4, -50),
        (-0.14, 4, 6, -62), (-0.06, -2, -2, -38), (0.0, -8, -10, -8), (0.1, -9, -16, 14), (0.2, -6, -12, 22),
        (0.45, 0, 2, 10), (0.8, 0, 4, 0), (1.3, 0, 2, 0),
    ),
    spine=(
        (-1.5, 0, 4, 0), (-0.95, 0, 6, -6), (-0.6, 0, 7, 8), (-0.3, -3, 2, 26), (-0.14, -8, -4, 42),
        (-0.05, -14, 4, 26),
        (0.0, -15, 12, 4), (0.12, -9, 22, -22), (0.25, -5, 20, -24), (0.5, 0, 10, -10), (1.3, 0, 3, 0),
    ),
    left_arm=(
        (-1.5, 2, 10, 12, 18), (-1.0, -18, 14, 12, 30), (-0.65, 26, 18, 18, 45), (-0.4, 0, 50, 8, 32),
        (-0.16, -30, 84, 0, 18), (-0.03, 16, 72, 14, 26), (0.12, 50, 40, 32, 42), (0.3, 44, 28, 30, 46),
        (0.7, 12, 20, 16, 34), (1.3, 2, 10, 12, 18),
    ),
    right_arm=(
        (-1.5, 2, 10, 12, 18), (-1.0, 22, 12, 16, 45), (-0.65, -22, 18, 10, 38), (-0.35, 14, 26, 16, 46),
        (-0.16, 34, 30, 20, 46), (0.0, -20, 44, 8, 32), (0.14, -40, 42, 0, 24), (0.35, -24, 32, 8, 28),
        (0.7, -4, 20, 12, 28), (1.3, 2, 10, 12, 18),
    ),
    hips=(
        (-0.11, -0.19, 0.15, 0.11), (0.0, 0.0, 0.0, 0.09), (0.1, 0.18, -0.05, 0.055), (0.25, 0.42, -0.08, 0.05),
        (0.5, 0.74, -0.12, 0.07), (0.85, 0.98, -0.12, 0.04), (1.3, 1.02, -0.12, 0.02),
    ),
)  # fmt: skip
_INSIDE = KickStyle(
    approach=22.0,
    strides=(0.60, 0.85, 1.05),
    leg=(
        (-0.32, -12, 16), (-0.26, -20, 26), (-0.20, -26, 48), (-0.145, -26, 70), (-0.105, -17, 79), (-0.065, -1, 77),
        (-0.03, 13, 62), (0.0, 23, 37), (0.03, 31, 17), (0.08, 40, 10), (0.16, 46, 14), (0.26, 40, 26), (0.38, 26, 34),
        (0.5, 14, 22),
    ),
    plane=((-0.3, -20, 4), (-0.16, -20, 18), (-0.06, -14, 17), (0.0, -8, 12), (0.08, 0, 8), (0.18, 4, 2), (0.5, 0, 2)),
    foot=((-0.3, 5, 6), (-0.18, 0, 40), (-0.06, -24, 72), (0.04, -24, 76), (0.16, -8, 60), (0.42, 0, 8), (0.5, 0, 4)),
    pelvis=(
        (-1.5, 0, 2, -22), (-0.95, 2, 4, -20), (-0.72, -2, 5, -26), (-0.5, -2, 5, -20), (-0.26, 1, 3, -32),
        (-0.14, 3, 4, -40), (-0.06, 0, 0, -30), (0.0, -4, -5, -16), (0.1, -5, -8, -4), (0.2, -4, -6, 4),
        (0.45, 0, 2, 2), (0.8, 0, 3, 0), (1.3, 0, 2, 0),
    ),
    spine=(
        (-1.5, 0, 4, 0), (-0.95, 0, 6, -4), (-0.6, 0, 7, 6), (-0.3, -2, 4, 16), (-0.14, -5, 2, 28), (-0.05, -8, 6, 22),
        (0.0, -9, 10, 10), (0.12, -6, 14, -6), (0.25, -3, 12, -8), (0.5, 0, 8, -4), (1.3, 0, 3, 0),
    ),
    left_arm=(
        (-1.5, 2, 10, 12, 18), (-1.0, -14, 14, 12, 28), (-0.65, 20, 18, 18, 42), (-0.4, 0, 40, 8, 34),
        (-0.16, -18, 62, 2, 26), (-0.03, 10, 56, 12, 30), (0.12, 32, 36, 24, 40), (0.3, 28, 26, 24, 42),
        (0.7, 8, 18, 14, 30), (1.3, 2, 10, 12, 18),
    ),
    right_arm=(
        (-1.5, 2, 10, 12, 18), (-1.0, 18, 12, 16, 42), (-0.65, -18, 18, 10, 36), (-0.35, 12, 24, 16, 42),
        (-0.16, 24, 26, 18, 42), (0.0, -10, 36, 10, 32), (0.14, -22, 34, 6, 28), (0.35, -12, 26, 10, 28),
        (0.7, 0, 18, 12, 26), (1.3, 2, 10, 12, 18),
    ),
    hips=(
        (-0.11, -0.17, 0.10, 0.10), (0.0, 0.0, 0.0, 0.09), (0.1, 0.15, -0.04, 0.07), (0.25, 0.34, -0.07, 0.06),
        (0.5, 0.60, -0.10, 0.06), (0.85, 0.80, -0.10, 0.04), (1.3, 0.84, -0.10, 0.02),
    ),
)  # fmt: skip
KICKS = {"instep": _INSTEP, "inside": _INSIDE}
_HIPS_AT_CONTACT = np.array([-0.22, 0.18])  # m from the kicking ankle at the contact
_SUPPORT_FOOT = np.array([-0.05, 0.30])  # m, the support foot's ankle
_FOOT_DISTANCE = 0.19  # m between the lines of the left and the right foot
_STEPS = ((-1.30, -0.90), (-1.02, -0.47), (-0.55, -0.11))  # s, off the ground and down again: left, right, left


def build_kick(
    style: KickStyle, neutral: NeutralStance, foot: str = "right", lift: float = 0.0, loft: float = 0.0,
    rate: float = 1.0, turn: float = 0.0, fps: float = 120.0,
) -> Motion:
    """Build a kick along +X, or turned about the vertical.

    Args:
        style: style of the kick.
        neutral: neutral stance of the body.
        foot: "left" or "right".
        lift: metres of an adult by which the foot is guided higher at the contact than in the style.
        loft: degrees by which its toes point less down there.
        rate: playback rate; the contact is at BEFORE / rate seconds.
        turn: rad.
        fps: frames per second.
    Returns:
        The motion.
    """
    times = np.arange(int(round((AFTER + BEFORE) * _PLAN_RATE)) + 1) / _PLAN_RATE - BEFORE
    posture, curve = _build_base_posture(style, neutral, times)
    plan = to_motion(_swing_leg(posture, style, times, neutral=neutral, curve=curve, lift=lift, loft=loft), neutral)
    plan = mirror(plan) if foot == "left" else plan
    seconds = np.arange(int(np.floor((len(plan) - 1) / _PLAN_RATE / rate * fps + 1e-6)) + 1) / fps
    root, rotations = sample_frames(plan, seconds * rate * _PLAN_RATE)
    return place_motion(Motion(plan.skeleton, root, rotations, fps), turn)


def compute_contacts(
    style: KickStyle, neutral: NeutralStance, foot: str, variants: Sequence[tuple[float, float]] | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Compute ankle and toe joint at the contact of `build_kick`, in N variants.

    Args:
        style: style of the kick.
        neutral: neutral stance of the body.
        foot: "left" or "right".
        variants: (N, 2) lift and loft of each variant.
    Returns:
        places: (N, 2, 3) m, ankle and toe joint.
        velocities: (N, 2, 3) m/s.
    """
    count = int(round(2.0 * _CONTACT_SECONDS * _PLAN_RATE))
    times = np.arange(count + 1) / _PLAN_RATE - _CONTACT_SECONDS
    base_posture, curve = _build_base_posture(style, neutral, times)
    around = slice(count // 2 - 1, count // 2 + 2)
    postures = [_swing_leg(
        base_posture, style, times, neutral=neutral, curve=curve, lift=lift, loft=loft,
    ).frames(around) for lift, loft in variants]
    motion = to_motion(Posture.join(postures), neutral)
    motion = mirror(motion) if foot == "left" else motion
    limb = getattr(identify_joints(motion.skeleton), foot)
    places, _ = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    line = places[:, [limb.foot, limb.toe_or_foot]].reshape(len(postures), 3, 2, 3)
    return line[:, 1], 0.5 * _PLAN_RATE * (line[:, 2] - line[:, 0])


def _build_base_posture(style: KickStyle, neutral: NeutralStance, times: np.ndarray) -> tuple[Posture, Callable]:
    """Build the kick's posture at the planning rate without the leg's swing, and the function that reads its tables."""
    nothing = np.zeros_like(times)
    curve, pelvis, spine, arms, height = build_plan_parts(style, neutral, times, _ROUNDING_SECONDS * _PLAN_RATE)
    footfalls = _plan_footfalls(style)
    hips = curve(_build_hip_rows(style, footfalls)) * (neutral.leg / tables.LEG)
    feet = [_compute_foot(curve(rows), neutral, side) for side, rows in enumerate(_build_step_rows(style, footfalls))]
    look = np.clip(-(pelvis[:, 2] + spine[:, 2]), -1.1, 1.1)
    nod = -0.4 * (pelvis[:, 1] + spine[:, 1]) + np.radians(curve(_NOD)[:, 0])
    posture = Posture(
        fps=_PLAN_RATE, hips=np.stack([hips[:, 0], hips[:, 1], height - hips[:, 2]], axis=-1), heading=nothing,
        pelvis=pelvis, spine=spine, head=np.stack([-0.6 * spine[:, 0] - 0.6 * pelvis[:, 0], nod, look], axis=-1),
        arms=arms, wrists=np.full((len(times), 2), 0.1), ankles=np.stack([foot[:, :3] for foot in feet], axis=1),
        feet=np.stack([foot[:, 3:6] for foot in feet], axis=1), toes=np.stack([foot[:, 6] for foot in feet], axis=-1),
        knees=np.zeros((len(times), 2)),
    )
    return posture, curve


_NOD = ((-1.5, 8), (-0.6, 16), (0.0, 26), (0.15, 20), (0.4, -4), (1.3, 0))
"""Degrees that the head looks down: at the ball until it has left."""


def _plan_footfalls(style: KickStyle) -> dict[str, np.ndarray]:
    """Compute the places (2,) m of the feet in order: `left0` and `right0` at the start, `left1`, `right1`, `planted`,
    at the end `right2`, `left2`.
    """
    turn = np.radians(style.approach)
    ahead, left = np.array([np.cos(turn), -np.sin(turn)]), np.array([np.sin(turn), np.cos(turn)])
    first, second, third = style.strides
    right1 = _SUPPORT_FOOT - third * ahead - _FOOT_DISTANCE * left
    left1 = right1 - second * ahead + _FOOT_DISTANCE * left
    left0 = left1 - first * ahead
    end = _HIPS_AT_CONTACT + np.array(style.hips[-1][1:3])
    return {
        "left0": left0, "right0": left0 - _FOOT_DISTANCE * left, "left1": left1, "right1": right1,
        "planted": _SUPPORT_FOOT, "right2": end + [-0.02, -0.10], "left2": end + [0.06, 0.11],
    }  # fmt: skip


def _build_hip_rows(style: KickStyle, footfalls: dict[str, np.ndarray]) -> tuple:
    """Build rows (time, ahead, left, lowered) of the middle between the hip joints, m."""
    turn = np.radians(style.approach)
    ahead, left = np.array([np.cos(turn), -np.sin(turn)]), np.array([np.sin(turn), np.cos(turn)])

    def place_beside(fall: str, behind: float, side: float) -> np.ndarray:
        return footfalls[fall] - behind * ahead + side * 0.5 * _FOOT_DISTANCE * left

    begin = 0.5 * (footfalls["left0"] + footfalls["right0"])
    run = (
        (-1.5, *begin, 0.01), (-1.3, *(begin + 0.03 * ahead), 0.03), (-0.9, *place_beside("left1", 0.25, -0.7), 0.05),
        (-0.68, *place_beside("left1", -0.20, -0.7), 0.05),
        (-0.47, *place_beside("right1", 0.17 * style.strides[2], 0.7), 0.08),
        (-0.30, *place_beside("right1", -0.22 * style.strides[2], 0.7), 0.07),
    )  # fmt: skip
    return run + tuple((t, *(_HIPS_AT_CONTACT + [x, y]), low) for t, x, y, low in style.hips)


def _build_step_rows(style: KickStyle, footfalls: dict[str, np.ndarray]) -> tuple[tuple, tuple]:
    """Build rows (time, ahead, left, raised, pitch, yaw) of both feet.

    From _SWING_START on, the right foot follows the leg.
    """
    yaw = -style.approach
    one, two, three = _STEPS
    left = (
        *_build_one_step(one, footfalls["left0"], footfalls["left1"], high=0.10, yaw=yaw, later=yaw),
        *_build_one_step(three, footfalls["left1"], footfalls["planted"], high=0.13, yaw=yaw, later=-10.0),
        *_build_one_step((0.39, 0.82), footfalls["planted"], footfalls["left2"], high=0.10, yaw=-10.0, later=0.0),
    )
    right = (
        *_build_one_step(two, footfalls["right0"], footfalls["right1"], high=0.12, yaw=yaw, later=yaw - 4.0),
        *_build_one_step((-0.27, _SWING_END[1]), footfalls["right1"], footfalls["right2"], high=0.12, yaw=yaw - 4.0,
                         later=-6.0),
    )
    return left, right


def _build_one_step(when: tuple[float, float], off: np.ndarray, down: np.ndarray, high: float, yaw: float,
                    later: float) -> tuple:
    """Build rows of one step: the heel rises, the foot swings over and lands heel first."""
    begin, end = when
    d, along = end - begin, down - off

    def build_row(share, travelled, raised, pitch):
        return (begin + share * d, *(off + travelled * along), raised, pitch, yaw + travelled * (later - yaw))

    return (
        build_row(-min(0.35, 0.12 / d), 0.0, 0.0, 0.0), build_row(0.0, 0.0, 0.0, 38.0),
        build_row(0.24, 0.08, high, 48.0), build_row(0.62, 0.58, 0.6 * high, 4.0),
        build_row(0.88, 0.92, 0.12 * high, -12.0), build_row(1.0, 1.0, 0.0, -8.0), build_row(1.12, 1.0, 0.0, 0.0),
    )  # fmt: skip


def _compute_foot(rows: np.ndarray, neutral: NeutralStance, side: int) -> np.ndarray:
    """Compute ankle, rotation and toes (T, 7) of a foot from rows (T, 5).

    A heel that rises turns about the ball of the foot, which stays in place.
    """
    foot = lift_foot(rows, neutral)
    pitch, yaw = foot[:, 4], foot[:, 5]
    length, height = neutral.ball[side, 0], -neutral.ball[side, 2]
    rolled = (length * (1.0 - np.cos(pitch)) + height * np.sin(pitch)) * (pitch > 0.0)
    foot[:, 0] += rolled * np.cos(yaw)
    foot[:, 1] += rolled * np.sin(yaw)
    toes = np.clip(pitch, 0.0, 0.6) * np.clip(1.0 - 8.0 * rows[:, 2], 0.0, 1.0)
    return np.column_stack([foot, toes])


def _swing_leg(
    posture: Posture, style: KickStyle, times: np.ndarray, neutral: NeutralStance, curve, lift: float, loft: float
) -> Posture:
    """Swing the right leg of a posture as the style says, from leaving the ground until it returns."""
    lift, loft = lift * neutral.leg / tables.LEG, np.radians(loft)
    thigh, knee = np.radians(curve(style.leg)).T
    turn, abduction = np.radians(curve(style.plane)).T
    bent, out = np.radians(curve(style.foot)).T
    places, body = neutral.positions, identify_joints(neutral.skeleton).right
    upper = np.linalg.norm(places[body.lower_leg] - places[body.upper_leg])
    lower = np.linalg.norm(places[body.foot] - places[body.lower_leg])
    shank = thigh - knee
    in_plane = upper * np.stack([np.sin(thigh), np.zeros_like(thigh), -np.cos(thigh)], axis=-1)
    in_plane += lower * np.stack([np.sin(shank), np.zeros_like(thigh), -np.cos(shank)], axis=-1)
    aside = quaternion.from_axis_angle(np.array([1.0, 0.0, 0.0]), -abduction)
    leg = quaternion.rotate(quaternion.from_up_angle(turn), quaternion.rotate(aside, in_plane))
    ankle = compute_hip_positions(posture, neutral)[:, RIGHT] + leg
    near = np.exp(-0.5 * (times / _LIFT_SECONDS) ** 2)
    ankle[:, 2] += lift * near
    foot = np.stack([np.zeros_like(times), bent - loft * near - shank, turn - out], axis=-1)
    free = quintic_step((times - _SWING_START[0]) / (_SWING_START[1] - _SWING_START[0]))
    free = free * (1.0 - quintic_step((times - _SWING_END[0]) / (_SWING_END[1] - _SWING_END[0])))
    ankles, feet, toes = posture.ankles.copy(), posture.feet.copy(), posture.toes.copy()
    ankles[:, RIGHT] += free[:, None] * (ankle - ankles[:, RIGHT])
    feet[:, RIGHT] += free[:, None] * (foot - feet[:, RIGHT])
    toes[:, RIGHT] += free * (_TOE_BEND * near - toes[:, RIGHT])
    return posture.replace_arrays(ankles=ankles, feet=feet, toes=toes)
