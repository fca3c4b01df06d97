"""Foot planting: each stance's slide is removed by moving the foot, and the leg follows by two-bone inverse kinematics.

Which frames are in contact is known from the recording and carried along (docs/explanation/quality.md); nothing is
guessed from the motion itself. A stance is not pinned to one point and blended in and out. Instead each foot's shift
over the ground is one smooth curve D(t) that cancels the velocity of the point that carries the foot while it is in
contact and changes gently in between: the least squares problem of `solve_shift`, one banded system for the whole
motion.

A foot rolls: first the heel carries it, then the toe, on which the heel rises while it is still low and slow. Where a
leg does not reach, people rise on their toes; so does the foot here, then the pelvis is lowered, then the stance is
shortened at its ends, then the foot slides around the frames that are out of reach.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.banded_least_squares import BandedLeastSquares
from ..base.time_series import compute_running_maximum, find_runs, hann_smooth, number_runs
from ..base.vectors import arctan2, cross_product, dot_products, measure_lengths
from . import quaternion
from .contacts import measure_sole_height
from .humanoid import Limb, identify_joints, pose_legs
from .limb import solve_two_bone
from .skeleton import Skeleton

SMOOTH_WEIGHT, PULL_WEIGHT = 0.005, 3e-4
"""Weights of `solve_shift`: of the third difference of the shift, and of the shift itself."""

LONG_STANCE = 20.0
"""Frames at 30 fps of a stance from which on it weighs more, by the square of its length: over seconds the pull would
let a foot creep by centimetres."""

HEEL_SHARE = 0.2
"""Weight of a heel while its toe is in contact too, against the toe's 1."""

MAX_DROP, MAX_HEEL_RISE = 0.04, 0.35
"""Metres that the pelvis is lowered, and radians that a heel is raised about its toe, at most."""

HOLD_WEIGHT = 1e6
"""Weight of a shift that is given: so much larger than all others that it stays."""

MAX_SHIFT = 0.4
"""Metres that a foot is moved over the ground in contact, at most. Legs hardly reach further: 0.6 gives the same
figures. At 0.25, 9 instead of 6 of 1,513 stances travel more than 6 cm."""

EASE_DISTANCE, RESERVE, AIR_RESERVE = 0.012, 0.004, 0.02
"""Metres below full length from which a leg eases (`limb.soften_distance`), and reserves of length that are left in
contact and in the air: a leg that is nearly straight pops at the knee. A leg that was straighter in the recording may
be as straight."""

MIN_EASE_DISTANCE, MIN_RESERVE = 0.003, 0.002
"""The same of legs that were straight in the recording."""

TRIM_SECONDS = 0.1
"""Seconds by which a foot may land later, or leave earlier, than recorded."""

SLIDE_TOLERANCE = 0.004
"""Metres that a leg may be too short for its foot without its stance being relaxed."""

_RELAX_ROUNDS = 4  # rounds of relaxing the contact weights
_SPREAD_FRAMES = 3  # frames at 30 per second over which a rise or drop is spread


@dataclass(frozen=True, eq=False)
class PlantResult:
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
    recorded_slack: np.ndarray

    @property
    def displacements(self) -> np.ndarray:
        """(T - 1, 2, 2) metres that heel and toe move over the ground from frame to frame."""
        return np.stack([np.diff(self.heel[:, :2], axis=0), np.diff(self.toe[:, :2], axis=0)], axis=1)

    def move(self, shift: np.ndarray) -> Foot:
        """Return the foot moved by `shift` (T, 3) m."""
        return replace(self, heel=self.heel + shift, toe=self.toe + shift)

    @property
    def ease_distance(self) -> np.ndarray:
        """(T,) metres below full length from which the leg eases."""
        return np.clip(self.recorded_slack, MIN_EASE_DISTANCE, EASE_DISTANCE)

    @property
    def max_reach(self) -> np.ndarray:
        """(T,) metres, the leg's greatest length in contact."""
        return self.length - np.clip(self.recorded_slack, MIN_RESERVE, RESERVE)

    @property
    def contact_weight(self) -> np.ndarray:
        """(T,) contact weight of the foot, the larger one of heel and toe."""
        return self.weight.max(axis=1)


def plant_feet(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, heel_toe_contacts: np.ndarray, fps: float,
    max_drop: float = MAX_DROP, foot_moves: np.ndarray | None = None, level_feet: bool = True,
) -> PlantResult:
    """Plant the feet of a motion on the ground, z = 0, where they are in contact.

    The feet keep their own rotation except for a rotation about the vertical that holds a flat foot's direction, and
    for heels that rise where a leg could not reach. The pelvis is lowered where that is not enough.

    Args:
        skeleton: J joints.
        root: (T, 3) root positions of the constructed motion, metres, world.
        rotations: (T, J, 4) local rotations.
        heel_toe_contacts: (T, 2, 2) bool, left and right, heel and toe in contact with the ground.
        fps: frames per second.
        max_drop: metres by which the pelvis is lowered at most.
        foot_moves: (T, 2, 4) metres by which each foot is moved first, and radians that its heel is raised about its
            toe (`synthesis.construct.extra_steps`); None for none.
        level_feet: bring feet in contact to the height of the ground and let none go below it. False keeps all heights:
            a recording's own floor is uneven by centimetres, and pressing its feet onto z = 0 costs more jerk than it
            is worth.
    Returns:
        The planted motion with what it took.
    Raises:
        InputError: if the skeleton has no legs.
    """
    body = identify_joints(skeleton)
    places, world = pose_legs(skeleton, root, rotations)
    scale, spread = 30.0 / fps, int(round(_SPREAD_FRAMES * fps / 30.0))
    foot_moves = np.zeros((len(root), 2, 4)) if foot_moves is None else foot_moves
    feet = [build_foot(places, world, limb, heel_toe_contacts[:, side]) for side,
            limb in enumerate((body.left, body.right))]
    feet = [align_flat_foot(foot.move(foot_moves[:, side, :3]), scale) for side, foot in enumerate(feet)]
    lifts = [lift_to_ground(foot, measure_sole_height(skeleton), scale) if level_feet else np.zeros(len(root))
             for foot in feet]
    weights = [foot.weight for foot in feet]
    goals, is_new = [(foot.heel, foot.rotation) for foot in feet], [True, True]
    # solve with full weights first; stances that the legs cannot reach are relaxed and solved again
    for attempt in range(_RELAX_ROUNDS + 1):
        goals = [
            _compute_ankle_goal(foot, weight, lift, tilt=tilt, scale=scale, spread=spread) if new else goal
            for foot, weight, lift, tilt, new, goal in zip(feet, weights, lifts, np.moveaxis(foot_moves[..., 3], 1, 0),
                                                           is_new, goals)
        ]
        drop = compute_pelvis_drop(feet, [goal for goal, _ in goals], spread, max_drop)
        short = [measure_shortfall(replace(foot, weight=weight), goal, drop)
                 for foot, weight, (goal, _) in zip(feet, weights, goals)]
        if attempt == _RELAX_ROUNDS or max(s.max(initial=0.0) for s in short) <= SLIDE_TOLERANCE:
            break
        relaxed = [relax_stances(weight, foot.contact_weight > 0.0, s, fps)
                   for weight, foot, s in zip(weights, feet, short)]
        is_new = [not np.array_equal(weight, before) for weight, before in zip(relaxed, weights)]
        weights = relaxed
    root = root - drop[:, None] * [0.0, 0.0, 1.0]
    correction, miss = np.zeros((len(root), 2)), np.zeros((len(root), 2))
    out = rotations
    for side, (foot, (target, foot_rotation)) in enumerate(zip(feet, goals)):
        target = limit_to_reach(foot, target, drop)
        reached = solve_two_bone(skeleton, root, out, foot.limb.leg, target, end_rotation=foot_rotation,
                                 soft=foot.ease_distance)
        out, miss[:, side] = reached.rotations, reached.miss
        correction[:, side] = measure_lengths(target - places[:, foot.limb.foot])
    return PlantResult(root, out, correction, miss)


def build_foot(places: np.ndarray, world: np.ndarray, limb: Limb, contacts: np.ndarray) -> Foot:
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
    weight = compute_contact_weights(contacts)
    length = measure_lengths(knee - hip) + measure_lengths(heel - knee)
    own = length - measure_lengths(heel - hip)
    along = toe - heel if limb.toe is not None else quaternion.rotate(world[:, limb.foot], np.array([1.0, 0.0, 0.0]))
    yaw = arctan2(along[:, 1], along[:, 0])
    left = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros(len(yaw))], axis=1)
    return Foot(limb=limb, hip=hip, heel=heel, toe=toe, rotation=world[:, limb.foot], left=left, weight=weight,
                length=length, recorded_slack=own)


def compute_contact_weights(contacts: np.ndarray) -> np.ndarray:
    """Compute the contact weights (T, 2) of heel and toe from contacts (T, 2) bool.

    1 inside a stance, 0.5 in its first and last frame, while the foot arrives, else 0. The heel yields to a toe in
    contact.
    """
    padded = np.pad(contacts, ((1, 1), (0, 0)), mode="edge")
    inner = contacts & padded[:-2] & padded[2:]
    weight = np.where(inner, 1.0, np.where(contacts, 0.5, 0.0))
    weight[:, 0] *= 1.0 - (1.0 - HEEL_SHARE) * weight[:, 1]
    return weight


def align_flat_foot(foot: Foot, scale: float) -> Foot:
    """Rotate a foot about its heel and the vertical so that it keeps its direction while it is flat; scale: 30 / rate.
    """
    yaw = np.unwrap(arctan2(-foot.left[:, 0], foot.left[:, 1]))
    flat = np.minimum(foot.weight[:, 0] / HEEL_SHARE, foot.weight[:, 1]).clip(0.0, 1.0)
    spin = quaternion.from_up_angle(solve_shift(np.diff(yaw)[:, None], flat[:, None], scale)[:, 0])
    toe = foot.heel + quaternion.rotate(spin, foot.toe - foot.heel)
    left = quaternion.rotate(spin, foot.left)
    return replace(foot, toe=toe, rotation=quaternion.multiply(spin, foot.rotation), left=left)


def _compute_ankle_goal(
    foot: Foot, weight: np.ndarray, lift: np.ndarray, tilt: np.ndarray, scale: float, spread: int
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the ankle's goal (T, 3) and the foot's world rotation (T, 4); lift (T,) m, tilt (T,) radians of the heel.
    """
    ground, weight = solve_limited_shift(foot.displacements, weight, scale)
    moved = np.column_stack([ground, lift])
    rise = spread_peaks(solve_heel_rise(foot, moved) * foot.weight[:, 1], spread) + tilt
    roll = quaternion.from_axis_angle(foot.left, rise)
    ankle = foot.toe + moved + quaternion.rotate(roll, foot.heel - foot.toe)
    return ankle, quaternion.multiply(roll, foot.rotation)


def solve_heel_rise(foot: Foot, shift: np.ndarray) -> np.ndarray:
    """Solve the smallest angle by which a heel rises about its toe so that the leg reaches its ankle.

    With u from toe to hip, a from toe to heel, n the foot's left: |u - R a|^2 = L^2 is A cos r + B sin r = K.

    Args:
        foot: the foot before its shift.
        shift: (T, 3) metres by which the foot is shifted.
    Returns:
        (T,) radians, at most MAX_HEEL_RISE.
    """
    u, a, n = foot.hip - foot.toe - shift, foot.heel - foot.toe, foot.left
    across = dot_products(a, n)[..., None]
    level = a - across * n
    # even, odd and target are A, B and K of the docstring; `level` is the part of a that rotates
    even, odd = dot_products(u, level), dot_products(u, cross_product(n, level))
    length = foot.max_reach
    target = 0.5 * (dot_products(u, u) + dot_products(a, a) - length**2) - across[:, 0] * dot_products(u, n)
    most = np.hypot(even, odd)
    rise = arctan2(odd, even) - np.arccos(np.clip(target / np.maximum(most, 1e-9), -1.0, 1.0))
    return np.where((target > even) & (odd > 0.0), np.clip(rise, 0.0, MAX_HEEL_RISE), 0.0)


def solve_limited_shift(
    velocity: np.ndarray, weight: np.ndarray, scale: float, max_shift: float = MAX_SHIFT
) -> tuple[np.ndarray, np.ndarray]:
    """Solve the shift of a foot with stances relaxed that would need too large a shift.

    A foot that slides looks better than a leg stretched after it.

    Args:
        velocity: (T - 1, 2, 2) metres per frame of heel and toe.
        weight: (T, 2) contact weights.
        scale: 30 over the rate.
        max_shift: metres of shift above which a stance is relaxed.
    Returns:
        The shift (T, 2) in metres, and the weights (T, 2) with which it was found.
    """
    ground = solve_shift(velocity, weight, scale)
    for _ in range(4):
        far = np.where(weight.max(axis=1) > 0, measure_lengths(ground), 0.0)
        if far.max(initial=0.0) <= max_shift:
            break
        weight = relax_contact_weights(weight, far - max_shift)
        ground = solve_shift(velocity, weight, scale)
    return ground, weight


def relax_stances(weight: np.ndarray, planted: np.ndarray, short: np.ndarray, fps: float) -> np.ndarray:
    """Relax the contact weights (T, 2) of stances that a leg does not reach: only their ends where that is enough.

    Args:
        weight: (T, 2) contact weights.
        planted: (T,) bool, frames of stances.
        short: (T,) m that the leg is too short.
        fps: frames per second.
    """
    trimmed = _trim_stances(weight, planted, short, fps)
    return relax_contact_weights(trimmed, np.where(short > SLIDE_TOLERANCE, short, 0.0))


def _trim_stances(weight: np.ndarray, planted: np.ndarray, short: np.ndarray, fps: float) -> np.ndarray:
    """Trim the weights (T, 2) of stances at the ends that a leg does not reach, so that the rest of them holds.

    The foot lands up to TRIM_SECONDS later or leaves as much earlier, at most by a quarter of the stance at each end.
    Without this, two frames at its ends would make a whole stance slide.
    """
    weight = weight.copy()
    for first, end in find_runs(planted):
        most = min(int(round(TRIM_SECONDS * fps)), (end - first) // 4)
        late = np.flatnonzero(short[first : first + most] > SLIDE_TOLERANCE)
        early = np.flatnonzero(short[end - most : end] > SLIDE_TOLERANCE)
        if len(late):
            weight[first : first + late[-1] + 1] = 0.0
        if len(early):
            weight[end - most + early[0] : end] = 0.0
    return weight


def relax_contact_weights(weight: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Relax the weights (T, 2) of stances in which `excess` (T,) metres is above 0: to a third or less at 10 cm.

    Where at most half of a stance has an excess, it is relaxed around those frames alone. They are mostly its ends, and
    a foot that slides as it lands or leaves is seen less than one that slides for a whole stance. Of a stance that is
    dragged along for most of its time hardly anything could be held: it slides evenly.
    """
    relaxed = weight.copy()
    for first, end in find_runs(weight.max(axis=1) > 0):
        over = np.maximum(excess[first:end], 0.0)
        is_local = np.count_nonzero(over) <= 0.5 * len(over)
        over = compute_running_maximum(over, 1, 1) if is_local else np.full(len(over), over.max())
        relaxed[first:end] /= (1.0 + over / 0.02)[:, None] ** 2
    return relaxed


def _measure_firmness(is_planted: np.ndarray, scale: float) -> np.ndarray:
    """Measure how many times firmer than a step's each stance is, (T,) for frames (T,) bool of stances."""
    label = number_runs(is_planted)
    length = np.bincount(label)[label] * is_planted
    return np.maximum(scale * length / LONG_STANCE, 1.0) ** 2


def solve_shift(velocity: np.ndarray, weight: np.ndarray, scale: float = 1.0, fixed_shifts: np.ndarray
                | None = None) -> np.ndarray:
    """Solve the smooth shift D that cancels velocities where they carry weight.

    Minimizes sum w f |D' + v|^2 + SMOOTH_WEIGHT |D'''|^2 + PULL_WEIGHT |D|^2, with differences per frame at 30 frames
    per second, and f the firmness of long stances (LONG_STANCE).

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
    weights = np.minimum(weight[1:], weight[:-1])
    weights = weights * _measure_firmness(weights.max(axis=1) > 0.0, scale)[:, None]
    total = weights.sum(axis=1)
    weighted_velocity = np.einsum("tp,tpk->tk", weights, velocity)
    squares = BandedLeastSquares(count, columns=velocity.shape[2])
    # row t of the normal equations: D[t + 1] - D[t] = -v[t] adds -w v to equation t + 1 and +w v to equation t
    squares.right[1:] -= weighted_velocity
    squares.right[:-1] += weighted_velocity
    squares.add_difference(1, total)
    squares.add_difference(3, SMOOTH_WEIGHT / scale**4)
    squares.add_value(PULL_WEIGHT * scale**2)
    if fixed_shifts is not None:
        is_fixed = ~np.isnan(fixed_shifts[:, 0])
        squares.add_value(HOLD_WEIGHT * is_fixed, goal=np.where(is_fixed[:, None], fixed_shifts, 0.0))
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
    lift = fit_smooth_curve(-(low * weight).sum(axis=1), weight.sum(axis=1), scale)
    for _ in range(3):
        below = np.minimum(low.min(axis=1) + lift, 0.0)
        if below.min() > -1e-3:
            break
        sunk = np.where(below < -1e-3, 1.0, 0.0)
        lift = lift + fit_smooth_curve(-below * sunk, sunk, scale)
    return lift


def fit_smooth_curve(weighted_values: np.ndarray, weight: np.ndarray, scale: float,
                     smooth: float = SMOOTH_WEIGHT) -> np.ndarray:
    """Fit the smooth curve (T,) that is `weighted_values` / `weight` where the weight is large, and small elsewhere."""
    squares = BandedLeastSquares(len(weight))
    squares.add_difference(3, smooth / scale**6)
    squares.add_value(weight + 2e-2)
    squares.right += weighted_values
    return squares.solve()[:, 0]


def compute_pelvis_drop(feet: list[Foot], goals: list[np.ndarray], spread: int, most: float) -> np.ndarray:
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
        length = foot.max_reach
        level = measure_lengths(goal[:, :2] - foot.hip[:, :2])
        highest = goal[:, 2] + np.sqrt(np.maximum(length**2 - level**2, 0.0))
        lacks = np.where(level < length, foot.hip[:, 2] - highest, most)
        need = np.maximum(need, np.where(foot.contact_weight > 0, lacks, 0.0))
    return spread_peaks(np.clip(need, 0.0, most), spread)


def spread_peaks(need: np.ndarray, reach: int) -> np.ndarray:
    """Build a smooth curve (T,) that is nowhere below `need` (T,), widened by `reach` frames."""
    return hann_smooth(compute_running_maximum(need, reach, reach), reach)


def measure_shortfall(foot: Foot, goal: np.ndarray, drop: np.ndarray) -> np.ndarray:
    """Measure the metres (T,) that the leg of a foot in contact is too short for its goal (T, 3); drop (T,) of the
    pelvis.
    """
    reach = goal - foot.hip + drop[:, None] * [0.0, 0.0, 1.0]
    return np.where(foot.contact_weight > 0, measure_lengths(reach) - foot.max_reach, 0.0)


def limit_to_reach(foot: Foot, goal: np.ndarray, drop: np.ndarray) -> np.ndarray:
    """Limit the goals of feet in the air to the leg's length, or to its length in the recording.

    Args:
        foot: the foot.
        goal: (T, 3) m, world.
        drop: (T,) m by which the pelvis is lowered.
    Returns:
        (T, 3) m, world.
    """
    hip = foot.hip - drop[:, None] * [0.0, 0.0, 1.0]
    reach = goal - hip
    far = measure_lengths(reach)
    own = np.minimum(measure_lengths(foot.heel - foot.hip), foot.max_reach)
    longest = np.maximum(foot.length - AIR_RESERVE, own)
    over = np.maximum(far - longest, 0.0) * (1.0 - np.minimum(foot.contact_weight, 1.0))
    return goal - reach * (over / far)[:, None]
