"""Headers: from a stand, with a jump off both feet, and with a jump off one foot out of a run.

The jump is as high as the ball asks for, up to what footballers reach: 0.6 m (Stolen, Chamari, Castagna and Wisloff
2005, Sports Med 35, 501-536: 0.48 to 0.60 m). The trunk arches and whips at the top (Lees and Nolan 1998; Shewchenko et
al. 2005, Br J Sports Med 39 suppl. 1: the trunk leads, the neck is stiff at the impact).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.time_series import hann_smooth
from ...motion.humanoid import identify_joints
from ...motion.retargeting.posture import Posture, to_motion
from ...motion.supports import GRAVITY
from ..gait import plan_footsteps, pose_upper_body
from ..gait_legs import plant_feet
from ..gait_plan import GaitPlan, GaitStyle, plan_gait
from ..gestures import LEFT, RIGHT, Gesture, blend_arrays, compute_envelope, interpolate_rounded
from ..moves import build_header
from ..volleys import build_volley
from .action import ActionSetting
from .body_poses import compute_flight, set_push

_FOREHEAD = 0.09  # m of an adult from the head's joint up to the middle of the forehead
_LEAST_RISE, _HIGHEST_RISE = 0.10, 0.60  # m that the hips rise in a jump
_STRIDE_BEFORE, _STRIDE_AFTER = 1.4, 1.6  # s of running before and after the contact
# degrees, seconds from the contact: tilt of the pelvis, flexion of the spine, nod
_TRUNK = (
    (-0.55, 2, 4, -14), (-0.30, -4, -8, -16), (-0.10, -10, -20, -10), (0.0, -2, 6, 6), (0.12, 6, 22, 4),
    (0.30, 4, 14, -6), (0.6, 0, 4, 0),
)  # fmt: skip
_LEFT_ARM = (
    (-0.6, -30, 14, 10, 60), (-0.30, 60, 40, 24, 80), (-0.06, 62, 62, 30, 84), (0.08, 10, 54, 22, 72),
    (0.3, -6, 46, 14, 56), (0.7, 6, 16, 12, 60),
)  # fmt: skip
_RIGHT_ARM = (
    (-0.6, 30, 14, 10, 70), (-0.34, -20, 36, 20, 60), (-0.06, 44, 64, 28, 86), (0.08, 0, 56, 20, 74),
    (0.3, -4, 44, 14, 56), (0.7, 4, 16, 12, 60),
)  # fmt: skip


def build_standing_header(setting: ActionSetting) -> Gesture:
    """Build a header with both feet on the ground.

    Args:
        setting: for whom.
    Returns:
        The movement; its key is the contact.
    """
    return build_volley("head", setting.skeleton, setting.fps, example=setting.example)


def build_jumping_header(setting: ActionSetting) -> Gesture:
    """Build a header with a jump off both feet, as high as the ball asks for.

    Args:
        setting: for whom; height: of the ball.
    Returns:
        The movement; its key is the contact, at the top of the flight.
    """
    return build_header(setting.skeleton, setting.fps, example=setting.example, rise=compute_rise(setting))


def compute_rise(setting: ActionSetting) -> float:
    """Compute how far (m) a standing body has to rise for its forehead to be at the ball's height."""
    neutral = setting.neutral
    head = identify_joints(neutral.skeleton).head_or_neck
    forehead = float(neutral.positions[head, 2]) + _FOREHEAD * setting.scale
    asked = 0.35 * setting.scale if setting.height is None else setting.height - forehead
    return float(np.clip(asked, _LEAST_RISE, _HIGHEST_RISE * setting.scale))


def build_running_jump(setting: ActionSetting) -> Gesture:
    """Build a jump out of a run, such as over a sliding opponent.

    Args:
        setting: for whom; speed: of the run.
    Returns:
        The movement; its key is the top of the flight.
    """
    return _build_jump_in_run(setting, heads=False)


def build_running_header(setting: ActionSetting) -> Gesture:
    """Build a header out of a run: the left foot takes off, the right one lands, the run goes on.

    The stride's flight is as long as the jump; the hips fall freely in it.

    Args:
        setting: for whom; speed: of the run; height: of the ball.
    Returns:
        The movement; its key is the contact, at the top of the flight.
    """
    return _build_jump_in_run(setting, heads=True)


def _build_jump_in_run(setting: ActionSetting, heads: bool) -> Gesture:
    """Build a jump in a run."""
    neutral, style = setting.neutral, GaitStyle(life=0.3)
    air = float(np.sqrt(2.0 * compute_rise(setting) / GRAVITY))
    frames = int(round((_STRIDE_BEFORE + _STRIDE_AFTER) * setting.fps)) + 1
    plan = plan_gait(np.full(frames, setting.speed), None, setting.fps, neutral, style=style)
    plan = _stretch_flight(set_push(plan, _STRIDE_BEFORE - air, LEFT), _STRIDE_BEFORE, air)
    steps = tuple(plan_footsteps(plan, neutral, style, side) for side in (LEFT, RIGHT))
    times = plan.times - _STRIDE_BEFORE
    posture = pose_upper_body(plan, neutral, style, 0)
    posture = _whip_trunk(posture, times) if heads else posture
    hips = posture.hips.copy()
    usual = float(np.mean(hips[np.abs(times) > air + 0.3, 2]))
    ease = compute_envelope(times, -air - 0.2, -air, air, air + 0.2)
    hips[:, 2] = blend_arrays(hips[:, 2], np.full(len(times), usual), ease)
    hips[:, 2] = compute_flight(times, hips[:, 2], -air, air)
    posture = plant_feet(posture.replace_arrays(hips=hips), plan.times, steps, neutral)
    motion = to_motion(posture.frames(plan.requested_slice), neutral)
    return Gesture(motion, _STRIDE_BEFORE, _STRIDE_BEFORE - air - 0.35, _STRIDE_BEFORE + air + 0.3)


def _stretch_flight(plan: GaitPlan, key: float, air: float) -> GaitPlan:
    """Stretch the phase so that the flight after the left foot's push at `key - air` lasts until `key + air`."""
    since = np.interp(key - air, plan.times, plan.phase)
    lands = np.ceil(since - 0.5 - 1e-6) + 0.5
    usual = np.interp(lands, plan.phase, plan.times)
    late = key + air - usual
    inside = np.clip((plan.times - (key - air)) / (2.0 * air), 0.0, 1.0)
    held = np.interp(plan.times - late, plan.times, plan.phase)
    phase = np.where(plan.times < key - air, plan.phase, np.where(plan.times > key + air, held,
                     since + (lands - since) * inside))
    return replace(plan, phase=hann_smooth(phase, int(0.03 / (plan.times[1] - plan.times[0]))))


def _whip_trunk(posture: Posture, times: np.ndarray) -> Posture:
    """Blend the header's trunk, head and arms over a run."""
    rate = 1.0 / (times[1] - times[0])

    def read(rows) -> np.ndarray:
        return np.radians(interpolate_rounded(rows, times, 0.02 * rate))

    ease, trunk, nothing = compute_envelope(times, -0.55, -0.3, 0.3, 0.75), read(_TRUNK), np.zeros(len(times))
    lean = {
        name: blend_arrays(getattr(posture, name), np.stack([nothing, trunk[:, column], nothing], -1), ease)
        for column, name in enumerate(("pelvis", "spine", "head"))
    }
    arms = posture.arms.copy()
    for side, rows in ((LEFT, _LEFT_ARM), (RIGHT, _RIGHT_ARM)):
        arms[:, side, :4] = blend_arrays(arms[:, side, :4], read(rows), ease)
    return posture.replace_arrays(arms=arms, **lean)
