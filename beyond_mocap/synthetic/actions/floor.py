"""Actions that end on the ground: a diving header, a slide tackle, a fall, an overhead kick; and getting up from them.

By judgement, with these figures: a dive's flight is a parabola; a body that slides over grass slows down by 5 to 6
m/s^2 (coefficient of friction of 0.5 to 0.6: Lake, Carre 2007 for skin and cloth on turf, 0.4 to 0.7); getting up takes
1.2 to 2 s, as in the recordings of goalkeepers.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...motion.supports import GRAVITY
from ..gestures import Gesture, interpolate_rows
from .action import ActionSetting
from .ball_hands import hold_ball
from .body_poses import NO_ARM, BodyPoses, build_body_poses

_GRASS = 5.5  # m/s^2 by which a sliding body slows down
_UP_HALFWAY = 1.2  # s from the chest's landing to the middle of getting up
_SITS_DOWN, _SITS = -2.0, 2.0  # s from the middle of sitting at which the body begins to sit down, and to get up
_LYING_DOWN = 2.0  # s of sitting and lying down
_UP_BACK_LIES, _UP_BACK_HALFWAY = 0.55, 1.0  # s of `_UP_BACK` that lie, and from there to its middle
_STANDING_HIPS = 0.93  # m above the ground, of an adult who stands


def _at(offset: float, rows) -> tuple:
    """Shift rows in time."""
    return tuple((row[0] + offset, *row[1:]) for row in rows)


# seconds from the chest's landing: lying on the front, the hands push, a knee, the other foot, standing
_UP_FRONT: dict[str, Any] = {
    "hips": ((0.0, 0, 0, 0.82), (0.55, 0, 0, 0.83), (0.95, -0.10, 0, 0.62), (1.25, -0.26, 0.02, 0.47),
             (1.6, -0.12, 0.02, 0.30), (1.95, -0.01, 0, 0.08), (2.3, 0, 0, 0)),
    "pelvis": ((0.0, 0, 86, 0), (0.6, 0, 86, 0), (0.95, 0, 66, 0), (1.25, 0, 52, -6), (1.6, 0, 40, -4),
               (1.95, 0, 14, 0),
               (2.3, 0, 0, 0)),
    "spine": ((0.0, 0, -14, 0), (0.55, 0, -8, 0), (0.95, 0, 6, 0), (1.25, 0, 22, 4), (1.6, 0, 26, 2), (1.95, 0, 10, 0),
              (2.3, 0, 0, 0)),
    "head": ((0.0, -38, 0), (0.6, -30, 0), (1.25, -26, 0), (1.6, -34, 0), (2.0, -14, 0), (2.3, 0, 0)),
    "left_arm": ((0.0, 70, 66, -46, 84), (0.2, 20, 84, -76, 92), (0.5, 20, 78, -70, 100), (0.95, 84, 16, 10, 24),
                 (1.25, 74, 12, 10, 12),
                 (1.6, 34, 14, 12, 24), (2.3, *NO_ARM)),
    "right_arm": ((0.0, 66, 70, -46, 88), (0.2, 20, 88, -76, 96), (0.5, 20, 82, -70, 104), (0.95, 82, 18, 10, 26),
                  (1.25, 76, 12, 10, 14),
                  (1.6, 38, 14, 12, 34), (2.3, *NO_ARM)),
    "left_foot": ((0.0, -0.84, 0.05, 0.06, 92, 0, 0), (0.95, -0.82, 0.05, 0.0, 80, 0, 0),
                  (1.4, -0.80, 0.04, 0.0, 70, 0, 0), (1.6, -0.55, 0.04, 0.10, 50, 0, 0),
                  (1.85, -0.06, 0.02, 0.05, 8, 0, 0),
                  (1.97, 0, 0, 0, 0, 0, 0)),
    "right_foot": ((0.0, -0.82, -0.08, 0.08, 92, 0, 0), (0.8, -0.82, -0.07, 0.0, 84, 0, 0),
                   (1.0, -0.62, -0.10, 0.10, 66, 0, 0), (1.22, -0.04, -0.06, 0.05, 8, 0, 0),
                   (1.34, 0.0, 0, 0, 0, 0, 0)),
    "rests": ((0.0, 1), (0.6, 1), (0.85, 0), (2.3, 0)),
    "end": 2.15,
}  # fmt: skip


def build_diving_header(setting: ActionSetting) -> Gesture:
    """Build a diving header: one foot pushes off, the body flies flat to the ball and lands on arms and chest.

    The hips follow a parabola through the height at which the head meets the ball. By judgement after photographs: the
    trunk is within 20 degrees of level at the contact, and the arms reach ahead to land.

    Args:
        setting: for whom; height: of the ball.
    Returns:
        The movement; its key is the contact.
    """
    ball = 0.75 if setting.height is None else setting.height / setting.scale
    before, hips_at_key, lies = 0.30, ball - 0.22, 0.13
    leaves_at = min(_STANDING_HIPS - 0.08, hips_at_key + 0.45)
    land = _compute_landing_time(leaves_at, before, hips_at_key, lies)
    up, speed = _UP_FRONT, max(setting.speed, 2.0)
    stop = land + speed / _GRASS
    fling = {side: ((-0.55, -20, 16, 10, 50), (-0.30, 40, 30, 10, 50),
                    (0.0, 92, 42, 10, 48)) for side in ("left", "right")}
    return build_body_poses(BodyPoses(
        speeds=((-2.0, setting.speed), (-0.6, speed), (land, 0.95 * speed), (stop, 0.0)),
        hips=((-0.5, 0, 0, 0.05), (-before - 0.1, 0, 0, 0.08 + _STANDING_HIPS - leaves_at),
              (-before, 0.02, 0, _STANDING_HIPS - leaves_at),
              (0.0, 0.02, 0, _STANDING_HIPS - hips_at_key), *_at(land, up["hips"])),
        pelvis=((-0.5, 0, 8, 0), (-before, 0, 34, -6), (0.0, 0, 74, 0), *_at(land, up["pelvis"])),
        spine=((-0.5, 0, 6, 0), (-before, 0, 2, 8), (-0.08, 0, -10, 0), (0.05, 0, 2, 0), *_at(land, up["spine"])),
        head=((-0.5, -8, 0), (-before, -28, 0), (-0.06, -44, 0), (0.04, -30, 0), *_at(land, up["head"])),
        arms=(fling["left"] + _at(land, up["left_arm"]), fling["right"] + _at(land, up["right_arm"])),
        feet=(((-before, -0.42, 0.02, 0.10, 50, 0, 0), (0.0, -0.70, 0.04, 0.42, 78, 0, 0), *_at(land, up["left_foot"])),
              ((-before, -0.30, -0.02, 0.30, 60, 0, 0), (0.0, -0.74, -0.04, 0.62, 92, 0, 0),
               (0.5 * land, -0.76, -0.06, 0.52, 96, 0, 0), *_at(land, up["right_foot"]))),
        knees=((-0.3, 0, 0), (land + 0.6, 4, 4), (land + 2.3, 0, 0)),
        rests=((land - 0.03, 0), *_at(land, up["rests"])),
        begin=(-0.55, -before), leaves=(-before, -before - 0.12), push=-before, flight=(-before, land),
        end=land + up["end"],
    ), setting)  # fmt: skip


def build_slide_tackle(setting: ActionSetting) -> Gesture:
    """Build a slide tackle with the right foot: down on the left thigh and hip, the right leg stretched to the ball.

    The left leg is folded below, the left hand supports; the slide's own speed brings the body up again over the folded
    leg. The slide slows down by the friction of grass.

    Args:
        setting: for whom.
    Returns:
        The movement; its key is the contact of the right foot.
    """
    speed = max(setting.speed, 2.5)
    stop = max(speed / _GRASS - 0.15, 0.35)
    left_arm = ((-0.5, -10, 24, 10, 40), (-0.25, -34, 50, 0, 30), (-0.1, -34, 56, -10, 66), (0.1, -34, 58, -10, 74))
    right_arm = ((-0.5, 10, 20, 10, 40), (-0.2, 40, 48, 10, 30), (0.0, 46, 56, 10, 26), (0.3, 40, 50, 10, 30))
    return build_body_poses(BodyPoses(
        speeds=((-2.0, setting.speed), (-0.6, speed), (-0.15, speed), (stop, 0.0)),
        hips=((-0.5, 0, 0, 0.04), (-0.32, -0.04, 0.03, 0.26), (-0.14, -0.10, 0.05, 0.70), (0.0, -0.12, 0.06, 0.80),
              (stop, -0.12, 0.06, 0.80), (stop + 0.35, -0.16, 0.05, 0.62), (stop + 0.7, -0.08, 0.03, 0.34),
              (stop + 1.1, 0, 0, 0.06), (stop + 1.4, 0, 0, 0)),
        pelvis=((-0.5, 0, 6, 0), (-0.3, -8, -8, 6), (-0.12, -26, -34, 16), (0.0, -32, -42, 20), (stop, -28, -34, 18),
                (stop + 0.35, -14, 4, 10), (stop + 0.7, -4, 30, 4), (stop + 1.1, 0, 10, 0), (stop + 1.4, 0, 0, 0)),
        spine=((-0.5, 0, 8, 0), (-0.2, 4, 16, -4), (0.0, 8, 14, -10), (stop, 8, 22, -8), (stop + 0.35, 4, 28, -4),
               (stop + 0.7, 0, 24, 0), (stop + 1.4, 0, 0, 0)),
        head=((-0.5, 8, 0), (0.0, 20, -6), (stop, 10, -6), (stop + 0.5, -24, 0), (stop + 1.4, 0, 0)),
        arms=((*left_arm, (stop, -34, 54, -10, 66), (stop + 0.4, -26, 40, 0, 16), (stop + 0.7, 24, 16, 10, 26),
               (stop + 1.4, *NO_ARM)),
              (*right_arm, (stop, 36, 40, 10, 40), (stop + 0.5, 46, 18, 14, 40), (stop + 1.4, *NO_ARM))),
        feet=(((-0.32, -0.06, 0.08, 0.04, 14, 16, 0), (-0.20, 0.08, 0.12, 0.06, 16, 20, 16),
               (-0.1, 0.19, 0.06, 0.04, 26, 20, 40), (0.0, 0.27, 0.02, 0.02, 10, 10, 66),
               (stop, 0.25, 0.02, 0.02, 10, 10, 66), (stop + 0.4, 0.08, 0.04, 0.02, 40, 10, 30),
               (stop + 0.65, -0.08, 0.02, 0.08, 44, 10, 0), (stop + 0.85, 0, 0, 0, 0, 0, 0)),
              ((-0.34, 0.10, -0.02, 0.16, 0, 0, 0), (-0.12, 0.66, 0.0, 0.10, -16, -10, 0),
               (0.0, 0.76, 0.03, 0.06, -22, -14, 10), (stop - 0.05, 0.74, 0.03, 0.04, -22, -10, 6),
               (stop + 0.25, 0.40, -0.02, 0.01, -6, -4, 0), (stop + 0.4, 0.30, -0.02, 0.0, 0, 0, 0),
               (stop + 0.75, 0.30, -0.02, 0.0, 0, 0, 0), (stop + 0.9, 0.14, -0.01, 0.08, 12, 0, 0),
               (stop + 1.1, 0, 0, 0, 0, 0, 0))),
        knees=((-0.5, 0, 0), (-0.34, 22, 2), (-0.22, 46, 4), (-0.1, 60, 4), (stop, 58, 4), (stop + 0.5, 24, 4),
               (stop + 1.1, 0, 0)),
        rests=((-0.2, 0), (-0.06, 1), (stop, 1), (stop + 0.2, 0)),
        begin=(-0.5, -0.18), leaves=(-0.46, -0.46), push=-0.30, end=stop + 1.25,
    ), setting)  # fmt: skip


def build_fall(setting: ActionSetting) -> Gesture:
    """Build a fall to the front: the right foot is held, the knees give, the hands land first; and getting up.

    Args:
        setting: for whom; speed: of the player.
    Returns:
        The movement; its key is the moment in which the chest lands.
    """
    speed, up = setting.speed, _UP_FRONT
    stop = max(speed / _GRASS, 0.1)
    fling = ((-0.8, *NO_ARM), (-0.5, 40, 30, 10, 40), (-0.22, 78, 30, 10, 30), (-0.06, 76, 44, 0, 60))
    return build_body_poses(BodyPoses(
        speeds=((-2.0, speed), (-0.3, max(0.8 * speed, 0.5)), (0.0, max(0.6 * speed, 0.5)), (stop, 0.0)),
        hips=((-0.8, 0, 0, 0), (-0.5, 0.02, 0, 0.10), (-0.25, 0.06, 0, 0.42), (-0.08, 0.04, 0, 0.70), *up["hips"]),
        pelvis=((-0.8, 0, 4, 0), (-0.5, 0, 22, 4), (-0.25, 0, 54, 2), (-0.08, 0, 76, 0), *up["pelvis"]),
        spine=((-0.8, 0, 6, 0), (-0.5, 0, 16, -4), (-0.2, 0, 2, 0), *up["spine"]),
        head=((-0.8, 4, 0), (-0.5, -10, 0), (-0.2, -36, 0), *up["head"]),
        arms=(fling + up["left_arm"], fling + up["right_arm"]),
        feet=(((-0.6, -0.05, 0, 0, 20, 0, 0), (-0.3, -0.34, 0.02, 0.02, 66, 0, 0), (-0.1, -0.72, 0.04, 0.12, 90, 0, 0),
               *up["left_foot"]),
              ((-0.7, -0.20, 0, 0.03, 40, 0, 0), (-0.4, -0.40, -0.03, 0.12, 70, 0, 0),
               (-0.14, -0.72, -0.06, 0.26, 94, 0, 0), *up["right_foot"])),
        knees=((-0.3, 0, 0), (0.6, 4, 4), (2.3, 0, 0)),
        rests=((-0.1, 0), *up["rests"]),
        begin=(-0.8, -0.35), leaves=(-0.5, -0.72), push=-0.4, end=up["end"],
    ), setting)  # fmt: skip


# seconds from the back's landing: lying on the back, sitting up, feet drawn in, through the crouch
_UP_BACK: dict[str, Any] = {
    "hips": ((0.0, 0, 0, 0.80), (0.7, 0, 0, 0.81), (1.15, 0.02, 0, 0.80), (1.55, 0.12, 0, 0.70), (1.9, 0.32, 0, 0.46),
             (2.3, 0.42, 0, 0.20), (2.7, 0.45, 0, 0)),
    "pelvis": ((0.0, 0, -86, 0), (0.55, 0, -82, 0), (1.15, 0, -32, 0), (1.5, 0, 12, 0), (1.9, 0, 40, 0),
               (2.3, 0, 28, 0),
               (2.7, 0, 0, 0)),
    "spine": ((0.0, 0, 8, 0), (0.55, 0, 16, 0), (1.15, 0, 38, 0), (1.5, 0, 44, 0), (1.9, 0, 40, 0), (2.3, 0, 24, 0),
              (2.7, 0, 0, 0)),
    "head": ((0.0, 24, 0), (0.6, 16, 0), (1.15, 8, 0), (1.6, -18, 0), (2.0, -32, 0), (2.7, 0, 0)),
    "arm": ((0.0, -16, 58, -10, 24), (0.5, -8, 34, -8, 30), (1.15, -36, 24, -10, 22), (1.55, 6, 22, 6, 30),
            (1.9, 58, 10, 18, 20), (2.3, 44, 8, 18, 18), (2.7, *NO_ARM)),
    "foot": ((0.0, 0.80, 0.02, 0.10, -50, 0, 0), (0.6, 0.78, 0.02, 0.02, -46, 0, 0), (1.0, 0.60, 0.02, 0.03, -10, 0, 0),
             (1.3, 0.45, 0.0, 0.0, 0, 0, 0), (2.9, 0.45, 0.0, 0.0, 0, 0, 0)),
    "rests": ((0.0, 1), (1.1, 1), (1.5, 0), (2.7, 0)),
    "end": 2.6,
}  # fmt: skip


def _compute_landing_time(leaves_at: float, before: float, hips_at_key: float, lies: float) -> float:
    """Compute when (s after the contact) falling hips reach the height, m, in which the body lies.

    leaves_at, hips_at_key: m, their heights at the take-off, `before` s ahead of the contact, and at the contact.
    """
    fall = (hips_at_key - leaves_at) / before - 0.5 * GRAVITY * before
    return max((fall + np.sqrt(fall**2 + 2.0 * GRAVITY * max(hips_at_key - lies, 0.05))) / GRAVITY, 0.08)


def build_bicycle_kick(setting: ActionSetting) -> Gesture:
    """Build an overhead kick with the right foot: the left leg swings up first, the body lies in the air, arms land it.

    By judgement after photographs and frame-by-frame pictures: the trunk is level at the contact, the ball is met
    above the head's side of the hips, the legs pass each other as scissors.

    Args:
        setting: for whom; height: of the ball.
    Returns:
        The movement; its key is the contact. It faces away from where the ball goes.
    """
    ball = 1.75 if setting.height is None else setting.height / setting.scale
    off, hips_at_key, lies, up = 0.28, float(np.clip(ball - 0.75, 0.75, 1.15)), 0.16, _UP_BACK
    land = _compute_landing_time(_STANDING_HIPS, off, hips_at_key, lies)
    arm = ((-0.8, *NO_ARM), (-0.45, -30, 20, 10, 20), (-0.22, 40, 60, 0, 20), (0.0, 6, 74, -10, 16),
           (0.5 * land, -20, 64, -10, 20))
    ankle = 0.09
    return build_body_poses(BodyPoses(
        speeds=((-2.0, 0.0), (1.0, 0.0)),
        hips=((-0.8, 0, 0, 0), (-0.5, -0.06, 0, 0.20), (-off, -0.12, 0, 0.0),
              (0.0, -0.22, 0, _STANDING_HIPS - hips_at_key),
              *_shift_rows(land, up["hips"], -0.28)),
        pelvis=((-0.8, 0, 0, 0), (-0.5, 0, -6, 0), (-off, 0, -30, 0), (0.0, 0, -84, 0), *_at(land, up["pelvis"])),
        spine=((-0.8, 0, 2, 0), (-0.5, 0, 12, 0), (-off, 0, 6, 0), (0.0, 0, 14, 0), *_at(land, up["spine"])),
        head=((-0.8, 0, 0), (-0.5, -14, 0), (-off, -8, 0), (0.0, 26, 0), *_at(land, up["head"])),
        arms=(arm + _at(land, up["arm"]), arm + _at(land, up["arm"])),
        feet=(((-0.62, 0, 0, 0, 10, 0, 0), (-0.4, 0.30, 0.0, 0.34, 30, 0, 0), (-0.2, 0.62, 0, 1.04, 0, 0, 0),
               (0.0, 0.50, 0.0, 0.72, -10, 0, 0), *_shift_rows(land, up["foot"], -0.28)),
              ((-0.5, 0, 0, 0, 8, 0, 0), (-off, 0.0, 0, 0.02, 50, 0, 0), (-0.16, 0.30, 0, 0.52, 40, 0, 0),
               (-0.06, 0.22, 0.0, 1.26, -40, 0, 0), (0.0, -0.10, 0.0, ball - ankle - 0.10, -86, 0, 0),
               (0.08, -0.36, 0, 1.30, -100, 0, 0), *_shift_rows(land, up["foot"], -0.28))),
        knees=((-0.3, 0, 0), (land, 4, 4), (land + 1.4, 10, 10), (land + 2.4, 0, 0)),
        rests=((land - 0.03, 0), *_at(land, up["rests"])),
        begin=(-0.8, -0.5), leaves=(-0.62, -0.5), push=-0.6, flight=(-off, land), end=land + up["end"],
    ), setting)  # fmt: skip


def build_half_bicycle_kick(setting: ActionSetting) -> Gesture:
    """Build a half overhead kick with the right foot: the body lies in the air on its left side, the right leg swings
    level across it; it lands on hip and hand and rolls onto its back.

    Args:
        setting: for whom; height: of the ball.
    Returns:
        The movement; its key is the contact. It faces across the way of the ball.
    """
    ball = 1.2 if setting.height is None else setting.height / setting.scale
    off, hips_at_key, lies, up = 0.24, float(np.clip(ball - 0.22, 0.72, 1.05)), 0.16, _UP_BACK
    land = _compute_landing_time(_STANDING_HIPS, off, hips_at_key, lies)
    left_arm = ((-0.8, *NO_ARM), (-0.45, -10, 30, 10, 20), (-0.2, 10, 84, 0, 20), (0.0, 0, 96, -10, 14),
                (0.6 * land, -10, 84, -10, 24))
    right_arm = ((-0.8, *NO_ARM), (-0.45, 20, 40, 10, 30), (-0.2, 40, 60, 10, 30), (0.0, -26, 70, 0, 30),
                 (0.6 * land, -10, 50, 0, 30))
    return build_body_poses(BodyPoses(
        speeds=((-2.0, 0.0), (1.0, 0.0)),
        hips=((-0.8, 0, 0, 0), (-0.5, -0.02, 0.03, 0.18), (-off, -0.04, 0.08, 0.0),
              (0.0, -0.06, 0.18, _STANDING_HIPS - hips_at_key), *_shift_rows(land, up["hips"], -0.16)),
        pelvis=((-0.8, 0, 0, 0), (-0.5, -6, 0, -20), (-off, -30, -4, -30), (0.0, -74, -12, 6),
                (0.5 * land, -66, -34, 30), (land, -16, -80, 6), *_at(land, up["pelvis"][1:])),
        spine=((-0.8, 0, 2, 0), (-0.5, 4, 8, -20), (-off, 8, 4, -24), (0.0, 10, 6, 8), *_at(land, up["spine"])),
        head=((-0.8, 0, 0), (-0.5, -10, -20), (-off, 0, -24), (0.0, 6, -10), *_at(land, up["head"])),
        arms=(left_arm + _at(land, up["arm"]), right_arm + _at(land, up["arm"])),
        feet=(((-0.5, 0, 0, 0, 8, 0, 0), (-off, 0.0, 0.0, 0.02, 50, 0, 0), (-0.1, 0.02, -0.18, 0.30, 40, 10, 30),
               (0.0, 0.10, -0.38, 0.36, 30, 10, 60), (0.6 * land, 0.40, -0.22, 0.20, 10, 0, 40),
               *_shift_rows(land, up["foot"], -0.16)),
              ((-0.6, 0, 0, 0, 10, 0, 0), (-0.4, -0.14, -0.20, 0.20, 50, -20, 0),
               (-0.2, -0.34, -0.44, 0.62, 70, -40, 30), (-0.08, 0.10, -0.72, hips_at_key - 0.16, 60, -10, 60),
               (0.0, 0.44, -0.62, ball - 0.20, 50, 20, 70),
               (0.07, 0.66, -0.30, ball - 0.16, 40, 50, 60), (0.6 * land, 0.70, 0.0, 0.50, 10, 20, 20),
               *_shift_rows(land, up["foot"], -0.16))),
        knees=((-0.3, 0, 0), (land, 4, 4), (land + 1.4, 10, 10), (land + 2.4, 0, 0)),
        rests=((land - 0.03, 0), *_at(land, up["rests"])),
        begin=(-0.8, -0.5), leaves=(-0.5, -0.6), push=-0.6, flight=(-off, land), end=land + up["end"],
    ), setting)  # fmt: skip


def _shift_rows(offset: float, rows, ahead: float) -> tuple:
    """Shift rows of hips or feet in time and place."""
    return tuple((row[0] + offset, row[1] + ahead, *row[2:]) for row in rows)


def build_quick_get_up(setting: ActionSetting) -> Gesture:
    """Build getting up from lying on the front: the hands push, a foot steps under, the body rises.

    The fall before it belongs to it, for players who are not yet on the ground.

    Args:
        setting: for whom.
    Returns:
        The movement; its key is halfway.
    """
    fall = build_fall(setting)
    return Gesture(fall.motion, fall.key + _UP_HALFWAY, fall.start, fall.end)


def build_sitting(setting: ActionSetting) -> Gesture:
    """Build sitting down on the ground, sitting for a while, and getting up.

    Args:
        setting: for whom.
    Returns:
        The movement; it has no key moment, and lasts while the body sits.
    """
    return _build_seat(setting, arm=(-34, 26, -10, 16), down=_SITS_DOWN)


def build_sitting_with_ball(setting: ActionSetting) -> Gesture:
    """Build sitting down on the ground with a ball in both hands, as `build_sitting` otherwise, and getting up.

    Args:
        setting: for whom.
    Returns:
        The movement; it has no key moment, and lasts while the body sits.
    """
    gesture = _build_seat(setting, arm=(44, 8, 20, 66), down=_SITS_DOWN)
    times = np.arange(len(gesture.motion)) / setting.fps - gesture.end
    rows = ((_SITS_DOWN - _SITS, 0, 0.26), (_SITS_DOWN - _SITS + 0.4, 1, 0.26), (0.0, 1, 0.26), (0.4, 0, 0.3))
    return replace(gesture, motion=hold_ball(gesture.motion, interpolate_rows(rows, times), setting.neutral))


def _build_seat(setting: ActionSetting, arm: tuple[float, ...], down: float) -> Gesture:
    """Build sitting down from `down` s on, with a pose of both arms, and getting up; it lasts while the body sits."""
    up, sits = _UP_BACK, _SITS
    later = {name: tuple((row[0] - 1.15 + sits, *row[1:]) for row in rows if row[0] >= 1.3)
             for name, rows in up.items() if name != "end"}
    spine, tilt = 30, -24
    arms = ((down - 0.2, *NO_ARM), (down + 0.4, 20, 20, 10, 20), (down + 1.0, *arm), (sits, *arm), *later["arm"])
    still = ((down - 0.2, 0, 0, 0, 0, 0, 0), (sits + 2.0, 0, 0, 0, 0, 0, 0))
    gesture = build_body_poses(BodyPoses(
        speeds=((-4.0, 0.0), (4.0, 0.0)),
        hips=((down - 0.2, 0, 0, 0), (down + 0.5, -0.14, 0, 0.50), (down + 1.0, -0.44, 0, 0.80), (sits, -0.44, 0, 0.80),
              *_shift_rows(0.0, later["hips"], -0.45)),
        pelvis=((down - 0.2, 0, 0, 0), (down + 0.5, 0, 30, 0), (down + 1.0, 0, tilt, 0),
                (sits, 0, tilt, 0), *later["pelvis"]),
        spine=((down - 0.2, 0, 2, 0), (down + 0.5, 0, 30, 0), (down + 1.0, 0, spine, 0),
               (sits, 0, spine, 0), *later["spine"]),
        head=((down - 0.2, 0, 0), (down + 0.5, -20, 0), (down + 1.0, 0, 0), (sits, 4, 0), *later["head"]),
        arms=(arms, arms), feet=(still, still),
        knees=((down, 0, 0), (down + 1.0, 8, 8), (sits, 8, 8), (sits + 1.4, 0, 0)),
        rests=((down + 0.8, 0), (down + 1.05, 1), (sits, 1), (sits + 0.3, 0)),
        begin=(down - 0.2, down), leaves=(down - 0.2, down - 0.2), push=down - 0.3, end=sits + 1.5,
    ), setting)  # fmt: skip
    return Gesture(gesture.motion, None, gesture.key + down + 0.8, gesture.key + sits)


def build_lying(setting: ActionSetting) -> Gesture:
    """Build sitting down, lying on the back for a while, and getting up.

    Args:
        setting: for whom.
    Returns:
        The movement; it has no key moment, and lasts while the body lies.
    """
    gesture = _build_lie_down(setting, 3.5)
    return Gesture(gesture.motion, None, gesture.key - 3.5 - _LYING_DOWN, gesture.key)


def build_slow_get_up(setting: ActionSetting) -> Gesture:
    """Build getting up from lying on the back, with sitting and lying down for players who are not yet on the ground.

    Args:
        setting: for whom.
    Returns:
        The movement; its key is halfway.
    """
    gesture = _build_lie_down(setting, 0.4)
    return Gesture(gesture.motion, gesture.key + _UP_BACK_HALFWAY, gesture.start, gesture.end)


def _build_lie_down(setting: ActionSetting, rest: float) -> Gesture:
    """Build sitting down, lying on the back for `rest` s, and getting up; its key is when the body begins to."""
    down, up = -rest - _LYING_DOWN, _UP_BACK
    later = {name: _at(-_UP_BACK_LIES, [row for row in rows if row[0] > 0.0]) for name, rows in up.items()
             if name != "end"}
    arms = ((down, *NO_ARM), (down + 0.6, 20, 20, 10, 20), (down + 1.2, -34, 26, -10, 16), (-rest, *up["arm"][0][1:]),
            *later["arm"])
    still = ((down, 0, 0, 0, 0, 0, 0), (down + 1.3, 0, 0, 0, 0, 0, 0), (down + 1.55, 0.16, 0, 0.04, -6, 0, 0),
             (-rest, 0.31, 0.02, 0.02, -46, 0, 0), *_shift_rows(0.0, later["foot"], -0.45))
    return build_body_poses(BodyPoses(
        speeds=((-9.0, 0.0), (9.0, 0.0)),
        hips=((down, 0, 0, 0), (down + 0.7, -0.14, 0, 0.50), (down + 1.2, -0.44, 0, 0.80), (-rest, -0.45, 0, 0.80),
              *_shift_rows(0.0, later["hips"], -0.45)),
        pelvis=((down, 0, 0, 0), (down + 0.7, 0, 30, 0), (down + 1.2, 0, -24, 0), (-rest, 0, -84, 0),
                *later["pelvis"]),
        spine=((down, 0, 2, 0), (down + 0.7, 0, 30, 0), (down + 1.2, 0, 30, 0), (-rest, 0, 10, 0), *later["spine"]),
        head=((down, 0, 0), (down + 0.7, -20, 0), (down + 1.2, 0, 0), (-rest, 20, 0), *later["head"]),
        arms=(arms, arms), feet=(still, still),
        knees=((down, 0, 0), (down + 1.2, 8, 8), (0.6, 8, 8), (2.0, 0, 0)),
        rests=((down + 0.95, 0), (down + 1.2, 1), *later["rests"]),
        begin=(down, down + 0.2), leaves=(down, down), push=down - 0.1, end=up["end"] - _UP_BACK_LIES,
    ), setting)  # fmt: skip
