"""Foot planting: each stance's slide is removed by moving the foot, and the leg follows by two-bone inverse kinematics.

Which frames are in contact is known from the recording and carried along (../shared/metrics.md); nothing is guessed
from the motion itself. A stance is not pinned to one point and blended in and out. Instead each foot's shift over the
ground is one smooth curve D(t) that cancels the velocity of the point that carries the foot while it is in contact and
changes gently in between: the least squares problem of `solve_shift`, one banded system for the whole motion.

A foot rolls: first the heel carries it, then the toe, on which the heel rises while it is still low and slow. Where a
leg does not reach, people rise on their toes; so does the foot here, then the pelvis is lowered, then the foot slides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..base.banded_least_squares import BandedLeastSquares
from ..base.time_series import hann_smooth, run_numbers
from ..base.vectors import arctan2, cross
from . import quaternion
from .contacts import sole_height
from .humanoid import Limb, identify
from .limb import two_bone
from .motion import pose_kinematics
from .skeleton import Skeleton

SMOOTH, PULL = 0.005, 3e-4
"""Weights of `solve_shift`: of the third difference of the shift, and of the shift itself."""

HEEL_SHARE = 0.2
"""Weight of a heel while its toe is in contact too, against the toe's 1."""

MOST_DROP, MOST_RISE = 0.04, 0.35
"""Metres that the pelvis is lowered, and radians that a heel is raised about its toe, at most."""

HOLD = 1e6
"""Weight of a shift that is given: so much larger than all others that it stays."""

MOST_SHIFT = 0.25
EASE, SPARE, SPARE_ALOFT = 0.012, 0.004, 0.02
"""Metres below full length from which a leg eases (`limb.soften_distance`), and reserves of length that are left in
contact and in the air: a leg that is nearly straight pops at the knee. A leg that was straighter in the recording may
be as straight."""

LEAST_EASE, LEAST_SPARE = 0.003, 0.002
"""The same of legs that were straight in the recording."""

_EASED_ROUNDS, _SLIDES_FROM = 3, 0.004  # rounds of relaxing the contact weights; metres of sliding that need none
_BEHIND = 3  # frames at 30 per second over which a rise or drop is spread


@dataclass(frozen=True, eq=False)
class Planted:
    """A motion with planted feet.

    Attributes:
        root: (T, 3) metres, world.
        rotations: (T, J, 4) local rotations.
        correction: (T, 2) metres by which each foot was moved.
        miss: (T, 2) metres between each ankle and its target after inverse kinematics.
    """

    root: np.ndarray
    rotations: np.ndarray
    correction: np.ndarray
    miss: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Foot:
    """One foot over T frames.

    Attributes:
        limb: the joints of its side.
        hip, heel, toe: (T, 3) metres, world; the heel is the ankle joint.
        rotation: (T, 4) world rotation of the foot.
        left: (T, 3) level unit vector across the foot.
        weight: (T, 2) contact weights of heel and toe, from 0 to 1.
        length: (T,) metres, thigh plus shank.
        recorded_slack: (T,) metres that the leg was short of that length in the given pose.
    """

    limb: Limb
    hip: np.ndarray
    heel: np.ndarray
    toe: np.ndarray
    rotation: np.ndarray
    left: np.ndarray
    weight: np.ndarray
    length: np.ndarray
    own: np.ndarray

    @property
    def moves(self) -> np.ndarray:
        """(T - 1, 2, 2) metres that heel and toe move over the ground from frame to frame."""
        return np.stack([np.diff(self.heel[:, :2], axis=0), np.diff(self.toe[:, :2], axis=0)], axis=1)

    def moved(self, by: np.ndarray) -> Foot:
        """Return the foot moved by `shift` (T, 3) m."""
        return replace(self, heel=self.heel + by, toe=self.toe + by)

    @property
    def ease(self) -> np.ndarray:
        """(T,) metres below full length from which the leg eases."""
        return np.clip(self.own, LEAST_EASE, EASE)

    @property
    def longest(self) -> np.ndarray:
        """(T,) metres, the leg's greatest length in contact."""
        return self.length - np.clip(self.own, LEAST_SPARE, SPARE)

    @property
    def carries(self) -> np.ndarray:
        """(T,) contact weight of the foot, the larger one of heel and toe."""
        return self.weight.max(axis=1)


def plant(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, standing: np.ndarray, fps: float,
    sinks: float = MOST_DROP, moves: np.ndarray | None = None, levels: bool = True,
) -> Planted:
    """Plant the feet of a motion on the ground, z = 0, where they are in contact.

    The feet keep their own rotation except for a rotation about the vertical that holds a flat foot's direction, and
    for
    heels that rise where a leg could not reach. The pelvis is lowered where that is not enough.

    Args:
        skeleton: J joints.
        root: (T, 3) root positions of the constructed motion, metres, world.
        rotations: (T, J, 4) local rotations.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact with the ground.
        fps: frames per second.
        max_drop: metres by which the pelvis is lowered at most.
        foot_moves: (T, 2, 4) metres by which each foot is moved first, and radians that its heel is raised about its
            toe (`synthesis.construct.steps`); None for none.
        level_feet: bring feet in contact to the height of the ground and let none go below it. False keeps all heights:
            a recording's own floor is uneven by centimetres, and pressing its feet onto z = 0 costs more jerk than it
            is worth.
    Returns:
        The planted motion with what it took.
    Raises:
        InputError: if the skeleton has no legs.
    """
    body = identify(skeleton)
    places, world = pose_kinematics(skeleton, root, rotations)
    scale, spread = 30.0 / fps, int(round(_BEHIND * fps / 30.0))
    moves = np.zeros((len(root), 2, 4)) if moves is None else moves
    feet = [laid_foot(places, world, limb, standing[:, side]) for side, limb in enumerate((body.left, body.right))]
    feet = [turned_flat(foot.moved(moves[:, side, :3]), scale) for side, foot in enumerate(feet)]
    lifts = [lift_to_ground(foot, sole_height(skeleton), scale) if levels else np.zeros(len(root)) for foot in feet]
    firm = [foot.weight for foot in feet]
    # solve with full weights first; stances that the legs cannot reach are relaxed and solved again
    for turn in range(_EASED_ROUNDS + 1):
        goals = [
            _goal(foot, weight, lift, tilt=tilt, scale=scale, spread=spread)
            for foot, weight, lift, tilt in zip(feet, firm, lifts, np.moveaxis(moves[..., 3], 1, 0))
        ]
        drop = pelvis_drop(feet, [goal for goal, _ in goals], spread, sinks)
        short = [lacking(foot, goal, drop) for foot, (goal, _) in zip(feet, goals)]
        if turn == _EASED_ROUNDS or max(s.max(initial=0.0) for s in short) <= _SLIDES_FROM:
            break
        firm = [held_less(weight, s) for weight, s in zip(firm, short)]
    root = root - drop[:, None] * [0.0, 0.0, 1.0]
    correction, miss = np.zeros((len(root), 2)), np.zeros((len(root), 2))
    out = rotations
    for side, (foot, (target, turned)) in enumerate(zip(feet, goals)):
        target = _within_reach(foot, target, drop)
        chain = (foot.limb.upper_leg, foot.limb.lower_leg, foot.limb.foot)
        reached = two_bone(skeleton, root, out, chain, target, end_rotation=turned, soft=foot.ease)
        out, miss[:, side] = reached.rotations, reached.miss
        correction[:, side] = np.linalg.norm(target - places[:, foot.limb.foot], axis=1)
    return Planted(root, out, correction, miss)


def laid_foot(places: np.ndarray, world: np.ndarray, limb: Limb, stands: np.ndarray) -> Foot:
    """Build one foot of a body.

    Args:
        places: (T, J, 3) joint positions, metres, world.
        world: (T, J, 4) world rotations.
        limb: the joints of its side.
        contacts: (T, 2) bool, heel and toe in contact.
    Returns:
        The foot.
    """
    hip, knee, heel, toe = (places[:, j] for j in (limb.upper_leg, limb.lower_leg, limb.foot, limb.toe_or_foot))
    weight = firmness(stands)
    length = np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(heel - knee, axis=1)
    own = length - np.linalg.norm(heel - hip, axis=1)
    along = toe - heel if limb.toe is not None else quaternion.rotate(world[:, limb.foot], np.array([1.0, 0.0, 0.0]))
    yaw = arctan2(along[:, 1], along[:, 0])
    left = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros(len(yaw))], axis=1)
    return Foot(limb=limb, hip=hip, heel=heel, toe=toe, rotation=world[:, limb.foot], left=left, weight=weight,
                length=length, own=own)


def firmness(stands: np.ndarray) -> np.ndarray:
    """Compute the contact weights (T, 2) of heel and toe from contacts (T, 2) bool.

    1 inside a stance, 0.5 in its first and last frame, while the foot arrives, else 0. The heel yields to a toe in
    contact.
    """
    padded = np.pad(stands, ((1, 1), (0, 0)), mode="edge")
    inner = stands & padded[:-2] & padded[2:]
    weight = np.where(inner, 1.0, np.where(stands, 0.5, 0.0))
    weight[:, 0] *= 1.0 - (1.0 - HEEL_SHARE) * weight[:, 1]
    return weight


def turned_flat(foot: Foot, scale: float) -> Foot:
    """Rotate a foot about its heel and the vertical so that it keeps its direction while it is flat; scale: 30 / rate.
    """
    yaw = np.unwrap(arctan2(-foot.left[:, 0], foot.left[:, 1]))
    flat = np.minimum(foot.weight[:, 0] / HEEL_SHARE, foot.weight[:, 1]).clip(0.0, 1.0)
    spin = quaternion.about_up(shift(np.diff(yaw)[:, None], flat[:, None], scale)[:, 0])
    toe = foot.heel + quaternion.rotate(spin, foot.toe - foot.heel)
    left = quaternion.rotate(spin, foot.left)
    return replace(foot, toe=toe, rotation=quaternion.multiply(spin, foot.rotation), left=left)


def _goal(
    foot: Foot, weight: np.ndarray, lift: np.ndarray, tilt: np.ndarray, scale: float, spread: int
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the ankle's goal (T, 3) and the foot's world rotation (T, 4); lift (T,) m, tilt (T,) radians of the heel.
    """
    ground, weight = held_shift(foot.moves, weight, scale)
    moved = np.column_stack([ground, lift])
    rise = spread_over(heel_rise(foot, moved) * foot.weight[:, 1], spread) + tilt
    roll = quaternion.about_axis(foot.left, rise)
    ankle = foot.toe + moved + quaternion.rotate(roll, foot.heel - foot.toe)
    return ankle, quaternion.multiply(roll, foot.rotation)


def heel_rise(foot: Foot, moved: np.ndarray) -> np.ndarray:
    """Solve the smallest angle by which a heel rises about its toe so that the leg reaches its ankle.

    With u from toe to hip, a from toe to heel, n the foot's left: |u - R a|^2 = L^2 is A cos r + B sin r = K.

    Args:
        foot: the foot before its shift.
        shift: (T, 3) metres by which the foot is shifted.
    Returns:
        (T,) radians, at most MAX_HEEL_RISE.
    """
    u, a, n = foot.hip - foot.toe - moved, foot.heel - foot.toe, foot.left
    across = np.sum(a * n, axis=1, keepdims=True)
    level = a - across * n
    # even, odd and target are A, B and K of the docstring; `level` is the part of a that rotates
    even, odd = np.sum(u * level, axis=1), np.sum(u * cross(n, level), axis=1)
    length = foot.longest
    asked = 0.5 * (np.sum(u * u, axis=1) + np.sum(a * a, axis=1) - length**2) - across[:, 0] * np.sum(u * n, axis=1)
    most = np.hypot(even, odd)
    rise = arctan2(odd, even) - np.arccos(np.clip(asked / np.maximum(most, 1e-9), -1.0, 1.0))
    return np.where((asked > even) & (odd > 0.0), np.clip(rise, 0.0, MOST_RISE), 0.0)


def held_shift(
    velocity: np.ndarray, weight: np.ndarray, scale: float, most: float = MOST_SHIFT
) -> tuple[np.ndarray, np.ndarray]:
    """Solve the shift of a foot with stances relaxed that would need too large a shift.

    A foot that slides looks better than a leg stretched after it (../shared/metrics.md).

    Args:
        velocity: (T - 1, 2, 2) metres per frame of heel and toe.
        weight: (T, 2) contact weights.
        scale: 30 over the rate.
        max_shift: metres of shift above which a stance is relaxed.
    Returns:
        The shift (T, 2) in metres, and the weights (T, 2) with which it was found.
    """
    ground = shift(velocity, weight, scale)
    for _ in range(4):
        far = np.where(weight.max(axis=1) > 0, np.linalg.norm(ground, axis=1), 0.0)
        if far.max(initial=0.0) <= most:
            break
        weight = held_less(weight, far - most)
        ground = shift(velocity, weight, scale)
    return ground, weight


def held_less(weight: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Relax the weights (T, 2) of those stances in which `excess` (T,) metres is above 0: to a third or less at 10 cm.
    """
    stance = weight.max(axis=1) > 0
    # label numbers the stances from 1; frames without contact have 0 and collect nothing
    label = run_numbers(stance)
    worst = np.zeros(label.max(initial=0) + 1)
    np.maximum.at(worst, label, np.where(stance, np.maximum(excess, 0.0), 0.0))
    return weight / (1.0 + worst[label] / 0.02)[:, None] ** 2


def shift(velocity: np.ndarray, weight: np.ndarray, scale: float = 1.0, kept: np.ndarray | None = None) -> np.ndarray:
    """Solve the smooth shift D that cancels velocities where they carry weight.

    Minimizes sum w |D' + v|^2 + SMOOTH_WEIGHT |D'''|^2 + PULL_WEIGHT |D|^2, with differences per frame at 30 frames per
    second.

    Args:
        velocity: (T - 1, P, K) movement per frame of P points, or (T - 1, K) of one point.
        weight: (T, P) contact weight of each point.
        scale: 30 over the rate, which keeps the balance at other rates.
        fixed_shifts: (T, K) given shifts, rows of NaN where D is free.
    Returns:
        (T, K), in the unit of the velocity.
    """
    count = len(weight)
    if velocity.ndim == 2:
        velocity = velocity[:, None, :]
    firm = np.minimum(weight[1:], weight[:-1])
    total = firm.sum(axis=1)
    pushed = np.einsum("tp,tpk->tk", firm, velocity)
    squares = BandedLeastSquares(count, columns=velocity.shape[2])
    # row t of the normal equations: D[t + 1] - D[t] = -v[t] adds -w v to equation t + 1 and +w v to equation t
    squares.right[1:] -= pushed
    squares.right[:-1] += pushed
    squares.add_difference(1, total)
    squares.add_difference(3, SMOOTH / scale**4)
    squares.add_value(PULL * scale**2)
    if kept is not None:
        given = ~np.isnan(kept[:, 0])
        squares.add_value(HOLD * given, goal=np.where(given[:, None], kept, 0.0))
    return squares.solve()


def lift_to_ground(foot: Foot, sole: float, scale: float) -> np.ndarray:
    """Compute the lift that brings a foot to the ground.

    The carrying point gets the height that it has when the foot is flat; both points stay above the ground at all
    times.

    Args:
        foot: the foot.
        sole: metres from the ground to the toe joint of a flat foot.
        scale: 30 over the rate.
    Returns:
        (T,) metres up.
    """
    heel, toe, weight = foot.heel[:, 2] - sole, foot.toe[:, 2] - sole, np.ceil(foot.weight) * [HEEL_SHARE, 1.0]
    flat = weight.min(axis=1) > 0
    rest = float(np.median((heel - toe)[flat])) if np.any(flat) else float(np.percentile(heel, 5))
    low = np.stack([heel - max(rest, 0.0), toe], axis=1)
    lift = settled(-(low * weight).sum(axis=1), weight.sum(axis=1), scale)
    for _ in range(3):
        below = np.minimum(low.min(axis=1) + lift, 0.0)
        if below.min() > -1e-3:
            break
        sunk = np.where(below < -1e-3, 1.0, 0.0)
        lift = lift + settled(-below * sunk, sunk, scale)
    return lift


def settled(right: np.ndarray, weight: np.ndarray, scale: float, smooth: float = SMOOTH) -> np.ndarray:
    """Fit the smooth curve (T,) that is `weighted_values` / `weight` where the weight is large, and small elsewhere."""
    squares = BandedLeastSquares(len(weight))
    squares.add_difference(3, smooth / scale**6)
    squares.add_value(weight + 2e-2)
    squares.right += right
    return squares.solve()[:, 0]


def pelvis_drop(feet: list[Foot], goals: list[np.ndarray], spread: int, most: float) -> np.ndarray:
    """Compute how far the pelvis is lowered so that ankles in contact can be reached.

    Args:
        feet: both feet.
        goals: their ankle goals (T, 3), metres, world.
        spread: frames over which the drop is spread.
        most: metres at most.
    Returns:
        (T,) metres, smooth.
    """
    need = np.zeros(len(goals[0]))
    for foot, goal in zip(feet, goals):
        length = foot.longest
        level = np.linalg.norm(goal[:, :2] - foot.hip[:, :2], axis=1)
        highest = goal[:, 2] + np.sqrt(np.maximum(length**2 - level**2, 0.0))
        lacks = np.where(level < length, foot.hip[:, 2] - highest, most)
        need = np.maximum(need, np.where(foot.carries > 0, lacks, 0.0))
    return spread_over(np.clip(need, 0.0, most), spread)


def spread_over(need: np.ndarray, reach: int) -> np.ndarray:
    """Build a smooth curve (T,) that is nowhere below `need` (T,), widened by `reach` frames."""
    return hann_smooth(maximum_filter1d(need, 2 * reach + 1, mode="nearest"), reach)


def lacking(foot: Foot, goal: np.ndarray, drop: np.ndarray) -> np.ndarray:
    """Measure the metres (T,) that the leg of a foot in contact is too short for its goal (T, 3); drop (T,) of the
    pelvis.
    """
    reach = goal - foot.hip + drop[:, None] * [0.0, 0.0, 1.0]
    return np.where(foot.carries > 0, np.linalg.norm(reach, axis=1) - foot.longest, 0.0)


def _within_reach(foot: Foot, goal: np.ndarray, drop: np.ndarray) -> np.ndarray:
    """Limit the goals (T, 3) of feet in the air to the leg's length, or to its length in the recording."""
    hip = foot.hip - drop[:, None] * [0.0, 0.0, 1.0]
    reach = goal - hip
    far = np.linalg.norm(reach, axis=1)
    own = np.minimum(np.linalg.norm(foot.heel - foot.hip, axis=1), foot.longest)
    longest = np.maximum(foot.length - SPARE_ALOFT, own)
    over = np.maximum(far - longest, 0.0) * (1.0 - np.minimum(foot.carries, 1.0))
    return goal - reach * (over / far)[:, None]
