"""Kicks on the run: a kicker's swing, recorded or synthetic, laid onto the legs of a run.

The run is planned for the kick: the last stride is long, the plant foot lands beside the ball about a tenth of a second
before the contact, the other foot returns to the ground late. Pelvis, trunk, arms and the kicking leg are those of a
kick; the plant leg reaches from that pelvis to the plant foot.

Times, places and the braking of the body follow Lees, Asai, Andersen, Nunome and Sterzing 2010 (J Sports Sci 28,
805-817: long last stride, plant foot 0.05 to 0.1 m beside the ball's edge, that is 0.25 to 0.35 m from the kicking
ankle, and about level with it) and Nunome, Asai, Ikegami and Sakurai 2002 (Med Sci Sports Exerc 34, 2028-2036: plant
foot down 0.1 to 0.12 s before the contact).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..motion import quaternion
from ..motion.foot_plant import plant_feet as lift_feet
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import Motion, compute_pose, sample_frames_cubic
from ..motion.plant_place import measure_plant_place
from ..motion.retargeting.neutral import NeutralStance
from ..motion.retargeting.posture import Posture, to_motion
from ..motion.retargeting.structure import list_descendants
from . import gait_tables as tables
from .footsteps import Footsteps
from .gait import build_upper_posture, plan_footsteps
from .gait_legs import plant_feet
from .gait_plan import GaitPlan, GaitStyle, plan_gait
from .gestures import LEFT, RIGHT, Gesture, compute_envelope
from .kick_styles import KICK_STYLES
from .kicks import BEFORE, build_kick

APPROACH_SECONDS, RUN_OUT_SECONDS = 1.25, 1.1
"""Seconds before and after the contact: three steps, and two that run out."""

_SLOWEST, _FASTEST = 2.0, 7.5  # m/s between which the times below are interpolated
_PLANT_SECONDS = (0.12, 0.085)  # s from the plant foot's landing to the contact, at those speeds
_RETURN_SECONDS = (0.42, 0.38)  # s from the contact to the kicking foot's landing
_LAST_STRIDE = 1.12  # factor on the duration of the last step before the plant foot lands
_SPEEDS = ((-0.6, 1.0), (-0.2, 1.04), (0.0, 0.84), (0.2, 0.88), (0.6, 1.0))  # share of the run's speed: it brakes
# m of an adult, limits of the plant foot's place from the kicking ankle at the contact, as the body faces
_AHEAD, _BESIDE = (0.03, 0.14), (0.26, 0.33)
# shares of the leg by which the plant foot lands ahead of the hips, a long last stride, and leaves behind them
_LONGEST_REACH, _LONGEST_BEHIND = 0.58, 0.62
_MOST_EARLIER = 0.018  # s by which a swing meets the ball earlier in a fast run, whose hips pass the ball sooner
_PLANT_YAW = 0.7  # share of the kick's direction to which the plant foot points
_FLAT_STANCE = 2.0  # m/s of the gait whose foot rolls as the plant foot does: heel first, then flat for long
_BODY = (-0.42, -0.18, 0.22, 0.55)  # s from the contact between which pelvis, trunk and arms are the kick's
_LEG_IN, _LEG_OUT = (0.02, 0.12), 0.24  # s after the foot leaves the ground, and after the contact: the leg is
_MARGIN = 30  # frames before and after that are planned, too, so that swings which cross the ends are known
_SPEED_SECONDS = 1.0 / 60.0  # s before and after a moment between which a speed is measured


@dataclass(frozen=True, eq=False, kw_only=True)
class Swing:
    """A right foot's kick.

    Attributes:
        motion: the kick.
        contact: fractional frame at which the foot meets the ball.
    """

    motion: Motion
    contact: float


@dataclass(frozen=True, eq=False, kw_only=True)
class _SwingPoses:
    """A swing as seen from a run along +X, at T moments.

    Attributes:
        rotations: (T, J, 4) local.
        pelvis: (T, 4) rotation relative to the neutral stance.
        height: (T,) m of the middle between the hip joints.
        ankle: (T, 3) m, the kicking ankle from that middle.
        plant: (2,) m, the plant foot from the kicking ankle at the contact.
    """

    rotations: np.ndarray
    pelvis: np.ndarray
    height: np.ndarray
    ankle: np.ndarray
    plant: np.ndarray


def build_swing(kind: str, neutral: NeutralStance, rate: float = 1.0, lift: float = 0.0) -> Swing:
    """Build a swing from published kinematics, for a library without a kick.

    Args:
        kind: one of `kick_styles.KICK_STYLES`.
        neutral: neutral stance of the body.
        rate: playback rate: slower swings for softer kicks.
        lift: metres of an adult by which the foot is guided higher at the contact.
    """
    motion = build_kick(KICK_STYLES[kind], neutral, lift=lift, rate=rate)
    return Swing(motion=motion, contact=BEFORE / rate * motion.fps)


def measure_foot_speed(swing: Swing) -> float:
    """Measure how fast the kicking ankle moves against the pelvis at the contact, m/s."""
    body = identify_joints(swing.motion.skeleton)
    places = compute_places(swing, np.array([-_SPEED_SECONDS, _SPEED_SECONDS]))
    apart = places[:, body.right.foot] - places[:, body.hips]
    return float(np.linalg.norm(apart[1] - apart[0]) / (2.0 * _SPEED_SECONDS))


def measure_plant_foot(swing: Swing) -> np.ndarray:
    """Measure the plant foot's place (2,) m at the contact, from the kicking ankle: ahead as the body faces, and left.
    """
    return measure_plant_place(swing.motion.skeleton, compute_places(swing, np.zeros(1))[0], "right")


def build_running_kick(
    swing: Swing, speed: float, neutral: NeutralStance, *, direction: float = 0.0, rate: float = 1.0, fps: float = 60.0,
    style: GaitStyle = GaitStyle(),
) -> Gesture:
    """Build a kick of the right foot in a run along +X, which runs on.

    Args:
        swing: the kick that is laid onto the run.
        speed: m/s of the run.
        neutral: neutral stance of the body, on the swing's skeleton.
        direction: rad from the run's direction to the kick's, left positive.
        rate: playback rate of the swing.
        fps: frames per second.
        style: of the run.
    Returns:
        The kick; it starts where the last but one step begins and ends where the kicking foot lands.
    """
    gait_plan, landings = _plan_run(speed, fps, neutral, style)
    reach = _measure_reach(gait_plan, landings[1], neutral)
    earlier = _compute_earlier(swing, neutral, direction, reach)
    steps = [plan_footsteps(gait_plan, neutral, style, side) for side in (LEFT, RIGHT)]
    contact = _read_swing(swing, np.array([-earlier]), neutral, direction)
    steps[LEFT] = _place_plant_foot(steps[LEFT], gait_plan, landings[1], contact, reach=reach, direction=direction,
                                    leg=neutral.leg)
    kept = _select_frames(gait_plan)
    times = gait_plan.times[kept] - APPROACH_SECONDS
    posture = build_upper_posture(gait_plan, neutral, style, 0).frames(kept)
    poses = _read_swing(swing, rate * times - earlier, neutral, direction)
    leaves = _LEG_OUT * min(rate, 1.0)  # a soft pass follows through less
    motion = _lay_swing(posture, times, tuple(steps), poses, neutral, back=(leaves, landings[2]))
    start, end = APPROACH_SECONDS + landings[0] - 0.1, APPROACH_SECONDS + landings[2] + 0.1
    return Gesture(motion.frames(_MARGIN, len(motion) - _MARGIN), APPROACH_SECONDS, start, end)


def _plan_run(speed: float, fps: float, neutral: NeutralStance, style: GaitStyle) -> tuple[GaitPlan, np.ndarray]:
    """Plan the run: also s from the contact at which right, plant and right foot land."""
    count = int(round((APPROACH_SECONDS + RUN_OUT_SECONDS) * fps)) + 1
    shares = np.interp(np.arange(count) / fps - APPROACH_SECONDS, *np.array(_SPEEDS).T)
    return _time_steps(plan_gait(speed * shares, None, fps, neutral, style=style), speed)


def _select_frames(gait_plan: GaitPlan) -> slice:
    """Select the requested frames of a plan, and _MARGIN more at both ends."""
    more = gait_plan.pad - _MARGIN * gait_plan.stride
    return slice(more, len(gait_plan.times) - more, gait_plan.stride)


def _time_steps(gait_plan: GaitPlan, speed: float) -> tuple[GaitPlan, np.ndarray]:
    """Time the steps of a run for a kick: also s from the contact at which right, plant and right foot land."""
    from scipy.interpolate import PchipInterpolator

    share = np.clip((speed - _SLOWEST) / (_FASTEST - _SLOWEST), 0.0, 1.0)
    plant, back = (a + share * (b - a) for a, b in (_PLANT_SECONDS, _RETURN_SECONDS))
    rate = np.gradient(gait_plan.phase, gait_plan.times)
    step = 0.5 / float(np.interp(0.0, gait_plan.times, rate))
    landings = np.array([-plant - _LAST_STRIDE * step, -plant, back])
    others = step * np.arange(1.0, 10.0)
    at = np.concatenate([landings[0] - others[::-1], landings, landings[-1] + others])
    phase = 0.5 * (np.arange(len(at)) - len(others) - 1)
    curve = PchipInterpolator(at, phase)
    return replace(gait_plan, phase=curve(gait_plan.times - APPROACH_SECONDS)), landings


def _measure_reach(gait_plan: GaitPlan, landing: float, neutral: NeutralStance) -> float:
    """Measure how far ahead of the hips, m, the plant foot can be at the contact, when it lands at `landing` s."""
    travelled = np.diff(np.interp([landing, 0.0], gait_plan.times - APPROACH_SECONDS, gait_plan.path[:, 0]))
    return _LONGEST_REACH * neutral.leg - float(travelled[0])


def _compute_earlier(swing: Swing, neutral: NeutralStance, direction: float, reach: float) -> float:
    """Compute by how many s the swing meets the ball earlier so that the plant foot is not behind the ball."""
    poses = _read_swing(swing, np.array([-_MOST_EARLIER, 0.0]), neutral, direction)
    back, ahead = poses.ankle[:, 0] + poses.plant[0]
    share = np.clip((ahead - reach) / max(ahead - back, 1e-6), 0.0, 1.0)
    return _MOST_EARLIER * float(share)


def _read_swing(swing: Swing, times: np.ndarray, neutral: NeutralStance, direction: float) -> _SwingPoses:
    """Read a swing at seconds from its contact (T,), turned so that its foot moves in `direction` at the contact.

    The plant foot is where the recording has it, within the usual range.
    """
    body, motion = identify_joints(swing.motion.skeleton), swing.motion
    around = compute_places(swing, np.array([-_SPEED_SECONDS, _SPEED_SECONDS]))[:, body.right.foot]
    angle = direction - np.arctan2(*(around[1] - around[0])[1::-1])
    turn = quaternion.from_up_angle(np.array(angle))
    plant = np.clip(measure_plant_foot(swing), *(neutral.leg / tables.LEG * np.array([_AHEAD, _BESIDE]).T))
    facing = compute_heading_from_positions(motion.skeleton, compute_places(swing, np.zeros(1))) + angle
    root, rotations = sample_frames_cubic(motion, swing.contact + times * motion.fps)
    places, world = compute_pose(motion.skeleton, root, rotations)
    middle = 0.5 * (places[:, body.left.upper_leg] + places[:, body.right.upper_leg])
    pelvis = quaternion.multiply(world[:, body.hips], quaternion.inverse(neutral.rotations[body.hips]))
    return _SwingPoses(rotations=rotations, pelvis=quaternion.multiply(turn, pelvis), height=middle[:, 2],
                       ankle=quaternion.rotate(turn, places[:, body.right.foot] - middle),
                       plant=quaternion.rotate_level(plant[None], facing)[0])


def compute_places(swing: Swing, times: np.ndarray) -> np.ndarray:
    """Compute all joints (T, J, 3) m of a swing at seconds (T,) from its contact."""
    root, rotations = sample_frames_cubic(swing.motion, swing.contact + times * swing.motion.fps)
    return compute_pose(swing.motion.skeleton, root, rotations)[0]


def _place_plant_foot(steps: Footsteps, gait_plan: GaitPlan, landing: float, poses: _SwingPoses, *, reach: float,
                      direction: float, leg: float) -> Footsteps:
    """Place the plant foot beside the kicking ankle and, as far as the leg reaches, ahead of it."""
    which = int(np.argmin(np.abs(steps.on - APPROACH_SECONDS - landing)))
    contact = int(np.argmin(np.abs(gait_plan.times - APPROACH_SECONDS)))
    offset = poses.ankle[0, :2] + poses.plant
    offset[0] = min(offset[0], reach)
    place, yaw, speed = (values.copy() for values in (steps.place, steps.yaw, steps.speed))
    on, off = steps.on.copy(), steps.off.copy()
    # a last stride is longer than a sprinter's own, whose feet land later where they would be too far ahead
    late = np.maximum(on[which] - APPROACH_SECONDS - landing, 0.0)
    on[which] -= tables.compute_sprint_share(steps.speed[which]) * late
    place[which] = gait_plan.path[contact] + offset
    near = gait_plan.path[:, 0] - place[which, 0] < _LONGEST_BEHIND * leg
    off[which] = min(off[which], gait_plan.times[near].max())
    yaw[which] += _PLANT_YAW * direction
    speed[which] = _FLAT_STANCE
    return replace(steps, on=on, place=place, yaw=yaw, speed=speed, off=off)


def _lay_swing(posture: Posture, times: np.ndarray, steps: tuple[Footsteps, ...], poses: _SwingPoses,
               neutral: NeutralStance, back: tuple[float, float]) -> Motion:
    """Lay a swing onto a run, both at s from the contact (T,); the kicking leg returns to the run between `back` s."""
    share = compute_envelope(times, *_BODY)
    hips = posture.hips.copy()
    hips[:, 2] += share * (poses.height - hips[:, 2])
    pelvis = quaternion.slerp(quaternion.from_rotation_vector(posture.pelvis), poses.pelvis, share)
    posture = posture.replace_arrays(hips=hips, pelvis=quaternion.to_rotation_vector(pelvis))
    run = to_motion(plant_feet(posture, times + APPROACH_SECONDS, steps, neutral), neutral)
    mixed = _blend_joints(run, poses.rotations, times, share=share, steps=steps[RIGHT], back=back)
    # the hips of a run may be lower than the kick's own, so that its foot would go through the ground
    nowhere = np.zeros((len(mixed), 2, 2), bool)
    lifted = lift_feet(run.skeleton, run.root_positions, mixed, nowhere, run.fps)
    return replace(run, root_positions=lifted.root, rotations=lifted.rotations)


def _blend_joints(run: Motion, kick: np.ndarray, times: np.ndarray, *, share: np.ndarray, steps: Footsteps,
                  back: tuple[float, float]) -> np.ndarray:
    """Blend a run's local rotations (T, J, 4) into a kick's `kick`: trunk and arms by `share`, the leg in its swing."""
    body, skeleton = identify_joints(run.skeleton), run.skeleton
    legs = [set(list_descendants(skeleton.parents, side.upper_leg)) for side in (body.left, body.right)]
    above = set(list_descendants(skeleton.parents, body.hips)) - legs[LEFT] - legs[RIGHT] - {body.hips}
    before = steps.off[steps.off - APPROACH_SECONDS < 0.0].max() - APPROACH_SECONDS
    swinging = compute_envelope(times, before + _LEG_IN[0], before + _LEG_IN[1], *back)
    out = run.rotations.copy()
    for joints, weight in ((sorted(above), share), (sorted(legs[RIGHT]), swinging)):
        out[:, joints] = quaternion.slerp(out[:, joints], kick[:, joints], weight[:, None])
    return out
