"""Plant the feet of a motion on another path, on level ground or any other.

As `foot_plant`, with three differences. The ground may rise and tilt (`ground_contact`): feet keep the height above it
that they had above their own ground, soles and their steps tilt with it, and the pelvis follows the mean of the ground
under both feet. A leg that must be straighter than it was approaches its full length smoothly, in the air as on the
ground, so that no knee pops when a foot arrives. And only the joints of the legs are evaluated, since paths are dragged
interactively.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..base.vectors import unit_vector
from ..motion import foot_plant, quaternion
from ..motion.foot_plant import Foot, PlantResult, fit_smooth_curve
from ..motion.humanoid import Limb, identify_joints
from ..motion.limb import MIN_BEND, solve_posed_limb
from ..motion.motion import compute_pose
from ..motion.skeleton import Skeleton
from ..motion.track import smooth_zero_phase_hann
from .ground_contact import Surface, compute_footing

MOST_SHIFT = 0.45
"""Metres that a foot in contact is moved over the ground at most, before it is held less firmly: bodies that turn on
the spot turn differently on another path."""
FIRST_DROP = 0.015
"""Metres that the pelvis is lowered before a heel is raised, where a leg does not reach."""
DROP_BY_SLOPE = 0.15
"""Metres more that the pelvis is lowered at most, times the slope of the ground: downhill the other foot is low."""
SINK_BY_SLOPE = 0.15
"""Metres by which the pelvis is lower, times the slope: knees bend more on slopes, up and down."""
SPARE = 0.008
"""Metres below full length within which a leg that was bent more eases towards it."""
LONGEST = (0.3, 1.3)
"""Lower and upper limit of a step's length over that recorded."""
BENT_WEIGHT, STRAIGHT_WEIGHT, STIFF = 0.2, 0.01, 0.05
"""Weights, against 1 on the ground, of the goals of a leg in the air that is bent more, or straighter, than recorded;
and of the smoothness of the correction."""
LEAST_BEND = 0.05
"""Root of the metres that a leg always stays short of its full length."""
_FIRM = 4.0  # sharpness of the limit: where the goal is at full length, a sixth of SPARE is left
_PELVIS_SECONDS, _STRIDE = 0.5, 0.5  # seconds; metres between the feet on stairs, in the mean
_UP = np.array([0.0, 0.0, 1.0])
_ROUNDS = 2  # of holding stances less firmly
_FLOOR, _EVEN = 200.0, 0.003  # smoothness of a recorded floor: half of a half-second wave passes; metres
# metres off its goal beyond which a foot in contact is held more firmly; rounds of that
_GOAL_TOLERANCE, _FIRMER_ROUNDS = 0.004, 8
_MORE_BENT = 0.5  # share of its new bend from which on a leg's own direction counts fully
_SPREAD_SECONDS = 0.1  # seconds by which a rise or drop is spread


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground under the feet.

    Attributes:
        own: (T, 2) metres, height of each foot's ground in the constructed motion.
        up: (T, 2, 3) its unit normals, world frame.
        surface: the ground to plant on; None if it is the same.
    """

    own: np.ndarray
    up: np.ndarray
    surface: Surface | None = None


@dataclass(frozen=True, eq=False)
class StepScale:
    """By how much steps are longer than in the constructed motion.

    Attributes:
        direction: (T,) radians, heading of travel.
        scale: (T,) length of steps over those constructed.
    """

    direction: np.ndarray
    scale: np.ndarray


def plant_feet_on_ground(skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, standing: np.ndarray, fps: float,
                         ground: Ground, sole: float, steps: StepScale | None = None) -> PlantResult:
    """Plant the feet of a motion on the ground wherever they are in contact.

    Args:
        skeleton: of the motion, with legs.
        root: (T, 3) metres, the constructed motion's root, world frame.
        rotations: (T, J, 4) local rotations of the constructed motion.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe.
        fps: frames per second.
        ground: the motion's own ground and the ground to plant on.
        sole: metres from the ground to the foremost joint of a flat foot.
        steps: scale of the steps; None if they keep their length.
    Returns:
        Root, rotations, correction and miss of each foot.
    """
    legs, kept, limbs = _extract_legs(skeleton)
    places, world = compute_pose(legs, root, rotations[:, kept])
    scale, spread = 30.0 / fps, _count_frames(_SPREAD_SECONDS, fps)
    feet = [_smooth_left_axis(foot_plant.build_foot(places, world, limb, standing[:, side])) for side,
            limb in enumerate(limbs)]
    if steps is not None:
        feet = [_scale_step(foot, root, steps) for foot in feet]
    feet = [foot_plant.align_flat_foot(foot, scale) for foot in feet]
    feet, lifted = _place_on_own_ground(feet, ground.own, sole, scale)
    # Rounds: hold the stances, place the feet on the ground, drop the pelvis; where legs still lack length, hold less
    # firmly.
    firm = [foot.weight for foot in feet]
    for round_number in range(_ROUNDS + 1):
        shifts = [foot_plant.solve_limited_shift(foot.displacements, weight, scale, MOST_SHIFT)[0] for foot,
                  weight in zip(feet, firm)]
        placed_feet = [foot.move(np.pad(by, ((0, 0), (0, 1)))) for foot, by in zip(feet, shifts)]
        placed_feet, up, most = _place_on_ground(placed_feet, standing, fps, ground, lifted)
        first = foot_plant.compute_pelvis_drop(placed_feet, [foot.heel for foot in placed_feet], spread, FIRST_DROP)
        placed_feet = [replace(foot, hip=foot.hip - first[:, None] * _UP) for foot in placed_feet]
        goals = [_compute_ankle_goal(foot, spread) for foot in placed_feet]
        drop = foot_plant.compute_pelvis_drop(placed_feet, [goal for goal, _ in goals], spread, most - FIRST_DROP)
        lacking = [foot_plant.measure_shortfall(replace(foot, weight=weight), goal, drop)
                   for foot, weight, (goal, _) in zip(placed_feet, firm, goals)]
        if round_number == _ROUNDS or max(s.max(initial=0.0) for s in lacking) <= foot_plant.SLIDE_TOLERANCE:
            break
        firm = [foot_plant.relax_stances(weight, foot.contact_weight > 0.0, s, fps)
                for weight, foot, s in zip(firm, feet, lacking)]
    # `down` is how far the whole body goes down: both drops, less the rise of the ground.
    down = (first + drop - up)[:, None] * _UP
    places = places - down[:, None]
    out, correction, miss = np.array(rotations, dtype=float), np.zeros((len(root), 2)), np.zeros((len(root), 2))
    for side, (foot, (goal, end_rotation)) in enumerate(zip(placed_feet, goals)):
        hip = foot.hip - drop[:, None] * _UP
        target = _limit_goals(foot, goal, hip, scale)
        joints = (foot.limb.upper_leg, foot.limb.lower_leg, foot.limb.foot)
        clear = _compute_clear_bend(foot, np.linalg.norm(target - hip, axis=1))
        found, _ = solve_posed_limb(legs, places, world, joints, target, end_rotation=end_rotation, soft=1e-4,
                                    min_bend=clear)
        for joint, local in found.items():
            out[:, kept[joint]] = local
        miss[:, side] = np.where(foot.contact_weight > 0.0, np.linalg.norm(target - goal, axis=1), 0.0)
        correction[:, side] = np.linalg.norm((target - places[:, foot.limb.foot])[:, :2], axis=1)
    return PlantResult(root - down, out, correction, miss)


@lru_cache(maxsize=32)
def _extract_legs(skeleton: Skeleton) -> tuple[Skeleton, list[int], tuple[Limb, ...]]:
    """Extract the legs of a skeleton: the partial skeleton, its joints in the whole one, and its limbs."""
    body = identify_joints(skeleton)
    named = [[limb.upper_leg, limb.lower_leg, limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)]
    legs, kept = skeleton.select_joints([joint for side in named for joint in side])
    limbs = []
    for limb, joints in zip((body.left, body.right), named):
        upper, lower, foot, toe = (kept.index(joint) for joint in joints)
        limbs.append(replace(limb, upper_leg=upper, lower_leg=lower, foot=foot, toe=None if limb.toe is None else toe))
    return legs, kept, tuple(limbs)


def _smooth_left_axis(foot: Foot) -> Foot:
    """Replace a foot's left axis by its mean over level frames: from above, a foot on its toes has no direction."""
    level = np.linalg.norm((foot.toe - foot.heel)[:, :2], axis=1, keepdims=True)
    own = np.sum(quaternion.rotate(quaternion.inverse(foot.rotation), foot.left) * level**2, axis=0)
    left = quaternion.rotate(foot.rotation, unit_vector(own)) * [1.0, 1.0, 0.0]
    size = np.linalg.norm(left, axis=1, keepdims=True)
    return replace(foot, left=np.where(size > 0.1, left / np.maximum(size, 1e-9), foot.left))


def _scale_step(foot: Foot, root: np.ndarray, steps: StepScale) -> Foot:
    """Move the foot further before or behind the body, within the limits of LONGEST."""
    along = np.stack([np.cos(steps.direction), np.sin(steps.direction)], axis=1)
    ahead = np.sum((0.5 * (foot.heel + foot.toe) - root)[:, :2] * along, axis=1)
    much = np.clip(steps.scale, *LONGEST) - 1.0
    return foot.move(np.pad((much * ahead)[:, None] * along, ((0, 0), (0, 1))))


def _place_on_own_ground(feet: list[Foot], own: np.ndarray, sole: float, scale: float) -> tuple[list[Foot], np.ndarray]:
    """Place the feet on their own ground, since recorded floors are uneven and drift.

    own: (T, 2) metres. Returns the feet and the metres (T,) by which the body is off its ground: known where feet are
    in contact, interpolated smoothly in the air.
    """
    above = [foot.move(-height[:, None] * _UP) for foot, height in zip(feet, own.T)]
    lifts = [foot_plant.lift_to_ground(foot, sole, scale) for foot in above]
    weights = [foot.contact_weight for foot in feet]
    lifted = sum((w * lift for w, lift in zip(weights, lifts)), np.zeros(()))
    off = fit_smooth_curve(lifted, sum(weights, np.zeros(())), scale, _FLOOR)
    if np.abs(off).max(initial=0.0) > _EVEN:
        lifts = [off + foot_plant.lift_to_ground(foot.move(off[:, None] * _UP), sole, scale) for foot in above]
    return [foot.move(by[:, None] * _UP) for foot, by in zip(feet, lifts)], off


def _count_frames(seconds: float, fps: float) -> int:
    return int(round(seconds * fps))


def _place_on_ground(feet: list[Foot], standing: np.ndarray, fps: float, ground: Ground,
                     lifted: np.ndarray) -> tuple[list[Foot], np.ndarray, float]:
    """Place the feet on the target ground.

    lifted: (T,) metres by which the feet were lifted before. Returns the feet, metres (T,) by which the body rises with
    the ground, and metres by which the pelvis may drop.
    """
    if ground.surface is None:
        up = lifted
        return [replace(foot, hip=foot.hip + up[:, None] * _UP) for foot in feet], up, foot_plant.MAX_DROP
    over = np.stack([np.stack([foot.heel, foot.toe], axis=1) for foot in feet], axis=1)
    clear = over[..., 2].min(axis=2) - ground.own
    under = compute_footing(over[..., :2], standing, clear, fps, ground.surface)
    rise = under.height - ground.own
    steep = _measure_steepness(under.height, under.normal, fps)
    steeper = np.maximum(steep - _measure_steepness(ground.own, ground.up, fps), 0.0)
    up = lifted + _smooth_pelvis_height(rise.mean(axis=1) - SINK_BY_SLOPE * steeper, fps)
    tip = quaternion.rotation_between(ground.up, under.normal)
    placed_feet = [_tilt_foot(foot, tip[:, side], rise[:, side] + under.lift[:, side], up) for side,
                   foot in enumerate(feet)]
    return placed_feet, up, foot_plant.MAX_DROP + DROP_BY_SLOPE * float(steep.max(initial=0.0))


def _measure_steepness(height: np.ndarray, normal: np.ndarray, fps: float) -> np.ndarray:
    """Measure how steep the ground under both feet is (T,), from its heights (T, 2) m and normals (T, 2, 3)."""
    slope = np.linalg.norm(normal[..., :2], axis=2) / np.maximum(normal[..., 2], 0.1)
    apart = np.abs(np.diff(height, axis=1)) / _STRIDE
    return np.maximum(slope.mean(axis=1), smooth_zero_phase_hann(apart, fps, 1.0)[:, 0])


def _smooth_pelvis_height(height: np.ndarray, fps: float) -> np.ndarray:
    """Smooth the height (T,) m under the feet to that which the pelvis follows."""
    return smooth_zero_phase_hann(height[:, None], fps, _PELVIS_SECONDS)[:, 0]


def _tilt_foot(foot: Foot, tip: np.ndarray, rise: np.ndarray, up: np.ndarray) -> Foot:
    """Rotate the foot by `tip` (T, 4) about its toe and raise it by `rise` (T,) m; its hip rises by `up` (T,) m."""
    toe = foot.toe + rise[:, None] * _UP
    return replace(foot, hip=foot.hip + up[:, None] * _UP, toe=toe,
                   heel=toe + quaternion.rotate(tip, foot.heel - foot.toe),
                   rotation=quaternion.multiply(tip, foot.rotation), left=quaternion.rotate(tip, foot.left))


def _compute_ankle_goal(foot: Foot, spread: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute the ankle's goal (T, 3) and the foot's world rotation (T, 4): on its toe where the leg does not reach."""
    rise = foot_plant.spread_peaks(foot_plant.solve_heel_rise(foot, np.zeros((1, 3))) * foot.weight[:, 1], spread)
    roll = quaternion.from_axis_angle(foot.left, rise)
    return foot.toe + quaternion.rotate(roll, foot.heel - foot.toe), quaternion.multiply(roll, foot.rotation)


def _compute_clear_bend(foot: Foot, far: np.ndarray) -> np.ndarray:
    """Compute the least offset of a knee from the line hip-ankle, as a share of the leg (T,), for its direction to
    count.

    far: (T,) metres, new length of the leg. In a leg that bends much more than recorded, the noise of the direction
        grows.
    """
    return np.maximum(MIN_BEND, 0.5 * _MORE_BENT * np.sqrt(np.maximum(1.0 - (far / foot.length) ** 2, 0.0)))


def _limit_goals(foot: Foot, goal: np.ndarray, hip: np.ndarray, scale: float) -> np.ndarray:
    """Limit the goals (T, 3) to what a leg can follow, nearer to the hip or further away.

    A knee bends with the root of what its leg lacks to full length. In these roots the correction of a leg is one
    smooth curve: that of the goals where the foot is in contact, and little of it in the air where it would straighten
    the leg.
    """
    line = goal - hip
    far = np.linalg.norm(line, axis=1)
    own = np.maximum(foot.recorded_slack, 1e-5)
    room = SPARE * (1.0 - np.exp(-own / SPARE))
    # `left`: metres to full length after a soft limit at zero; `more`: the change of its root against the recording.
    left = room / _FIRM * np.logaddexp(0.0, _FIRM * (foot.length - far) / room)
    more = np.sqrt(left) - np.sqrt(own)
    stands = foot.contact_weight > 0.0
    weight = np.where(stands, 1.0, np.where(more > 0.0, BENT_WEIGHT, STRAIGHT_WEIGHT))
    for _ in range(_FIRMER_ROUNDS + 1):
        bend = np.sqrt(own) + fit_smooth_curve(weight * more, weight, scale, STIFF)
        bend = 0.5 * (bend + np.sqrt(bend**2 + LEAST_BEND**2))
        # Feet in contact that miss their goal get more weight, until all are within _GOAL_TOLERANCE.
        off = np.where(stands, np.abs(foot.length - bend**2 - far), 0.0) / _GOAL_TOLERANCE
        if off.max(initial=0.0) <= 1.0:
            break
        weight = weight * np.maximum(off, 1.0) ** 2
    return hip + line * ((foot.length - bend**2) / np.maximum(far, 1e-9))[:, None]
