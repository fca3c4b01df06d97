"""Steps that recordings lack: side steps whose feet cross, and a step or a turn out of a stand back into one.

Feet are planned first, as for every synthetic gait (`footsteps`): each stands where the body is in the middle of its
stance. Going sideways with crossing feet, the trailing leg passes ahead of the other one while the pelvis turns with
it. `gait.build_gait` itself goes sideways without crossing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.easing import quintic_step
from ..base.time_series import hann_smooth
from ..motion import quaternion
from ..motion.retargeting.neutral import NeutralStance
from ..motion.retargeting.posture import Posture
from . import gait_tables as tables
from .footsteps import Footsteps
from .gait import build_upper_posture, plan_footsteps
from .gait_legs import plant_feet
from .gait_plan import GaitPlan, GaitStyle, plan_gait
from .gait_tables import interpolate_figure

LEFT, RIGHT = 0, 1
PEAK_TURN_RATE = np.radians(140.0)  # rad/s of a turn on the spot
# crossing: m that the trailing foot is ahead of the leading one, widths of the base against those of feet that do not
# cross, longer steps than without crossing, and rad by which the pelvis turns with the legs
_CROSS_AHEAD, _CROSS_WIDTH, _CROSS_CADENCE, _CROSS_TURN = 0.34, 0.25, 0.80, np.radians(20.0)
REST = 2.5
"""Seconds of a stand before the first step and after the last one: so a search holds a clip longer than its steps."""
# s: the part of the rest that is planned, a swing, and from one landing to the next lift
_PLANNED_REST, _SWING, _BOTH_DOWN = 0.5, 0.38, 0.10
_MOST_TURN_OF_TWO_STEPS = np.radians(100.0)
_SWAY = 0.045  # m that an adult's hips move over the standing foot
_QUINTIC_PEAK = 1.875  # largest slope of `quintic_step`
_LONG_AGO = 20.0  # s


@dataclass(frozen=True, eq=False)
class StepSequence:
    """A synthetic movement of the legs.

    Attributes:
        posture: T frames.
        phase: (T,) strides: the left foot lands at whole numbers, the right one half a stride later; 0 where the body
            only stands and steps.
    """

    posture: Posture
    phase: np.ndarray


def build_side_walk(speed: float, direction: float, duration: float, fps: float, neutral: NeutralStance,
                    crosses: bool = False) -> StepSequence:
    """Build a steady walk of a body that faces +X and goes to its left, or diagonally.

    Args:
        speed: m/s.
        direction: rad, of travel relative to the heading.
        duration: s.
        fps: frames per second.
        neutral: neutral stance of the body.
        crosses: the right foot passes ahead of the left one, for a body that goes to its left; else they only close up.
    Returns:
        The movement.
    """
    style = GaitStyle(cadence=_CROSS_CADENCE if crosses else 1.0, life=0.0)
    plan = plan_gait(speed, duration, fps, neutral, direction=direction, style=style)
    steps = tuple(plan_footsteps(plan, neutral, style, side) for side in (LEFT, RIGHT))
    if crosses:
        steps = tuple(_cross_foot(one, plan, neutral) for one in steps)
    posture = build_upper_posture(plan, neutral, style, seed=0)
    if crosses:
        turn = -_CROSS_TURN * np.cos(2.0 * np.pi * plan.phase)[:, None] * [0.0, 0.0, 1.0]
        posture = posture.replace_arrays(pelvis=posture.pelvis + turn, spine=posture.spine - turn)
    posture = plant_feet(posture, plan.times, steps, neutral)
    return StepSequence(posture.frames(plan.requested_slice), plan.phase[plan.requested_slice])


def _cross_foot(steps: Footsteps, plan: GaitPlan, neutral: NeutralStance) -> Footsteps:
    """Move the stances of one foot of a body that goes to its left: nearer to its path, and ahead or behind."""
    scale, middle = neutral.leg / tables.LEG, 0.5 * (steps.on + steps.off)
    path = np.interp(middle, plan.times, plan.path[:, 1])
    ahead = 0.5 * _CROSS_AHEAD * scale * (1.0 if steps.side == RIGHT else -1.0)
    place = np.stack([steps.place[:, 0] + ahead, path + _CROSS_WIDTH * (steps.place[:, 1] - path)], axis=-1)
    return replace(steps, place=place)


def build_steps_in_place(move: tuple[float, float], turn: float, fps: float, neutral: NeutralStance) -> StepSequence:
    """Build a stand, some steps that move or turn the body, and a stand; it begins at the origin and faces +X.

    Args:
        move: m, ahead and to the left.
        turn: rad, left positive.
        fps: frames per second.
        neutral: neutral stance of the body.
    Returns:
        The movement; the foot on the side to which it goes steps first.
    """
    count = 2 * max(1, int(np.ceil(abs(turn) / _MOST_TURN_OF_TWO_STEPS)))
    lifts = _PLANNED_REST + (_SWING + _BOTH_DOWN) * np.arange(count)
    first = RIGHT if move[1] < 0.0 or turn < 0.0 else LEFT
    begin = lifts[0] - 0.1
    seconds = max(lifts[-1] + _SWING + 0.05 - begin, _QUINTIC_PEAK * abs(turn) / PEAK_TURN_RATE)
    plan = plan_gait(0.0, round((begin + seconds + _PLANNED_REST) * fps) / fps, fps, neutral, style=GaitStyle(life=0.0))

    def place_body(times):
        """Path (N, 2) m and heading (N,) rad at seconds `times`."""
        share = quintic_step((times - begin) / seconds)
        return share[:, None] * np.asarray(move), share * turn

    swings = [((first + k) % 2, lift) for k, lift in enumerate(lifts)]
    direction = np.pi / 2.0 if turn else np.arctan2(move[1], move[0])
    steps = tuple(_plan_swings(side, [lift for s, lift in swings if s == side], place_body, direction, neutral)
                  for side in (LEFT, RIGHT))
    posture = build_upper_posture(plan, neutral, GaitStyle(life=0.0), seed=0)
    path, heading = place_body(plan.times)
    hips = posture.hips.copy()
    hips[:, :2] = path + quaternion.rotate_level(_compute_sway(plan.times, swings, neutral), heading)
    posture = plant_feet(posture.replace_arrays(hips=hips, heading=heading), plan.times, steps, neutral)
    posture = posture.frames(plan.requested_slice)
    longer = int((REST - _PLANNED_REST) * fps)
    posture = posture.frames(np.clip(np.arange(-longer, len(posture) + longer), 0, len(posture) - 1))
    return StepSequence(posture, np.zeros(len(posture)))


def _plan_swings(side: int, lifts: list[float], place_body, direction: float, neutral: NeutralStance) -> Footsteps:
    """Plan the stances of a foot that rests but for swings that begin at seconds `lifts`."""
    scale, sign = neutral.leg / tables.LEG, 1.0 if side == LEFT else -1.0
    lands = [lift + _SWING for lift in lifts]
    # a stance rolls by shares of its time: short stances at the same place around the steps keep long rests flat
    rolls = [lifts[0] - 0.5, lands[-1] + 0.5] if lifts else []
    on = [-_LONG_AGO, *rolls[:1], *lands, *rolls[1:], _LONG_AGO]
    off = [on[1] - 0.02, *lifts, *[at - 0.02 for at in on[len(lifts) + 2 :]], 2.0 * _LONG_AGO]
    on, off = np.array(on), np.array(off)
    middle = 0.5 * (on + off)
    if lifts:
        middle[:2], middle[len(lifts) + 1 :] = -_LONG_AGO, _LONG_AGO
    path, heading = place_body(middle)
    offset = np.array([tables.interpolate_figure("ahead", 0.0), sign * 0.5 * interpolate_figure("width", 0.0)]) * scale
    toe_out = sign * np.radians(interpolate_figure("toe_out", 0.3))
    count = len(on)
    return Footsteps(side=side, on=on, off=off, place=path + quaternion.rotate_level(np.tile(offset, (count, 1)),
                     heading), yaw=heading + toe_out, speed=np.full(count, 0.6), direction=np.full(count, direction))


def _compute_sway(times: np.ndarray, swings: list[tuple[int, float]], neutral: NeutralStance) -> np.ndarray:
    """Compute how far ahead and to the left (T, 2) m the hips move over the foot that stands."""
    left = np.zeros(len(times))
    for side, lift in swings:
        left += np.where((times > lift - 0.12) & (times < lift + _SWING), -1.0 if side == LEFT else 1.0, 0.0)
    left = hann_smooth(left, int(0.22 / (times[1] - times[0])))
    return np.stack([0.0 * left, _SWAY * neutral.leg / tables.LEG * left], axis=-1)
