"""Key poses of the whole body out of a run into a stand: dives, slides, falls and how players get up from them.

A run at the player's speed is blended into key poses, whose last ones are a stand. The path is that of the speeds; hips
and feet are given from it. In a flight the hips fall freely; where the body lies, it rests on the ground by its own
thickness (`lying`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ...motion import quaternion
from ...motion.motion import Motion
from ...motion.retargeting.neutral import NeutralStance
from ...motion.retargeting.posture import Posture, to_motion
from ...motion.supports import GRAVITY
from .. import gait_tables as tables
from ..footsteps import compute_ground_lift
from ..gait import build_posture, plan_footsteps
from ..gait_plan import GaitPlan, GaitStyle, plan_gait
from ..gestures import LEFT, RIGHT, Gesture, blend_arrays, compute_envelope, interpolate_rounded
from ..lying import compute_lowest_root, raise_arms, smooth_above
from ..moves import build_standing
from .action import ActionSetting
from .flight import apply_flight

_LEAD_SECONDS, _REST_SECONDS = 1.2, 0.8  # s of running or standing before the key poses, and of standing after them
_ROUNDING_SECONDS = 0.02  # s over which corners of the tables are rounded
_FOOT_EASE = 0.16  # s in which a foot passes from its step to the key poses
_PASSES = 3  # of fitting the height of a resting body, whose legs follow the hips
NO_ARM = (2, 10, 12, 16)
"""An arm that hangs: degrees of flexion, abduction, inward turn and elbow."""


@dataclass(frozen=True, kw_only=True)
class BodyPoses:
    """Key poses; seconds from the key moment, metres of an adult, degrees. Last rows are zero: standing.

    Attributes:
        speeds: rows (time, m/s) of the path.
        hips: rows (time, ahead, left, lowered) from standing at the path's place.
        pelvis: rows (time, list, tilt, turn).
        spine: rows (time, list, tilt, turn).
        head: rows (time, nod, turn).
        arms: of the left and of the right: rows (time, flexion, abduction, inward, elbow).
        feet: of the left and of the right: rows (time, ahead, left, up, pitch, yaw, roll) from standing.
        knees: rows (time, left, right), outward.
        rests: rows (time, share) of lying on the ground.
        begin: s from which on the run turns into the key poses, and at which only these are left.
        leaves: s at which the left and the right foot leave their last step.
        push: s in the run at which `pushing` ends a stance.
        pushing: 0 left, 1 right.
        flight: s of take-off and landing, or None.
        end: s at which the body stands.
    """

    speeds: tuple
    hips: tuple
    pelvis: tuple
    spine: tuple
    head: tuple
    arms: tuple[tuple, tuple]
    feet: tuple[tuple, tuple]
    begin: tuple[float, float]
    leaves: tuple[float, float]
    push: float
    end: float
    pushing: int = LEFT
    knees: tuple = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rests: tuple = ((0.0, 0.0), (1.0, 0.0))
    flight: tuple[float, float] | None = None


def build_body_poses(poses: BodyPoses, setting: ActionSetting) -> Gesture:
    """Build a movement from its key poses.

    Args:
        poses: the key poses.
        setting: for whom.
    Returns:
        The movement; it lasts from the key poses' beginning to their end.
    """
    key = _LEAD_SECONDS - poses.begin[0]
    frames = int(round((key + poses.end + _REST_SECONDS) * setting.fps)) + 1
    times = np.arange(frames) / setting.fps - key
    run, plan = _build_run(poses, setting, times, key)
    posture = _blend_poses(poses, setting, times, run, plan)
    motion = _rest_on_ground(poses, setting, times, posture)
    return Gesture(motion, key, key + poses.begin[0], key + poses.end)


def _build_run(poses: BodyPoses, setting: ActionSetting, times: np.ndarray, key: float) -> tuple[Posture, np.ndarray]:
    """Build the run (or stand) with the poses' speeds at seconds `times`, and its path (T, 2) m, 0 at the key."""
    style = GaitStyle(life=0.3)
    rows = np.array(poses.speeds)
    speed = np.interp(times, rows[:, 0], rows[:, 1])
    plan = plan_gait(speed, None, setting.fps, setting.neutral, style=style)
    plan = set_push(plan, key + poses.push, poses.pushing)
    steps = tuple(plan_footsteps(plan, setting.neutral, style, side) for side in (LEFT, RIGHT))
    run = build_posture(plan, steps, setting.neutral, style, 0).frames(plan.requested_slice)
    path = plan.path[plan.requested_slice]
    origin = path[int(np.argmin(np.abs(times)))]
    shift = np.array([*origin, 0.0])
    return run.replace_arrays(hips=run.hips - shift, ankles=run.ankles - shift), path - origin


def set_push(plan: GaitPlan, moment: float, side: int) -> GaitPlan:
    """Shift a plan's phase so that a foot leaves the ground at a moment.

    Args:
        plan: the plan.
        moment: s.
        side: 0 left, 1 right.
    Returns:
        The plan with its phase shifted.
    """
    duty = float(tables.interpolate_figure("duty", np.interp(moment, plan.times, plan.adult_speed)))
    wanted = duty + 0.5 * side
    return replace(plan, phase=plan.phase + wanted - np.interp(moment, plan.times, plan.phase))


def _blend_poses(poses: BodyPoses, setting: ActionSetting, times: np.ndarray, run: Posture,
                 path: np.ndarray) -> Posture:
    """Blend key poses over the run; the stand that they end in has its feet side by side."""
    scale, rounding = setting.scale, _ROUNDING_SECONDS * setting.fps
    stand = build_still_stand(setting, len(times))

    def read(rows) -> np.ndarray:
        return interpolate_rounded(rows, times, rounding)

    place = np.column_stack([path, np.zeros(len(times))])
    ease = compute_envelope(times, *poses.begin, 1e3, 2e3)
    hips = stand.hips + place + scale * read(poses.hips) * [1.0, 1.0, -1.0]
    head = np.radians(read(poses.head))
    nothing = np.zeros(len(times))
    parts = {
        "hips": hips, "heading": nothing, "knees": np.radians(read(poses.knees)),
        "pelvis": np.radians(read(poses.pelvis)),
        "spine": np.radians(read(poses.spine)) + stand.spine, "head": stand.head + np.column_stack([nothing, head]),
        "arms": np.stack([_pose_arm(stand, read(rows), side) for side, rows in enumerate(poses.arms)], axis=1),
    }
    blended = {name: blend_arrays(getattr(run, name), values, ease) for name, values in parts.items()}
    if poses.flight is not None:
        blended["hips"][:, 2] = compute_flight(times, blended["hips"][:, 2], *poses.flight)
    ankles, feet, toes = run.ankles.copy(), run.feet.copy(), run.toes.copy()
    for side, leaves in enumerate(poses.leaves):
        own = compute_envelope(times, leaves, leaves + _FOOT_EASE, 1e3, 2e3)
        rows = read(poses.feet[side])
        angles = stand.feet[:, side] + np.radians(rows[:, [5, 3, 4]])
        target = stand.ankles[:, side] + place + scale * rows[:, :3]
        target[:, 2] += compute_ground_lift(target[:, 2], angles[:, 1], setting.neutral) * (rows[:, 3] != 0.0)
        ankles[:, side] = blend_arrays(ankles[:, side], target, own)
        feet[:, side] = blend_arrays(feet[:, side], angles, own)
        toes[:, side] = toes[:, side] * (1.0 - own)
    posture = run.replace_arrays(ankles=ankles, feet=feet, toes=toes, **blended)
    if poses.flight is None:
        return posture
    # the limbs swing about the hips, and what falls freely is the centre of mass
    return apply_flight(posture, times, poses.flight, setting.neutral, lands_on_feet=False)


def build_still_stand(setting: ActionSetting, count: int) -> Posture:
    """Build a stand without any life, `count` frames of one posture."""
    return _build_still_frame(setting.neutral, setting.fps).frames(np.zeros(count, int))


@lru_cache(maxsize=4)
def _build_still_frame(neutral: NeutralStance, fps: float) -> Posture:
    """Build one frame of standing; it takes as long as a whole action."""
    plan, _, stand = build_standing(neutral, 1.0, fps, 0)
    return stand.frames(slice(plan.pad, plan.pad + 1))


def _pose_arm(stand: Posture, rows: np.ndarray, side: int) -> np.ndarray:
    """Build an arm (T, 5) rad from rows (T, 4) degrees."""
    return np.column_stack([np.radians(rows), stand.arms[:, side, 4]])


def compute_flight(times: np.ndarray, height: np.ndarray, take_off: float, landing: float) -> np.ndarray:
    """Compute heights that fall freely between take-off and landing.

    Before and after, over as long as the flight lasts at most, they lead smoothly into it.

    Args:
        times: (T,) s.
        height: (T,) m as planned; kept at take-off and landing.
        take_off: s.
        landing: s.
    Returns:
        (T,) m.
    """
    from scipy.interpolate import CubicSpline

    low, high = np.interp([take_off, landing], times, height)
    length = landing - take_off
    rise = (high - low) / length + 0.5 * GRAVITY * length
    since = times - take_off
    free = low + rise * since - 0.5 * GRAVITY * since**2
    out = np.where((times >= take_off) & (times <= landing), free, height)
    reach = min(0.25, length)
    for edge, value, slope, sign in ((take_off, low, rise, -1.0), (landing, high, rise - GRAVITY * length, 1.0)):
        far = edge + sign * reach
        inside = (times - edge) * sign > 0.0
        inside &= (times - far) * sign < 0.0
        start, own = np.interp([far, far + 0.02], times, height)
        ends = sorted(((edge, value, slope), (far, start, (own - start) / 0.02)))
        curve = CubicSpline([end[0] for end in ends], [end[1] for end in ends],
                            bc_type=((1, ends[0][2]), (1, ends[1][2])))
        out[inside] = curve(times[inside])
    return out


def _rest_on_ground(poses: BodyPoses, setting: ActionSetting, times: np.ndarray, posture: Posture) -> Motion:
    """Convert to a motion that rests on the ground where the body lies, with nothing below it."""
    share = np.clip(interpolate_rounded(poses.rests, times, _ROUNDING_SECONDS * setting.fps)[:, 0], 0.0, 1.0)
    motion = to_motion(posture, setting.neutral)
    for _ in range(_PASSES if share.any() else 0):
        above = motion.root_positions[:, 2] - compute_lowest_root(motion.skeleton, motion.rotations, arms=False)
        lowered = np.where(above > 0.0, share * above, 0.0) - smooth_above(np.maximum(-above, 0.0), setting.fps)
        posture = posture.replace_arrays(hips=posture.hips - np.outer(lowered, [0.0, 0.0, 1.0]))
        motion = to_motion(posture, setting.neutral)
    if not share.any():
        return motion
    rotations = raise_arms(motion.skeleton, motion.root_positions, motion.rotations, motion.fps)
    return replace(motion, rotations=quaternion.unify_signs(rotations))
