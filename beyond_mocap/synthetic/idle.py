"""Synthetic waiting for a ball: knees and trunk bent, weight that shifts from foot to foot, and small steps in place.

Feet are planned first: each rests but for its steps, and the hips move over the other foot before it lifts.
"""

from __future__ import annotations

import numpy as np

from ..base.time_series import hann_smooth
from ..motion.motion import Motion
from ..motion.retargeting.adult import build_adult_skeleton
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.retargeting.posture import Posture, to_motion
from ..motion.skeleton import Skeleton
from . import gait_tables as tables
from .footsteps import Footsteps
from .gait_legs import plant_feet
from .gait_plan import GaitPlan
from .gestures import LEFT, RIGHT
from .moves import build_standing
from .steps import REST, build_steps_in_place

CROUCH = 0.042
"""Metres of an adult by which the hips are lower than usual in an athlete who expects a ball."""
_READY_DROP = 0.012  # m by which the hips are lower when ready for a ball than in standing
# at CROUCH, degrees: (list, tilt, turn) of pelvis, spine and head; (flexion, abduction, inward, elbow) of the arms
_CROUCHED = {"pelvis": (0.0, 6.0, 0.0), "spine": (0.0, 9.0, 0.0), "head": (0.0, -11.0, 0.0)}
_CROUCHED_ARMS = (8.0, 8.0, 6.0, 38.0)
_RISE = 0.45  # of the crouch that a body rises by now and then
_WIDER = 0.035  # m of an adult that each foot is further out at CROUCH
# steps in place: s of a swing, from one landing to the next lift, between two pairs of steps, and around a step in
# which its stances stay short so that rests stay flat; m of an adult that a foot moves ahead, and aside
_SWING, _BOTH_DOWN, _PAUSE, _FLAT, _STEP = 0.30, 0.12, (0.7, 1.9), 0.3, (0.06, 0.03)
_SHORT_REST = 0.4  # s of standing before and after steps that move or turn the body
_LONG = 1e3  # s before and after everything
_LIFT, _LIFT_PITCH = 0.07, np.radians(14.0)  # m of an adult and rad, toes down, of a foot in the middle of its step
_OVER_FOOT, _RESTING = 0.055, 0.028  # m of an adult that the hips are aside while a foot is up, and between steps


def build_idle(duration: float, skeleton: Skeleton | None = None, fps: float = 30.0, seed: int = 0,
               crouch: float = CROUCH) -> Motion:
    """Build waiting for a ball: the weight shifts from foot to foot, and the feet step in place now and then.

    Args:
        duration: s.
        skeleton: any humanoid skeleton; default: the project's adult.
        fps: frames per second.
        seed: of the variation.
        crouch: m of an adult by which the hips are lower.
    Returns:
        The motion.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton())
    gait_plan, posture = build_ready(neutral, duration, fps, seed, crouch)
    steps = _choose_steps(duration, np.random.default_rng(seed + 1))
    hips = posture.hips.copy()
    hips[:, 1] += _compute_weight_shift(gait_plan.times, steps) * neutral.leg / tables.LEG
    feet = tuple(_plan_foot(side, steps, neutral, crouch, np.random.default_rng([seed, side]))
                 for side in (LEFT, RIGHT))
    posture = plant_feet(posture.replace_arrays(hips=hips), gait_plan.times, feet, neutral)
    posture = _lift_feet(posture, gait_plan.times, steps, neutral)
    return to_motion(posture.frames(gait_plan.requested_slice), neutral)


def build_ready_steps(move: tuple[float, float], turn: float, fps: float = 30.0,
                      skeleton: Skeleton | None = None) -> Motion:
    """Build steps that move or turn a body that waits for a ball; it begins at the origin and faces +X.

    Args:
        move: m, ahead and to the left.
        turn: rad, left positive.
        fps: frames per second.
        skeleton: any humanoid skeleton; default: the project's adult.
    Returns:
        The motion.
    """
    neutral = build_neutral_stance(skeleton or build_adult_skeleton())
    posture = build_steps_in_place(move, turn, fps, neutral).posture
    spare = int((REST - _SHORT_REST) * fps)
    posture = posture.frames(slice(spare, len(posture) - spare))
    drop = np.array([0.0, 0.0, (_READY_DROP + CROUCH) * neutral.leg / tables.LEG])
    posture = posture.replace_arrays(hips=posture.hips - drop)
    return to_motion(_crouch_upper_body(posture, np.ones((len(posture), 1))), neutral)


def build_ready(neutral: NeutralStance, duration: float, fps: float, seed: int,
                crouch: float = 0.0) -> tuple[GaitPlan, Posture]:
    """Build the plan and posture of standing ready for a ball for `duration` s; the feet are not set yet."""
    gait_plan, _, posture = build_standing(neutral, duration, fps, seed)
    scale, times = neutral.leg / tables.LEG, gait_plan.times
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 3)
    sway = 0.020 * np.sin(2.0 * np.pi * times / 4.3 + phase[0]) + 0.008 * np.sin(2.0 * np.pi * times / 1.9 + phase[1])
    turn = np.radians(3.0) * np.sin(2.0 * np.pi * times / 5.1 + phase[2])
    nothing = np.zeros_like(times)
    depth = crouch * (1.0 - _RISE * (0.5 + 0.5 * np.sin(2.0 * np.pi * times / 5.7 + phase.sum())))
    hips = posture.hips + scale * np.stack([nothing, sway, nothing - _READY_DROP - depth], axis=-1)
    lean = np.stack([-1.5 * sway, nothing + np.radians(4.0), turn], axis=-1)
    spine = posture.spine + np.stack([1.5 * sway, nothing + np.radians(5.0), -0.5 * turn], axis=-1)
    head = posture.head + np.stack([nothing, nothing - np.radians(7.0), -0.5 * turn], axis=-1)
    posture = posture.replace_arrays(hips=hips, pelvis=posture.pelvis + lean, spine=spine, head=head)
    return gait_plan, _crouch_upper_body(posture, depth[:, None] / CROUCH) if crouch else posture


def plan_still_feet(neutral: NeutralStance, crouch: float = 0.0) -> tuple[Footsteps, Footsteps]:
    """Plan both feet of a body that stands ready, without a step."""
    left, right = (_plan_foot(side, [], neutral, crouch, np.random.default_rng(0)) for side in (LEFT, RIGHT))
    return left, right


def _crouch_upper_body(posture: Posture, share: np.ndarray) -> Posture:
    """Bend trunk and arms as an athlete who expects a ball does, by shares (T, 1)."""
    trunk = {name: getattr(posture, name) + share * np.radians(angles) for name, angles in _CROUCHED.items()}
    arms = posture.arms.copy()
    arms[..., :4] += share[:, None] * np.radians(_CROUCHED_ARMS)
    return posture.replace_arrays(arms=arms, **trunk)


def _choose_steps(duration: float, random: np.random.Generator) -> list[tuple[int, float]]:
    """Choose the steps: (side, s at which the foot lifts), one foot after the other, then a pause."""
    steps, lift, side = [], float(random.uniform(0.8, 1.4)), int(random.integers(2))
    while lift + 2.0 * _SWING + _BOTH_DOWN + 0.8 < duration:
        steps += [(side, lift), (1 - side, lift + _SWING + _BOTH_DOWN)]
        lift += 2.0 * _SWING + _BOTH_DOWN + float(random.uniform(*_PAUSE))
        side = 1 - side if random.random() < 0.6 else side
    return steps


def _compute_weight_shift(times: np.ndarray, steps: list[tuple[int, float]]) -> np.ndarray:
    """Compute how far to the left (T,) m of an adult the hips are: over the foot that stands, and rest over one."""
    shift = np.zeros(len(times))
    for side, lift in steps:
        away = -1.0 if side == LEFT else 1.0
        shift[times > lift - 0.15] = away * _OVER_FOOT
        shift[times > lift + _SWING] = -away * _RESTING
    return hann_smooth(shift, int(0.3 / (times[1] - times[0])))


def _lift_feet(posture: Posture, times: np.ndarray, steps: list[tuple[int, float]], neutral: NeutralStance) -> Posture:
    """Lift each foot in its steps, heel first: so small a step of a gait would hardly leave the ground."""
    ankles, feet = posture.ankles.copy(), posture.feet.copy()
    for side, lift in steps:
        up = np.sin(np.pi * np.clip((times - lift) / _SWING, 0.0, 1.0)) ** 2
        ankles[:, side, 2] += up * _LIFT * neutral.leg / tables.LEG
        feet[:, side, 1] += up * _LIFT_PITCH
    return posture.replace_arrays(ankles=ankles, feet=feet)


def _plan_foot(side: int, steps: list[tuple[int, float]], neutral: NeutralStance, crouch: float,
               random: np.random.Generator) -> Footsteps:
    """Plan the stances of one foot: it rests but for its own steps, and stays near its place."""
    scale, sign = neutral.leg / tables.LEG, 1.0 if side == LEFT else -1.0
    home = np.array([tables.interpolate_figure("ahead", 0.0),
                     sign * (0.5 * tables.interpolate_figure("width", 0.0) + _WIDER * crouch / CROUCH)])
    on, off, places = [-_LONG], [], [home]
    for lift in (lift for foot, lift in steps if foot == side):
        land = lift + _SWING
        off += [lift - _FLAT - 0.02, lift, land + _FLAT]
        on += [lift - _FLAT, land, land + _FLAT + 0.02]
        moved = home + random.uniform(-1.0, 1.0, 2) * _STEP
        places += [places[-1], moved, moved]
    on, off, places = [*on, _LONG + 1.0], [*off, _LONG, _LONG + 2.0], [*places, places[-1]]
    count = len(on)
    return Footsteps(side=side, on=np.array(on), off=np.array(off), place=scale * np.array(places),
                     yaw=np.full(count, sign * np.radians(tables.interpolate_figure("toe_out", 0.3))),
                     speed=np.full(count, 0.6), direction=np.zeros(count))
