"""Move hands and feet towards their targets in a pose that the networks predicted.

Two-bone inverse kinematics: the knee or elbow bends or stretches until the limb has the required length, then the
whole limb rotates to the target by the shortest arc (Fredriksson sections 3.3.1 and 7.7.3). One limb at a time with
numpy or jax, as the layer that networks are trained with (section 9.4), and all four at once for use. `motion.limb`
does the same over all frames of a finished motion; here one frame follows another, nothing may look ahead, and every
step needs a derivative.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import unit_vector
from ...motion.limb import soften_distance
from .chains import LIMB_OF, Chains
from .kinematics import Pose, compute_pose_transforms, transpose, update_joints
from .limits import JointLimits

_STRETCH = 0.995  # share of a limb's length beyond which the body moves too
_MAX_DISPLACEMENT = 0.05  # metres that the body moves in one frame at most
_ROUNDS = 4  # iterations of moving the body towards targets out of reach
_ONES = np.ones((3, 1))
_CROSS = np.zeros((9, 3))  # the nine products of two vectors' components -> their cross product
_CROSS[[5, 6, 1], [0, 1, 2]], _CROSS[[7, 2, 3], [0, 1, 2]] = 1.0, -1.0
_SKEW = np.zeros((3, 9))  # a vector -> the matrix of the cross product with it
_SKEW[[0, 1, 2], [7, 2, 3]], _SKEW[[0, 1, 2], [5, 6, 1]] = 1.0, -1.0
_EYE = np.eye(3)
_HINGE_WEIGHT = 0.03  # weight of the given hinge axis against the sine of the limb's own bend
_TINY = 1e-12  # m^2: square roots keep a finite derivative at zero


def find_hinge_axes(chains: Chains, limits: JointLimits | None) -> np.ndarray:
    """Find the unit axes (4, 3) about which elbows and knees bend, in the axes of the middle joint's parent.

    They come from the limits; where those show none (or are None), from the line between the hips of the rest pose.
    """
    known = {hinge.joint: hinge.across for hinge in (limits.hinges if limits is not None else ())}
    offsets = chains.skeleton.offsets
    across = offsets[chains.sockets[2]] - offsets[chains.sockets[3]]
    across = unit_vector(across)
    sides = (-across, -across, across, across)
    return np.stack([known.get(joint, side) for joint, side in zip(chains.middles, sides)])


def reach_limb(number: int, chains: Chains, after: Pose, requested, share, axes: np.ndarray, keeps_rotation: bool,
               xp) -> Pose:
    """Move one limb towards its target.

    Args:
        number: index of the limb in `EFFECTORS`.
        chains: chains of the skeleton.
        after: the pose to change.
        requested: (..., 3) m, target of the limb's end, world.
        share: share of the distance to the target that the limb's end moves.
        axes: (4, 3), from `find_hinge_axes`.
        keeps_rotation: hand or foot keeps its world rotation (a given hand; every foot, so that the toe reaches its
            target); otherwise it moves with the lower bone.
        xp: numpy or jax.numpy.
    Returns:
        The pose; all joints of the limb are valid, in numpy and in jax.
    """
    upper, middle, end, effector = _list_limb_joints(chains, number)
    places, turns, parents = after.positions, after.turns, chains.skeleton.parents
    tip = places[..., effector, :]
    target = interpolate_target(tip, requested, share) - (tip - places[..., end, :])
    hinge = xp.matmul(turns[..., parents[middle], :, :], axes[number])
    first, second, _ = solve_two_bones(
        places[..., upper, :], places[..., middle, :], places[..., end, :], target=target, hinge=hinge, xp=xp
    )
    given = {joint: xp.matmul(first, turns[..., joint, :, :]) for joint in _list_joints_between(chains, upper, middle)}
    given |= {joint: xp.matmul(second, turns[..., joint, :, :]) for joint in _list_joints_between(chains, middle, end)}
    if keeps_rotation:
        given[end] = turns[..., end, :, :]
    return update_joints(chains.skeleton, after, chains.known[LIMB_OF[number]], root=after.root, local={}, given=given,
                         xp=xp)


class LimbReach:
    """Move all four limbs of one pose at once: same result as `reach_limb` for each, several times as fast."""

    def __init__(self, chains: Chains, limits: JointLimits | None, hands_given: bool):
        self.chains = chains
        self._axes = find_hinge_axes(chains, limits)
        joints = [_list_limb_joints(chains, number) for number in range(4)]
        self._upper, self._middle, self._end, self._tip = (list(column) for column in zip(*joints))
        parents = chains.skeleton.parents
        self._above_upper, self._above_middle, self._above_end = (
            [parents[joint] for joint in column] for column in (self._upper, self._middle, self._end)
        )
        middle, end = (
            self._measure_bones(high, low) for high, low in ((self._upper, self._middle), (self._middle, self._end))
        )
        self._lengths = middle + end
        self._rotation_keepers = [0, 1, 2, 3] if hands_given else [2, 3]

    def __call__(self, pose: Pose, requested: np.ndarray, share: np.ndarray) -> Pose:
        """Move the effectors of a pose towards their targets; root and trunk keep their rotations.

        Args:
            pose: the pose.
            requested: (4, 3) m, targets, world.
            share: (4,) share of the distance that each effector moves.
        """
        places, turns = pose.positions, pose.turns
        tip, end = places[self._tip], places[self._end]
        target = interpolate_target(tip, requested, share[:, None]) - (tip - end)
        displacement = self._compute_displacement(places[self._upper], end, target)
        places, end, root = places + displacement, end + displacement, pose.root + displacement
        return build_static_pose(self.chains, root, self._bend_limbs(pose.local, places, turns, end, target))

    def reach_fully(self, pose: Pose, requested: np.ndarray) -> np.ndarray:
        """Compute local rotations (J, 3, 3) that bring the effectors as near to `requested` (4, 3) m as possible."""
        tip, end = pose.positions[self._tip], pose.positions[self._end]
        return self._bend_limbs(pose.local, pose.positions, pose.turns, end, requested - (tip - end))

    def _bend_limbs(self, local, places, turns, end, target) -> np.ndarray:
        """Compute local rotations that bring the limbs' ends from `end` (4, 3) m to `target` (4, 3) m."""
        hinge = (turns[self._above_middle] @ self._axes[:, :, None])[..., 0]
        first, second, _ = solve_two_bones(places[self._upper], places[self._middle], end, target=target, hinge=hinge,
                                           xp=np)
        local = local.copy()
        local[self._upper] = transpose(turns[self._above_upper]) @ first @ turns[self._upper]
        bent = transpose(first @ turns[self._above_middle])
        local[self._middle] = bent @ second @ turns[self._middle]
        carried = transpose(second @ turns[self._above_end])
        local[[self._end[n] for n in self._rotation_keepers]] = (carried @ turns[self._end])[self._rotation_keepers]
        return local

    def _measure_bones(self, high: list[int], low: list[int]) -> np.ndarray:
        """Measure the distances (4,) m from joints down to others, joints between them at rest."""
        lengths = []
        for top, joint in zip(high, low):
            vector = np.zeros(3)
            while joint != top:
                vector, joint = vector + self.chains.skeleton.offsets[joint], self.chains.skeleton.parents[joint]
            lengths.append(np.linalg.norm(vector))
        return np.array(lengths)

    def _compute_displacement(self, top: np.ndarray, end: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Compute the displacement (3,) m of the whole body towards targets out of the limbs' reach.

        Args:
            top: (4, 3) m, first joints of the limbs.
            end: (4, 3) m, ends of the limbs; limbs reach at least as far as they already do.
            target: (4, 3) m.
        """
        displacement, now = np.zeros(3), end - top
        reach = np.maximum(_STRETCH * self._lengths, np.sqrt((now * now).sum(-1)))
        for _ in range(_ROUNDS):
            remaining = target - top - displacement
            far = np.sqrt((remaining * remaining).sum(-1))
            short = np.maximum(far - reach, 0.0)
            if short.max() < 1e-6:
                break
            displacement = displacement + (remaining * (short / far)[:, None]).sum(0)
        return displacement * min(1.0, _MAX_DISPLACEMENT / max(float(np.sqrt(displacement @ displacement)), 1e-9))


def build_static_pose(chains: Chains, root: np.ndarray, local: np.ndarray) -> Pose:
    """Build a pose from local rotations (J, 3, 3) and a root at (3,) m; its joint displacements are zero."""
    places, turns = compute_pose_transforms(chains.skeleton.offsets, chains.skeleton.parents, root, local)
    return Pose(root, local, places, turns, np.zeros_like(places))


def _list_limb_joints(chains: Chains, number: int) -> tuple[int, int, int, int]:
    """List upper, middle and end joint and effector of a limb; a foot ends its leg, its toe is the effector."""
    end = chains.effectors[number] if number < 2 else chains.ankles[number - 2]
    return chains.sockets[number], chains.middles[number], end, chains.effectors[number]


def _list_joints_between(chains: Chains, high: int, low: int) -> list[int]:
    """List the joints from `high` (included) down to `low` (not included)."""
    joint, found = chains.skeleton.parents[low], []
    while joint != high:
        found.append(joint)
        joint = chains.skeleton.parents[joint]
    return [*found, high]


def interpolate_target(predicted, requested, share):
    """Interpolate the point (..., 3) m to reach, at `share` from the predicted to the requested point.

    A linearly interpolated point avoids over-correction of the joints.
    Source: Fredriksson section 7.7.3.
    """
    return predicted + share * (requested - predicted)


def solve_two_bones(top, middle, end, target, hinge, xp, soft: float = 0.01):
    """Solve the world rotations that bring a limb's end joint to a target.

    Bones keep their lengths; a target out of reach is approached along its line, one too close to `top` is kept at
    the difference of the bone lengths.

    Args:
        top: (..., 3) m, first joint, world; `middle`, `end` and `target` alike.
        middle: (..., 3) m, elbow or knee.
        end: (..., 3) m, end joint.
        target: (..., 3) m, where the end joint has to be.
        hinge: (..., 3) unit, world, bending axis of the middle joint (upper bone x lower bone of a bent limb); it
            only counts where the limb is nearly straight.
        xp: numpy or jax.numpy.
        soft: metres below full length at which the limb begins to ease (`motion.limb.soften_distance`).
    Returns:
        Rotations of the upper and the lower bone (..., 3, 3), to multiply from the left to the bones' world
        rotations, and the end joint's new position (..., 3) m.
    """
    upper, lower = middle - top, end - middle
    long_upper, long_lower = _measure_length(upper, xp), _measure_length(lower, xp)
    along, down = upper / long_upper, lower / long_lower
    axis = _cross(along, down) + _HINGE_WEIGHT * hinge
    axis = _normalize(axis - _dot(axis, along) * along, xp)
    to_target = target - top
    requested = _measure_length(to_target, xp)
    # the limb does not shorten where it is already straighter than the eased reach
    reach = xp.maximum(_ease_reach(requested, long_upper, long_lower, soft, xp),
                       xp.minimum(requested, _measure_length(end - top, xp)))
    cosine = (reach * reach - long_upper * long_upper - long_lower * long_lower) / (2.0 * long_upper * long_lower)
    cosine = xp.clip(cosine, -1.0, 1.0)
    # limited after squaring: in float32 no number between 1 - 1e-9 and 1 keeps the derivative of the root finite
    bent = cosine * along + xp.sqrt(xp.maximum(1.0 - cosine * cosine, 2e-9)) * _cross(axis, along)
    swing = _compute_shortest_arc(_normalize(long_upper * along + long_lower * bent, xp), to_target / requested)
    return swing, swing @ _compute_shortest_arc(down, bent), top + to_target * (reach / requested)


def _ease_reach(requested, upper, lower, soft, xp):
    """Compute the eased reach for a requested one, metres."""
    longest = upper + lower
    return xp.maximum(soften_distance(requested, longest, soft, xp), xp.abs(upper - lower) + 0.02 * longest)


def _compute_shortest_arc(one, other):
    """Compute rotations (..., 3, 3) from unit vectors `one` (..., 3) to unit vectors `other` by the shortest arc."""
    cosine = _dot(one, other)[..., None]
    axis = _cross(one, other)
    skew = (axis @ _SKEW).reshape(*axis.shape[:-1], 3, 3)
    return cosine * _EYE + skew + axis[..., :, None] * (axis[..., None, :] / (1.0 + cosine + 1e-9))


def _cross(a, b):
    """Compute the cross product of (..., 3) vectors as one matrix product."""
    products = a[..., :, None] * b[..., None, :]
    return products.reshape(*products.shape[:-2], 9) @ _CROSS


def _dot(a, b):
    return (a * b) @ _ONES


def _measure_length(v, xp):
    return xp.sqrt((v * v) @ _ONES + _TINY)


def _normalize(v, xp):
    return v / _measure_length(v, xp)
