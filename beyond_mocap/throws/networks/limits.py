"""Joint limits from the range of the training data, with hinges that do not bend backwards.

The range of a joint is stored about the mean of its rotations in the training data: the offset from that mean is a
rotation vector, and each of its three components stays between the lowest and highest value in the data, widened by
a margin. About the mean the vectors are short, also where a rig's rest pose is far from how the joint is used, so
the range has no discontinuity. A network that receives inputs unlike its training data can leave the range
(Fredriksson section 9.4: "extreme angular velocities"); `JointLimits.limit_rotations` brings the joints back.

`LimbLimits` apply the limits of a model's limb to other bones: to any rig that its motions are retargeted to, and to
the mirror image. Retargeting and mirroring transfer whole segments, so a joint of the other body has, up to a fixed
rotation of its axes (with a reflection, where mirrored), the world rotation of the model's: W' = M W B. The
rotations B are estimated from a motion that is present on both bodies, as the nearest orthogonal matrices to the
mean of W^T M W'; a joint with parent p is then checked as the model's joint with the local rotation B_p L' B^T. What
inverse kinematics of the legs and a missing collar bone change is not part of the mean, so it counts as bending.

As an array of a model: (J, 3, 3), rows middle (rotation vector, rad), lowest and highest offset (rad) of each joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...base.vectors import arctan2, unit_vector
from ...motion import quaternion
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion, compute_pose
from ...motion.skeleton import Skeleton, freeze_array
from .kinematics import transpose

FREE_RANGE = 4.0
"""Half-range in radians of a joint without limits: offsets are never that long."""
_MARGIN = np.radians(10.0)  # added to the range of the data on either side
_SHARE = 0.08  # share of the range, added on either side
_ROUNDS = 8  # iterations of the mean rotation and of the middle of a range
_MIN_MEAN_BEND = np.radians(6.0)  # below this mean bend the direction in which a hinge bends is unknown
_MAX_BACKWARD_BEND = np.radians(
    5.0)  # allowed backward bend of elbows and knees: people have it, and joint centres are not exact
_MIN_EXCESS = 1e-9  # radians: smaller excess is ignored
_MAX_ALTERNATIONS = 6  # alternations between ranges and hinges, until both are satisfied
_LONG_OFFSET = 2.0  # radians: above this the other sign of the rotation vector is considered too
_TINY = 1e-12  # metres: shorter vectors have no direction
_ONES = np.ones(3)
_PARTS = np.zeros((9, 4))  # the nine elements of a matrix -> its skew part as a vector, and its trace
_PARTS[[7, 2, 3], [0, 1, 2]], _PARTS[[5, 6, 1], [0, 1, 2]], _PARTS[[0, 4, 8], 3] = 1.0, -1.0, 1.0

_MIRROR = np.diag([1.0, -1.0, 1.0])
_FRAMES = 24  # frames of a motion from which the joint axes are estimated


def estimate_joint_limits(rotations: np.ndarray, free_joints: tuple[int, ...] = (0,)) -> np.ndarray:
    """Estimate joint limits from local rotations.

    The limits are the range of the data, widened by 10 degrees and 8 % of the range: a few people do not show
    everything that a joint can do.

    Args:
        rotations: (N, J, 4) local rotations, unit quaternions.
        free_joints: indices of joints without limits.
    Returns:
        (J, 3, 3) rad: middle as a rotation vector, lowest and highest offset from it.
    """
    q = np.asarray(rotations, dtype=float)
    middle = _compute_mean_rotation(q)
    for _ in range(_ROUNDS):
        offsets = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(middle), q))
        low, high = offsets.min(axis=0), offsets.max(axis=0)
        # measured from the middle of the range, vectors stay far from pi, where their sign flips
        middle = quaternion.multiply(middle, quaternion.from_rotation_vector(0.5 * (low + high)))
    offsets = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(middle), q))
    low, high = offsets.min(axis=0), offsets.max(axis=0)
    margin = _MARGIN + _SHARE * (high - low)
    out = np.stack([quaternion.to_rotation_vector(middle), low - margin, high + margin], axis=1)
    out[list(free_joints), 1:] = np.array([[-FREE_RANGE], [FREE_RANGE]])
    return out


def _compute_mean_rotation(q: np.ndarray) -> np.ndarray:
    """Compute the mean rotation (J, 4) of unit quaternions (N, J, 4), by steps along the mean offset (Karcher mean)."""
    middle = quaternion.normalize(np.sum(np.where(np.sum(q * q[:1], axis=-1, keepdims=True) < 0, -q, q), axis=0))
    for _ in range(_ROUNDS):
        offset = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(middle), q)).mean(axis=0)
        middle = quaternion.multiply(middle, quaternion.from_rotation_vector(offset))
    return quaternion.normalize(middle)


@dataclass(frozen=True, eq=False, kw_only=True)
class Hinge:
    """Direction in which an elbow or knee bends.

    Attributes:
        joint: joint of the lower bone.
        end: joint that ends the lower bone.
        across: (3,) unit bending axis, in the axes of the joint's parent.
        along: (3,) unit direction of the lower bone when straight, in the axes of the joint's parent.
        bone: (3,) m, the lower bone in the joint's own axes.
    """

    joint: int
    end: int
    across: np.ndarray
    along: np.ndarray
    bone: np.ndarray


class JointLimits:
    """Joint limits prepared for evaluation.

    Args:
        skeleton: skeleton of the joints.
        limits: (J, 3, 3) rad, as from `estimate_joint_limits`.
    Raises:
        InputError: if the shape is wrong, a value is not finite, or a lowest angle is above the highest.
    """

    def __init__(self, skeleton: Skeleton, limits: np.ndarray):
        limits = freeze_array(limits)
        if limits.shape != (len(skeleton), 3, 3) or not np.isfinite(limits).all():
            raise InputError("joint limits", f"an array {limits.shape}", f"finite numbers ({len(skeleton)}, 3, 3)")
        if np.any(limits[:, 1] > limits[:, 2]):
            raise InputError("joint limits", "a lowest angle above the highest", "the lowest angle first")
        self.skeleton = skeleton
        self.middle = quaternion.to_matrix(quaternion.from_rotation_vector(limits[:, 0]))
        self._back = np.ascontiguousarray(self.middle.swapaxes(-1, -2))
        self.low, self.high = limits[:, 1], limits[:, 2]
        self._set_hinges(_find_hinges(skeleton, self.middle))

    def _set_hinges(self, hinges: tuple[Hinge, ...]) -> None:
        """Store hinges with their bones and bending planes as arrays."""
        self.hinges = hinges
        self._joints = np.array([hinge.joint for hinge in self.hinges], dtype=int)
        self._bones = np.array([hinge.bone for hinge in self.hinges]).reshape(-1, 3, 1)
        axes = [(np.cross(hinge.across, hinge.along), hinge.along) for hinge in self.hinges]
        self._axes = np.array(axes).reshape(-1, 2, 3)

    def select_joints(self, joints: Sequence[int]) -> JointLimits:
        """Return the limits of the given joints only.

        Arrays passed to the result have just these joints, in this order.
        """
        joints, part = list(joints), copy(self)
        part.middle, part._back, part.low, part.high = (
            values[joints] for values in (self.middle, self._back, self.low, self.high)
        )
        part._set_hinges(tuple(replace(one, joint=joints.index(one.joint)) for one in self.hinges
                               if one.joint in joints))
        return part

    def compute_offsets(self, local: np.ndarray) -> np.ndarray:
        """Compute rotation vectors (..., J, 3) rad from the middle to local rotations (..., J, 3, 3)."""
        m = self._back @ local
        parts = m.reshape(*m.shape[:-2], 9) @ _PARTS  # twice the sine times the axis, and the trace
        sine = 0.5 * parts[..., :3]
        length = np.sqrt((sine * sine) @ _ONES)
        angle = arctan2(length, 0.5 * (parts[..., 3] - 1.0))
        scale = np.where(length > 1e-7, angle / np.maximum(length, 1e-7), 1.0)
        offsets = scale[..., None] * sine
        return self._unwrap_offsets(offsets, angle) if angle.max() > _LONG_OFFSET else offsets

    def _unwrap_offsets(self, offsets: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Replace long offsets (..., J, 3) by their equivalent of opposite sign where that is nearer to the range.

        Beyond half a revolution the short vector flips to the opposite side.
        """
        long = offsets * (1.0 - 2.0 * np.pi / np.maximum(angle, _LONG_OFFSET))[..., None]
        over = [np.abs(way - np.clip(way, self.low, self.high)).max(-1) for way in (offsets, long)]
        return np.where(((angle > _LONG_OFFSET) & (over[1] < over[0]))[..., None], long, offsets)

    def measure_excess(self, local: np.ndarray) -> np.ndarray:
        """Measure the excess (..., J) rad of local rotations (..., J, 3, 3): outside the range, or bent backwards."""
        offsets = self.compute_offsets(local)
        out = np.linalg.norm(offsets - np.clip(offsets, self.low, self.high), axis=-1)
        joints = [hinge.joint for hinge in self.hinges]
        out[..., joints] = np.maximum(out[..., joints], self._measure_backward_bend(local))
        return out

    def limit_rotations(self, local: np.ndarray, permitted: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Limit local rotations to their ranges.

        Args:
            local: (..., J, 3, 3) local rotations.
            permitted: (..., J, 3, 3) rotations that are allowed, even outside the range, or None.
        Returns:
            The limited rotations, and by how much each joint was outside, (..., J) rad.
        """
        low, high, most = self.low, self.high, _MAX_BACKWARD_BEND
        if permitted is not None:
            allowed = self.compute_offsets(permitted)
            low, high = np.minimum(low, allowed), np.maximum(high, allowed)
            most = np.maximum(most, -self.measure_bends(permitted))
        over = np.zeros(())
        for _ in range(_MAX_ALTERNATIONS):  # correcting a hinge may leave the range, and the reverse
            local, out = self._limit_to_range(local, low, high)
            over, back = np.maximum(over, out), self._measure_backward_bend(local, most)
            if not (back > _MIN_EXCESS).any():
                break
            local, over = self._unbend_hinges(local, over, back)
        return local, over

    def _limit_to_range(self, local, low, high) -> tuple[np.ndarray, np.ndarray]:
        """Clip the offsets of joints to their ranges; also return the excess (..., J) rad."""
        offsets = self.compute_offsets(local)
        kept = np.minimum(np.maximum(offsets, low), high)
        over = np.abs(offsets - kept).max(-1)
        outside = over > _MIN_EXCESS
        if outside.any():
            local, joints = local.copy(), np.nonzero(outside)
            turns = quaternion.to_matrix(quaternion.from_rotation_vector(kept[joints]))
            local[joints] = self.middle[joints[-1]] @ turns
        return local, over

    def _unbend_hinges(self, local, over, back) -> tuple[np.ndarray, np.ndarray]:
        """Rotate hinges about their bending axes by the excess `back` (..., H) rad; also return the total excess."""
        local, over = local.copy(), over.copy()
        for number, hinge in enumerate(self.hinges):
            turn = quaternion.from_rotation_vector(back[..., number, None] * hinge.across)
            local[..., hinge.joint, :, :] = quaternion.to_matrix(turn) @ local[..., hinge.joint, :, :]
            over[..., hinge.joint] = np.maximum(over[..., hinge.joint], back[..., number])
        return local, over

    def measure_bends(self, local: np.ndarray) -> np.ndarray:
        """Measure the bend (..., H) rad of each hinge in local rotations (..., J, 3, 3): negative is backwards."""
        bones = local[..., self._joints, :, :] @ self._bones
        shares = self._axes @ bones
        return arctan2(shares[..., 0, 0], shares[..., 1, 0])

    def _measure_backward_bend(self, local: np.ndarray, most: float | np.ndarray = _MAX_BACKWARD_BEND) -> np.ndarray:
        """Measure by how much (..., H) rad hinges bend further backwards than `most`."""
        return np.maximum(-most - self.measure_bends(local), 0.0)


def _find_hinges(skeleton: Skeleton, middle: np.ndarray) -> tuple[Hinge, ...]:
    """Find the elbows and knees whose mean pose, local rotations (J, 3, 3), shows in which direction they bend."""
    body = identify_joints(skeleton)
    found = []
    for limb in (body.left, body.right):
        for upper, lower, end in ((limb.upper_arm, limb.lower_arm, limb.hand),
                                  (limb.upper_leg, limb.lower_leg, limb.foot)):
            if None not in (upper, lower, end):
                found.append(_build_hinge(skeleton, middle, lower, end))
    return tuple(hinge for hinge in found if hinge is not None)


def _build_hinge(skeleton: Skeleton, middle: np.ndarray, lower: int, end: int) -> Hinge | None:
    """Build a hinge; None if there are joints between the two bones, or if the mean pose is straight."""
    if skeleton.parents[end] != lower:
        return None
    along = unit_vector(skeleton.offsets[lower], min_length=_TINY)
    across = np.cross(along, unit_vector(middle[lower] @ skeleton.offsets[end], min_length=_TINY))
    if np.linalg.norm(across) < np.sin(_MIN_MEAN_BEND):
        return None
    return Hinge(joint=lower, end=end, across=unit_vector(across, min_length=_TINY), along=along,
                 bone=skeleton.offsets[end])


@dataclass(frozen=True, eq=False)
class LimbLimits:
    """Limits of one limb of a model, applied to a body.

    Attributes:
        limits: limits of the model's limb alone.
        joints: C joint indices of the body's limb, as many as the model's.
        parent_axes: (C, 3, 3), from the axes of the joints' parents to those of the model's.
        axes: (C, 3, 3), from the axes of the joints to those of the model's.
    """

    limits: JointLimits
    joints: tuple[int, ...]
    parent_axes: np.ndarray
    axes: np.ndarray

    @classmethod
    def from_motions(
        cls, limits: JointLimits, own: Motion, own_joints: tuple[int, ...], target_motion: Motion,
        joints: tuple[int, ...], mirrored: bool = False,
    ) -> LimbLimits:
        """Estimate the axes of a limb from one motion on two bodies, frame by frame at the same place.

        Args:
            limits: limits of the model.
            own: a motion of the model's skeleton.
            own_joints: the model's limb.
            target_motion: the same motion on the body.
            joints: the body's limb.
            mirrored: the body has the mirror image at y = 0.
        """
        frames = np.unique(np.linspace(0, len(own) - 1, _FRAMES).astype(int))
        poses = [(m.skeleton, m.root_positions[frames], m.rotations[frames]) for m in (own, target_motion)]
        turns = [quaternion.to_matrix(compute_pose(*pose)[1]) for pose in poses]
        image = _MIRROR if mirrored else np.eye(3)

        def estimate_axes(theirs: list[int], mine: list[int]) -> np.ndarray:
            both = transpose(turns[0][:, theirs]) @ image @ turns[1][:, mine]
            left, _, right = np.linalg.svd(both.mean(axis=0))
            return left @ right

        parents = [
            [motion.skeleton.parents[joint] for joint in limb] for motion,
            limb in ((own, own_joints), (target_motion, joints))
        ]
        return cls(
            limits.select_joints(own_joints), tuple(joints), estimate_axes(*parents),
            estimate_axes(list(own_joints), list(joints))
        )

    def limit_rotations(self, rotations: np.ndarray, permitted: np.ndarray) -> np.ndarray:
        """Limit local rotations (W, C, 4) of the limb's joints.

        Where `permitted` (W, C, 4) exceeds the limits, it is the limit.
        """
        local, over = self.limits.limit_rotations(self._to_model_axes(rotations), self._to_model_axes(permitted))
        if not over.any():
            return rotations
        back = quaternion.from_matrix(transpose(self.parent_axes) @ local @ self.axes)
        return np.where(over[..., None] > 0.0, quaternion.match_signs(back, rotations), rotations)

    def measure_excess(self, motion: Motion) -> np.ndarray:
        """Measure the excess (T, C) rad of the limb's joints beyond their limits."""
        return self.limits.measure_excess(self._to_model_axes(motion.rotations[:, list(self.joints)]))

    def _to_model_axes(self, rotations: np.ndarray) -> np.ndarray:
        """Convert rotations (..., C, 4) of the body's limb to matrices (..., C, 3, 3) of the model's joints."""
        return self.parent_axes @ quaternion.to_matrix(rotations) @ transpose(self.axes)
