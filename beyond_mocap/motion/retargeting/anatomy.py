"""Directions of a body's segments in each joint's own axes: what makes a retarget independent of rest poses.

Rest poses and axes of rigs differ (CMU's legs splay, LAFAN1's limbs all lie along X, arms hang or form a T). What is
the same in all of them is the body: a thigh runs from hip to knee, and its knee bends backward about one axis. For each
joint j this module estimates the anatomical frame F_j: the rotation whose columns are the segment's forward, left and
up directions in the joint's own axes when the body stands upright, facing +X, arms hanging. Then W_j F_j, with W_j the
joint's world rotation, is the rotation of the *segment*, in terms that hold for any skeleton, without rest poses.

Directions along bones and between hips are known from the offsets alone. What they leave open comes from recorded
frames: knees and elbows are hinges, so thigh x shank is the knee's axis wherever it bends; a sole is level while the
foot is in contact; the trunk's joints, collar bones and hands without a tip take their mean posture over the upright
frames as neutral. Every such mean is taken in the joint's own axes, so that other axes (another rest pose of the same
recording) give the same motion. Without a recording the rest pose is the only frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.vectors import cross_product, unit_vectors
from .. import quaternion
from ..humanoid import Humanoid, Limb
from ..motion import Motion, compute_pose
from ..skeleton import Skeleton, freeze_array
from .structure import list_between

_UP = np.array([0.0, 0.0, 1.0])
_LEFT = np.array([0.0, 1.0, 0.0])
_SAMPLED_FRAMES = 400  # frames of an example that are used
_MIN_RECORDING = 3  # fewer frames are a single pose, no recording: a foot that looks flat in it counts as flat
# frames count by the cosine of the trunk's lean to this power: 10 degrees 0.74, 20 degrees 0.29, 45 degrees 0.001
_UPRIGHT = 20
# weight of the body's own axes against a knee's or elbow's hinge (sine of its bend): decides where the limb is straight
_STRAIGHT_WEIGHT = 0.03
# slopes of the line from ankle to toe in a flat foot, radians: least, usual, steepest
_SLOPE = np.radians((-6.0, 22.0, 50.0))
_COLLAR = np.cos(np.radians(50.0))
# thickness below the toe joint and least height of an ankle, shares of the leg's length
_BALL, _LOWEST_ANKLE = 0.022, 0.06


@dataclass(frozen=True, eq=False, kw_only=True)
class Anatomy:
    """A skeleton's segments.

    Attributes:
        skeleton: J joints.
        body: the joints by meaning.
        axes: (J, 4) F_j as quaternions, for the joints in `known_joints`; the identity for others.
        known_joints: joints with an anatomical frame.
        mean_rotations: (J, 4) mean local rotations, for joints without a meaning.
        leg: thigh plus shank, metres.
        ankle: its height above the ground when the foot is flat, metres.
        ball: the toe joint's height then, metres.
    """

    skeleton: Skeleton
    body: Humanoid
    axes: np.ndarray
    known_joints: frozenset[int]
    mean_rotations: np.ndarray
    leg: float
    ankle: float
    ball: float


def compute_spine_shares(skeleton: Skeleton, body: Humanoid) -> np.ndarray:
    """Compute how far along the trunk each joint of `body.spine` rotates: (S,), pelvis 0, chest 1, by arc length."""
    if not body.spine:
        return np.zeros(0)
    top = next((joint for joint in (body.neck, body.head) if joint is not None), None)
    lengths = np.linalg.norm(skeleton.offsets[list(body.spine)], axis=1)
    last = np.linalg.norm(skeleton.offsets[top]) if top is not None else lengths[-1]
    ends = np.cumsum([*lengths, last])
    middles = 0.5 * (ends[:-1] + ends[1:])
    return middles / middles[-1] if middles[-1] > 1e-6 else np.linspace(0.0, 1.0, len(middles) + 1)[1:]


def list_head_chain(skeleton: Skeleton, body: Humanoid) -> tuple[int, ...]:
    """List the joints from neck to head, from below; one or none where the body lacks them."""
    if body.head is None or body.neck is None:
        return tuple(joint for joint in (body.neck, body.head) if joint is not None)
    return (body.neck, *list_between(skeleton.parents, body.neck, body.head), body.head)


def estimate_anatomy(
    skeleton: Skeleton, body: Humanoid, example: Motion | None = None, foot_contacts: np.ndarray | None = None
) -> Anatomy:
    """Estimate the anatomy of a skeleton.

    Args:
        skeleton: J joints.
        body: their meaning.
        example: a recording on the skeleton (its bones' lengths are not used); None uses the rest pose.
        foot_contacts: (T, 2) bool, feet of the example in contact; without it feet count as in contact where they are
            low.
    Returns:
        The anatomy.
    """
    return _AnatomyEstimator(skeleton, body, example, foot_contacts).build_anatomy()


class _AnatomyEstimator:
    """Frames of a recording, and the means over them in the joints' own axes."""

    def __init__(self, skeleton: Skeleton, body: Humanoid, example: Motion | None, standing: np.ndarray | None):
        self.skeleton, self.body = skeleton, body
        root, local = np.zeros((1, 3)), quaternion.identity(1, len(skeleton))
        self.is_single_pose = example is None or len(example) < _MIN_RECORDING
        if example is not None:
            frames = np.unique(np.linspace(0, len(example) - 1, _SAMPLED_FRAMES).astype(int))
            root, local = example.root_positions[frames], example.rotations[frames]
            standing = None if standing is None else standing[frames]
        self.places, self.world = compute_pose(skeleton, root, local)
        self.local, self.foot_contacts = local, standing
        left, right = body.left, body.right
        self.pelvis = 0.5 * (self.places[:, left.upper_leg] + self.places[:, right.upper_leg])
        self.trunk_directions = unit_vectors(self._find_trunk_top() - self.pelvis, _UP)
        self.across_hips = unit_vectors(self.places[:, left.upper_leg] - self.places[:, right.upper_leg], _LEFT)
        self.across_chest = self._compute_across_chest()
        self.weight = (np.maximum(self.trunk_directions[:, 2], 0.1) / max(self.trunk_directions[:, 2].max(),
                                                                          0.1)) ** _UPRIGHT
        self.axes = quaternion.identity(len(skeleton))
        self.known_joints: set[int] = set()

    def _find_trunk_top(self) -> np.ndarray:
        """Find the top of the trunk (T, 3) m, world: neck, head, the middle of the shoulders, or the chest."""
        body = self.body
        top = next((joint for joint in (body.neck, body.head) if joint is not None), None)
        if top is not None:
            return self.places[:, top]
        if body.left.upper_arm is not None and body.right.upper_arm is not None:
            return 0.5 * (self.places[:, body.left.upper_arm] + self.places[:, body.right.upper_arm])
        return self.places[:, body.chest] if body.spine else self.pelvis

    def _compute_across_chest(self) -> np.ndarray:
        """Compute the unit vectors (T, 3) from right to left shoulder."""
        arms = (self.body.left.upper_arm, self.body.right.upper_arm)
        if None in arms:
            return self.across_hips
        return unit_vectors(self.places[:, arms[0]] - self.places[:, arms[1]], self.across_hips)

    def average_in_joint(self, joint: int, vectors: np.ndarray, weight: np.ndarray | None = None) -> np.ndarray:
        """Average world vectors (T, 3) seen in a joint's axes, weighted: (3,)."""
        weight = self.weight if weight is None else weight
        seen = quaternion.rotate(quaternion.inverse(self.world[:, joint]), vectors)
        return weight @ seen / max(weight.sum(), 1e-12)

    def compute_segment_rotation(self, joint: int) -> np.ndarray:
        """Compute the world rotation (T, 4) of a known joint's segment."""
        return quaternion.multiply(self.world[:, joint], self.axes[joint])

    def compute_segment_direction(self, joint: int, column: int) -> np.ndarray:
        """Compute the segment's forward (0), left (1) or up (2) direction in the world: (T, 3)."""
        return quaternion.rotate(self.compute_segment_rotation(joint), np.eye(3)[column])

    def set_axes(self, joint: int, up: np.ndarray, left: np.ndarray, first: str = "up") -> None:
        """Set F of a joint from its up and left direction (3,), of which the one named `first` is kept exactly."""
        if first == "up":
            up = unit_vectors(up, _UP)
            left = unit_vectors(left - (left @ up) * up, _find_normal(up))
        else:
            left = unit_vectors(left, _LEFT)
            up = unit_vectors(up - (up @ left) * left, _find_normal(left))
        forward = np.cross(left, up)
        self.axes[joint] = quaternion.from_axes(forward, left, up)
        self.known_joints.add(joint)

    def set_axes_like(self, joint: int, segment: np.ndarray) -> None:
        """Set F of a joint so that its segment rotates like `segment` (T, 4) on average."""
        seen = quaternion.multiply(quaternion.inverse(self.world[:, joint]), segment)
        self.axes[joint] = quaternion.average(seen, self.weight)
        self.known_joints.add(joint)

    def build_anatomy(self) -> Anatomy:
        """Build the anatomy: trunk first, then the limbs, which refer to it."""
        self._estimate_trunk()
        for limb in (self.body.left, self.body.right):
            self._estimate_leg(limb)
            self._estimate_foot(limb)
            if limb.upper_arm is not None:
                self._estimate_arm(limb)
        still = np.stack([quaternion.average(self.local[:, joint], self.weight) for joint in range(len(self.skeleton))])
        return Anatomy(skeleton=self.skeleton, body=self.body, axes=freeze_array(self.axes),
                       known_joints=frozenset(self.known_joints), mean_rotations=freeze_array(still),
                       leg=self._measure_leg_length(), ankle=self._measure_ankle_height(), ball=_BALL
                       * self._measure_leg_length())

    def _estimate_trunk(self) -> None:
        """Estimate hips, spine, neck and head from the trunk's line and the axes across hips and chest."""
        body = self.body
        self.set_axes(body.hips, self.average_in_joint(body.hips, self.trunk_directions),
                      self.average_in_joint(body.hips, self.across_hips), "left")
        for joint, share in zip(body.spine, compute_spine_shares(self.skeleton, body)):
            across = (1.0 - share) * self.across_hips + share * self.across_chest
            self.set_axes(joint, self.average_in_joint(joint, self.trunk_directions),
                          self.average_in_joint(joint, across))
        chain = list_head_chain(self.skeleton, body)
        tip = _find_tip(self.skeleton, chain[-1]) if chain else None
        crown = self.trunk_directions if tip is None else unit_vectors(quaternion.rotate(self.world[:, chain[-1]], tip),
                                                                       _UP)
        for number, joint in enumerate(chain, 1):
            share = number / len(chain)  # a neck is bent half as far as the head, which its tip shows in every frame
            up = self.average_in_joint(joint, (1.0 - share) * self.trunk_directions + share * crown)
            self.set_axes(joint, up, self.average_in_joint(joint, self.across_chest))

    def _estimate_arm(self, limb: Limb) -> None:
        """Estimate an arm: bones give its line, the elbow's bend its hinge."""
        chest = self.body.chest
        if limb.shoulder is not None:
            self._estimate_collar(limb)
        if limb.lower_arm is None:
            self.set_axes_like(limb.upper_arm, self.compute_segment_rotation(chest))
            return
        upper = unit_vectors(self.places[:, limb.lower_arm] - self.places[:, limb.upper_arm], -_UP)
        end = limb.hand if limb.hand is not None else limb.lower_arm
        lower = unit_vectors(self.places[:, end] - self.places[:, limb.lower_arm], upper)
        hinge = -cross_product(upper, lower) + _STRAIGHT_WEIGHT * cross_product(-upper,
                                                                                self.compute_segment_direction(chest,
                0))
        self.set_axes(limb.upper_arm, -self._measure_bone(limb.upper_arm, limb.lower_arm),
                      self.average_in_joint(limb.upper_arm, hinge))
        if limb.hand is None:
            self.set_axes_like(limb.lower_arm, self.compute_segment_rotation(limb.upper_arm))
            return
        hinge = -cross_product(upper, lower) + _STRAIGHT_WEIGHT * self.compute_segment_direction(limb.upper_arm, 1)
        self.set_axes(limb.lower_arm, -self._measure_bone(limb.lower_arm, limb.hand),
                      self.average_in_joint(limb.lower_arm, hinge))
        fingers = _find_finger_direction(self.skeleton, limb.hand)
        if fingers is None:
            self.set_axes_like(limb.hand, self.compute_segment_rotation(limb.lower_arm))
        else:
            self.set_axes(limb.hand, -fingers,
                          self.average_in_joint(limb.hand, self.compute_segment_direction(limb.lower_arm, 1)))

    def _estimate_collar(self, limb: Limb) -> None:
        """Estimate a collar bone: held as it is on average; sideways where that is implausible (folded-up rest poses).
        """
        self.set_axes_like(limb.shoulder, self.compute_segment_rotation(self.body.chest))
        neutral = quaternion.inverse(self.axes[limb.shoulder])
        held = unit_vectors(quaternion.rotate(neutral, self._measure_bone(limb.shoulder, limb.upper_arm)), _UP)
        sideways = np.array([0.0, 1.0 if limb is self.body.left else -1.0, 0.0])
        if held @ sideways < _COLLAR and np.linalg.norm(self._measure_bone(limb.shoulder, limb.upper_arm)) > 1e-3:
            neutral = quaternion.multiply(quaternion.rotation_between(held, sideways), neutral)
            self.axes[limb.shoulder] = quaternion.inverse(neutral)

    def _estimate_leg(self, limb: Limb) -> None:
        """Estimate thigh and shank: bones give their line, the knee's bend the hinge."""
        thigh = unit_vectors(self.places[:, limb.lower_leg] - self.places[:, limb.upper_leg], -_UP)
        shank = unit_vectors(self.places[:, limb.foot] - self.places[:, limb.lower_leg], -_UP)
        hinge = cross_product(thigh, shank)
        beside = _STRAIGHT_WEIGHT * self.compute_segment_direction(self.body.hips, 1)
        self.set_axes(
            limb.upper_leg, -self._measure_bone(limb.upper_leg, limb.lower_leg),
            self.average_in_joint(limb.upper_leg, hinge + beside)
        )
        beside = _STRAIGHT_WEIGHT * self.compute_segment_direction(limb.upper_leg, 1)
        self.set_axes(limb.lower_leg, -self._measure_bone(limb.lower_leg, limb.foot),
                      self.average_in_joint(limb.lower_leg, hinge + beside))

    def _measure_bone(self, joint: int, child: int) -> np.ndarray:
        """Measure the vector (3,) from `joint` to a joint below it, in its axes, metres; averaged over joints between.
        """
        if self.skeleton.parents[child] == joint:
            return self.skeleton.offsets[child]
        return self.average_in_joint(joint, self.places[:, child] - self.places[:, joint])

    def _estimate_foot(self, limb: Limb) -> None:
        """Estimate a foot: flat is how the sole lies, on average, in the frames in contact with the ankle low."""
        ahead = self._find_foot_direction(limb)
        left = self.average_in_joint(limb.foot, self.compute_segment_direction(limb.lower_leg, 1))
        if ahead is None:
            ahead = self.average_in_joint(limb.foot, self.compute_segment_direction(limb.lower_leg, 0))
        level = self._weight_flat_frames(limb)
        ups = np.broadcast_to(_UP, self.trunk_directions.shape)
        up = None if level is None else unit_vectors(self.average_in_joint(limb.foot, ups, level), _UP)
        along = unit_vectors(ahead, _UP)
        if up is None or not _SLOPE[0] < np.arcsin(np.clip(-(along @ up), -1.0, 1.0)) < _SLOPE[2]:
            left = unit_vectors(left - (left @ along) * along, _find_normal(along))
            up = quaternion.rotate(quaternion.from_axis_angle(left, -_SLOPE[1]), np.cross(along, left))
        self.set_axes(limb.foot, up, np.cross(up, ahead))
        if limb.toe is not None:
            self._estimate_toe(limb, level)

    def _find_foot_direction(self, limb: Limb) -> np.ndarray | None:
        """Find the vector from ankle to toe joint or to the foot's tip, in the foot's axes, metres; None for a foot
        without.
        """
        if limb.toe is not None:
            return self._measure_bone(limb.foot, limb.toe)
        return _find_tip(self.skeleton, limb.foot)

    def _weight_flat_frames(self, limb: Limb) -> np.ndarray | None:
        """Weight the frames (T,) in which the foot is flat on the ground; None where there are none."""
        heights = self.places[:, limb.foot, 2]
        if self.is_single_pose:
            upright = self.trunk_directions[0, 2] > 0.9 and self.compute_segment_direction(limb.lower_leg, 2)[0,
                    2] > 0.7
            return np.ones(len(heights)) if upright else None
        side = 0 if limb is self.body.left else 1
        low = heights <= np.percentile(heights, 40) if self.foot_contacts is None else self.foot_contacts[:, side]
        low = low & (self.trunk_directions[:, 2] > 0.5)
        if low.sum() < 3:
            return None
        return (low & (heights <= np.percentile(heights[low], 40))).astype(float)

    def _estimate_toe(self, limb: Limb, level: np.ndarray | None) -> None:
        if level is None:
            self.set_axes_like(limb.toe, self.compute_segment_rotation(limb.foot))
            return
        seen = quaternion.multiply(quaternion.inverse(self.world[:, limb.toe]),
                                   self.compute_segment_rotation(limb.foot))
        self.axes[limb.toe] = quaternion.average(seen, level)
        self.known_joints.add(limb.toe)

    def _measure_leg_length(self) -> float:
        total = 0.0
        for limb in (self.body.left, self.body.right):
            for high, low in ((limb.upper_leg, limb.lower_leg), (limb.lower_leg, limb.foot)):
                total += float(np.linalg.norm(self._measure_bone(high, low)))
        return total / 2.0

    def _measure_ankle_height(self) -> float:
        """Measure the ankle's height above the ground, mean of both feet, metres."""
        leg, heights = self._measure_leg_length(), []
        for limb in (self.body.left, self.body.right):
            ahead = self._find_foot_direction(limb)
            drop = 0.07 * leg
            if ahead is not None:
                drop = -quaternion.rotate(quaternion.inverse(self.axes[limb.foot]), ahead)[2]
            heights.append(max(drop + (_BALL * leg if limb.toe is not None else 0.0), _LOWEST_ANKLE * leg))
        return float(np.mean(heights))


def _find_tip(skeleton: Skeleton, joint: int) -> np.ndarray | None:
    """Find the joint's end site (3,) metres; None where it has none or one of no length."""
    offset = skeleton.tip_offset(joint)
    return offset if np.linalg.norm(offset) > 1e-3 else None


def _find_finger_direction(skeleton: Skeleton, hand: int) -> np.ndarray | None:
    """Find the mean position of the first finger joints, in the hand's axes; else the hand's tip; None without either.
    """
    offsets = skeleton.offsets[list(skeleton.children(hand))].reshape(-1, 3)
    mean = offsets.mean(axis=0) if len(offsets) else np.zeros(3)
    return mean if np.linalg.norm(mean) > 1e-3 else _find_tip(skeleton, hand)


def _find_normal(direction: np.ndarray) -> np.ndarray:
    other = np.eye(3)[int(np.argmin(np.abs(direction)))]
    return unit_vectors(other - (other @ direction) * direction, other)
