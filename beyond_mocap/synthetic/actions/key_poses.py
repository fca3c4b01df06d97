"""Actions of the whole body as tables of key poses, laid over standing or over a gait.

A `KeyPoses` has one table per part of the body, with seconds from the key moment, so that an action is read and changed
like a dope sheet. `build_key_poses` lays it over the body's own standing or gait and then keeps what physics says: a
flight's centre of mass follows a parabola (`flight`), nothing is below the ground, hands that hold a ball are as far
apart as it is wide (`ball_hands`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ...base.easing import smoothstep
from ...motion import quaternion
from ...motion.motion import Motion
from ...motion.retargeting.adult import build_adult_skeleton
from ...motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ...motion.retargeting.posture import Posture, to_motion
from ...motion.skeleton import Skeleton
from .. import gait_tables as tables
from ..footsteps import roll_foot
from ..gait import build_gait_posture
from ..gait_plan import GaitStyle, plan_gait
from ..gestures import LEFT, RIGHT, Gesture, blend_arrays, compute_envelope, interpolate_rounded, interpolate_rows
from .ball_hands import hold_ball
from .flight import apply_flight
from .ground import keep_above_ground, lower_hips, raise_hips

Rows = tuple[tuple[float, ...], ...]
REST_ARM = (2, 9, 12, 16, 0)
"""Degrees of an arm that hangs: a row of arms without its time."""
_ROUNDING_SECONDS = 0.02  # s over which corners of the tables are rounded
_LEAST_HELD = 0.3  # s in which an action that lasts is wholly shown
_FOOT_DOWN = 0.004  # m above the ground up to which a foot stands on it
_RESTING_FOOT: Rows = ((0.0,) * 7, (1.0,) + (0.0,) * 6)
# rad of pitch between which a foot tips from its toes onto its instep, and of roll between which it lies on its side
_INSTEP_DOWN, _ON_SIDE = np.radians([95.0, 125.0]), np.radians([20.0, 60.0])


@dataclass(frozen=True, kw_only=True)
class KeyPoses:
    """An action; seconds from the key moment, metres of an adult, degrees. Tables that are left out change nothing.

    Places are relative to where the body would stand or walk without the action, and along its heading.

    Attributes:
        labels: labels of the vocabulary.
        span: seconds in which the action shows: begin, fully there, fades, end.
        meets: lowest and highest m of the ball that it can meet.
        is_span: whether it lasts instead of having a key moment.
        margin: seconds of standing or walking before and after.
        speeds: rows (time, m/s) of the gait below.
        turns: rows (time, degrees per second) of its heading.
        direction: degrees of its travel relative to the heading.
        hips: rows (time, ahead, left, up).
        pelvis: rows (time, list, tilt, turn); list to the right and tilt forward are positive.
        spine: rows (time, list, tilt, turn).
        head: rows (time, list, nod, turn).
        arms: rows (time, flexion, abduction, inward, elbow, palm) of both arms.
        left_arm, right_arm: rows of one arm, where they differ.
        wrists: rows (time, flexion) of both hands.
        left_foot, right_foot: rows (time, ahead, left, up, pitch, yaw, roll); up is that of the toes when the heel is
            raised.
        knees: rows (time, outward turn of both knees).
        feet_span: as `span`, for the feet of a body that walks or runs before and after; None: always.
        flights: seconds of take-off and landing of each flight.
        lies: seconds between which the body lies or rolls on the ground.
        hold: rows (time, share, m between both hands' joints): hands that meet around a ball.
        needs: labels that a request has to name (`Action`).
        varies: name of the action beside which it is offered (`Action`).
        style: of the gait below.
    """

    labels: str
    span: tuple[float, float, float, float]
    meets: tuple[float, float] = (-np.inf, np.inf)
    is_span: bool = False
    margin: tuple[float, float] = (0.6, 0.8)
    speeds: Rows = ((0.0, 0.0), (1.0, 0.0))
    turns: Rows = ((0.0, 0.0), (1.0, 0.0))
    direction: float = 0.0
    hips: Rows | None = None
    pelvis: Rows | None = None
    spine: Rows | None = None
    head: Rows | None = None
    arms: Rows | None = None
    left_arm: Rows | None = None
    right_arm: Rows | None = None
    wrists: Rows | None = None
    left_foot: Rows | None = None
    right_foot: Rows | None = None
    knees: Rows | None = None
    feet_span: tuple[float, float, float, float] | None = None
    flights: tuple[tuple[float, float], ...] = ()
    lies: tuple[float, float] | None = None
    hold: Rows | None = None
    needs: str = ""
    varies: str = ""
    style: GaitStyle = GaitStyle(life=0.6)

    @property
    def can_last(self) -> bool:
        """Whether it can be shown for any time: a body that flies or lies does so for as long as physics says."""
        return self.is_span and not self.flights and self.lies is None


def build_key_poses(
    recipe: KeyPoses, skeleton: Skeleton | None = None, fps: float = 60.0, seed: int = 0, *,
    example: Motion | None = None, seconds: float | None = None,
) -> Gesture:
    """Build an action; the body begins at the origin and faces +X.

    Args:
        recipe: the action.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the variation of standing and walking.
        example: a recording on `skeleton`, for its neutral stance.
        seconds: s until an action that `can_last` fades; None: as its tables have it.
    Returns:
        The action.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton(), example)
    key = recipe.margin[0] - recipe.span[0]
    longer = 0.0 if seconds is None else _compute_longer(recipe, seconds)
    count = int(round((key + recipe.span[3] + longer + recipe.margin[1]) * fps)) + 1
    times = _hold_times(recipe, np.arange(count) / fps - key, longer)
    posture, place = _build_base(recipe, times, fps, neutral, seed)
    posture = _lay_upper_body(posture, recipe, times)
    posture = _lay_feet(posture, recipe, times, place, neutral)
    for flight in recipe.flights:
        posture = apply_flight(posture, times, flight, neutral, lands_on_feet=not _is_lying(recipe, flight[1]))
    posture = raise_hips(posture, neutral)
    motion = to_motion(posture, neutral)
    if recipe.lies is not None:
        motion = keep_above_ground(motion, compute_envelope(times, *_widen(recipe.lies)))
    if recipe.hold is not None:
        motion = hold_ball(motion, interpolate_rows(recipe.hold, times), neutral)
    end = recipe.span[2] if recipe.can_last else recipe.span[3]
    return Gesture(motion, key, key + recipe.span[0], key + end + longer)


def _compute_longer(recipe: KeyPoses, seconds: float) -> float:
    """Compute the s by which an action is shown longer than its tables say, so that it lasts a number of seconds."""
    begin, full, fades, _ = recipe.span
    return max(seconds - (fades - begin), _LEAST_HELD - (fades - full))


def _hold_times(recipe: KeyPoses, times: np.ndarray, longer: float) -> np.ndarray:
    """Convert times (T,) s to those of the tables: what is wholly shown goes to and fro while the action lasts longer.
    """
    full, fades = recipe.span[1:3]
    own, held = fades - full, fades - full + longer
    passes = max(2 * round(0.5 * (held / own - 1.0)) + 1, 1)  # odd: it ends where it fades
    phase = np.clip((times - full) / held, 0.0, 1.0) * passes
    to_and_fro = 1.0 - np.abs(phase % 2.0 - 1.0)
    return np.where(times < full, times, np.where(times > full + held, times - longer, full + own * to_and_fro))


def _is_lying(recipe: KeyPoses, time: float) -> bool:
    return recipe.lies is not None and recipe.lies[0] <= time + 0.2 and time <= recipe.lies[1]


def _widen(span: tuple[float, float]) -> tuple[float, float, float, float]:
    return span[0] - 0.05, span[0], span[1], span[1] + 0.3


def _build_base(recipe: KeyPoses, times: np.ndarray, fps: float, neutral: NeutralStance, seed: int):
    """Build the gait below an action, and its places: (T, 2) m on the ground, before the body sways."""
    speeds = np.maximum(interpolate_rows(recipe.speeds, times)[:, 0], 0.0) * np.sqrt(neutral.leg / tables.LEG)
    turns = np.radians(interpolate_rows(recipe.turns, times)[:, 0])
    plan = plan_gait(speeds, None, fps, neutral, turn_rate=turns, direction=np.radians(recipe.direction),
                     style=recipe.style, seed=seed)
    return build_gait_posture(plan, neutral, recipe.style, seed), plan.path[plan.requested_slice]


def _lay_upper_body(posture: Posture, recipe: KeyPoses, times: np.ndarray) -> Posture:
    """Lay trunk, head, arms and hands over a posture."""
    ease, frames = compute_envelope(times, *recipe.span), _ROUNDING_SECONDS * posture.fps

    def lay(base: np.ndarray, rows: Rows | None) -> np.ndarray:
        """Blend the first columns of `base` (T, C) to a table's."""
        if rows is None:
            return base
        values = np.radians(interpolate_rounded(rows, times, frames))
        out = base.copy()
        out[:, : values.shape[1]] = blend_arrays(base[:, : values.shape[1]], values, ease)
        return out

    arms = np.stack([lay(posture.arms[:, side], own or recipe.arms)
                     for side, own in ((LEFT, recipe.left_arm), (RIGHT, recipe.right_arm))], axis=1)
    wrists = np.stack([lay(posture.wrists[:, [side]], recipe.wrists)[:, 0] for side in (LEFT, RIGHT)], axis=1)
    knees = np.stack([lay(posture.knees[:, [side]], recipe.knees)[:, 0] for side in (LEFT, RIGHT)], axis=1)
    return posture.replace_arrays(
        pelvis=lay(posture.pelvis, recipe.pelvis), spine=lay(posture.spine, recipe.spine),
        head=lay(posture.head, recipe.head), arms=arms, wrists=wrists, knees=knees,
    )


def _lay_feet(posture: Posture, recipe: KeyPoses, times: np.ndarray, place: np.ndarray,
              neutral: NeutralStance) -> Posture:
    """Move hips and feet of a posture through their tables."""
    scale = neutral.leg / tables.LEG
    ease = np.ones(len(times)) if recipe.feet_span is None else compute_envelope(times, *recipe.feet_span)
    hips = posture.hips.copy()
    if recipe.feet_span is not None:  # a body that kneels or slides does not bounce with the gait below it
        hips = blend_arrays(hips, np.column_stack([place, np.full(len(hips), hips[-1, 2])]), ease)
    if recipe.hips is not None:
        moved = scale * interpolate_rounded(recipe.hips, times, _ROUNDING_SECONDS * posture.fps)
        hips += quaternion.rotate(quaternion.from_up_angle(posture.heading), moved)
    posture = posture.replace_arrays(hips=hips)
    rest = None if np.any(np.array(recipe.speeds)[:, 1]) else _RESTING_FOOT
    is_down = np.zeros((len(times), 2), bool)
    for side, rows in ((LEFT, recipe.left_foot or rest), (RIGHT, recipe.right_foot or rest)):
        if rows is not None:
            values = interpolate_rows(rows, times)
            posture = _lay_foot(posture, side, values, ease, place=place, neutral=neutral)
            is_down[:, side] = (values[:, 2] < _FOOT_DOWN) & (ease == 1.0)
    return lower_hips(posture, is_down, neutral)


def _lay_foot(posture: Posture, side: int, rows: np.ndarray, ease: np.ndarray, place: np.ndarray,
              neutral: NeutralStance) -> Posture:
    """Move one foot through its rows (T, 6); on the ground it rolls over its ball without sliding."""
    scale, sign = neutral.leg / tables.LEG, 1.0 if side == LEFT else -1.0
    pitch, yaw, roll = np.radians(rows[:, 3:]).T
    yaw = yaw + sign * np.radians(tables.interpolate_figure("toe_out", 0.0)) + posture.heading
    stand = [tables.interpolate_figure("ahead", 0.0), sign * 0.5 * tables.interpolate_figure("width", 0.0)]
    # standing on the toes or swinging; a foot on its instep or its side does not roll
    upright = (1.0 - smoothstep(pitch, *_INSTEP_DOWN)) * (1.0 - smoothstep(np.abs(roll), *_ON_SIDE))
    rolls = np.clip(pitch, np.radians(-30.0), np.radians(90.0)) * upright
    tip = 0.6 * np.maximum(rolls - np.radians(42.0), 0.0)
    ahead, up = roll_foot(rolls, tip, neutral, side)
    level = quaternion.rotate_level(scale * (rows[:, :2] + stand), posture.heading) + place
    level = level + ahead[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    ankle = np.column_stack([level, scale * rows[:, 2] + up])
    bend = np.maximum(rolls, 0.0) - tip
    ankles, feet, toes = posture.ankles.copy(), posture.feet.copy(), posture.toes.copy()
    ankles[:, side] = blend_arrays(ankles[:, side], ankle, ease)
    feet[:, side] = blend_arrays(feet[:, side], np.stack([roll, pitch, yaw], axis=-1), ease)
    toes[:, side] = blend_arrays(toes[:, side], bend, ease)
    return posture.replace_arrays(ankles=ankles, feet=feet, toes=toes)


def retime_flight(recipe: KeyPoses, half: float) -> KeyPoses:
    """Retime an action whose key moment is the middle of its flight, for a higher or lower jump.

    Args:
        recipe: the action; it has one flight.
        half: s from take-off to the key moment.
    Returns:
        The action: its tables are stretched in the flight and moved before and after it.
    """
    own = recipe.flights[0][1]

    def retime(time: float) -> float:
        return time * half / own if abs(time) <= own else time + float(np.sign(time)) * (half - own)

    moved: dict[str, Any] = {
        field.name: tuple((retime(row[0]), *row[1:]) for row in rows) for field in fields(recipe)
        if field.type == "Rows | None" and (rows := getattr(recipe, field.name)) is not None
    }
    return replace(recipe, flights=((-half, half),), **{**moved, "span": tuple(map(retime, recipe.span))})


def mirror_foot(rows: Rows) -> Rows:
    """Mirror the rows of one foot to the other one."""
    return tuple((time, ahead, -left, up, pitch, -yaw, -roll) for time, ahead, left, up, pitch, yaw, roll in rows)
