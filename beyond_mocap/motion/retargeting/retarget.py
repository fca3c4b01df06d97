"""Retargeting: the same motion on other bones, independent of the rest poses of the two skeletons.

Per joint the world rotation of the *segment* is transferred (see `anatomy`), so every bone points and is twisted as the
source's: W' = W F F'^-1, with F and F' the segment's axes in the source's and the target's joint. Spines and necks of
other lengths share the bend by arc length. Then size: everything on the ground is scaled by the ratio s of leg lengths
(thigh plus shank), with the ankle's own height kept,

    x' = s x,   z' = floor + a' + s (z - floor - a),

for the middle between the hip joints and for both ankles, which the target's legs reach by two-bone inverse kinematics
with the knees pointing where the source's point. Travel is scaled with the legs, so a foot in contact stays still;
where positions matter (a pitch, a ball) travel is kept instead, x' = x, and the legs take longer or shorter steps than
their own. Joints that a skeleton lacks follow the segment that carries them. `joint_pairs` matches the joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...base.vectors import unit_vectors
from .. import limb, quaternion
from ..humanoid import Limb
from ..motion import Motion, compute_local_rotations, forward_kinematics
from ..skeleton import Skeleton
from .anatomy import Anatomy, compute_spine_shares, estimate_anatomy, list_head_chain
from .joint_pairs import JointPairs, pair_joints

_SOFT_DISTANCE = 0.01  # m below full length from where a limb eases
_LIMB_PARTS = ("shoulder", "upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot", "toe")
_CARRIERS = {"upper_arm": "shoulder", "lower_arm": "upper_arm", "hand": "lower_arm", "toe": "foot"}
# two rigs are the same, axes and all, when nearly all of their bones' length points the same way in their rest pose
# within this angle; suits that measure each wearer have a neck or a spine joint elsewhere
_SAME_RIG, _SAME_SHARE = np.cos(np.radians(12.0)), 0.9
_TRUNK_ROUNDS = 3  # rounds of rotating the trunk and measuring the remaining error
_UP = np.array([0.0, 0.0, 1.0])


class Retargeter:
    """Retargets recordings of one rig to another, at their own rate: both rigs are analysed once.

    Root positions are metres, world, Z up; heights stay above the same floor. A skeleton given as its own target
    returns the same motion.
    """

    def __init__(
        self, sample: Motion, skeleton: Skeleton, bone_map: dict[str, str] | str | Path | None = None, *,
        example: Motion | None = None, standing: np.ndarray | None = None, example_standing: np.ndarray | None = None,
        keeps_travel: bool = False,
    ):
        """Match the joints and analyse both rigs.

        Args:
            sample: frames of the recordings (their order does not matter).
            skeleton: the target.
            bone_map: source joint -> target joint, or the path of a JSON file with such an object;
                its pairs override those found by names and structure.
            example: a recording on `skeleton`, which shows how its rig twists its bones and holds its trunk; without it
                the rest pose does.
            standing, example_standing: (T, 2) bool, left and right foot on the ground in `sample` and in `example`,
                which shows how soles lie; without it low feet count as in contact.
            keeps_travel: footprints and the path over the ground stay where they are, whatever the legs' length.
        Raises:
            InputError: if either skeleton has no legs or the map names an unknown joint.
        """
        self.keeps_travel = keeps_travel
        self.pairs = pair_joints(sample, skeleton, bone_map, example)
        self.source = estimate_anatomy(sample.skeleton, self.pairs.source, sample, standing)
        same = _is_same_rig(sample.skeleton, skeleton) if example is None else sample.skeleton.has_same_bones(skeleton)
        if same:  # its own recording shows best how the rig is used: the same skeleton gets the same motion
            example, example_standing = replace(sample, skeleton=skeleton), standing
        self.target = estimate_anatomy(skeleton, self.pairs.target, example, example_standing)

    def retarget(self, motion: Motion) -> Motion:
        """Retarget `motion`, a recording of the sample's skeleton, to the other skeleton."""
        return _Transfer(motion, self.source, self.target, self.pairs, self.keeps_travel).build_motion()


def _is_same_rig(a: Skeleton, b: Skeleton) -> bool:
    """Whether two skeletons share names, tree and axes, and differ in little but lengths."""
    if a.names != b.names or a.parents != b.parents:
        return False
    products = np.linalg.norm(a.offsets, axis=1) * np.linalg.norm(b.offsets, axis=1)
    agree = np.sum(a.offsets * b.offsets, axis=1) >= _SAME_RIG * products
    lengths = np.sqrt(products)
    return bool(lengths[agree].sum() >= _SAME_SHARE * lengths.sum())


class _Transfer:
    """The transfer of one motion from `source` to `target`."""

    def __init__(self, motion: Motion, source: Anatomy, target: Anatomy, pairs: JointPairs, keeps_travel: bool = False):
        self.fps, self.source, self.target, self.pairs = motion.fps, source, target, pairs
        self.places, self.world = forward_kinematics(motion)
        self.scale = target.leg / source.leg
        self.travel_scale = 1.0 if keeps_travel else self.scale
        soles = [self.places[:, side.foot, 2] - source.ankle for side in self._list_limbs(source)]
        soles += [self.places[:, side.toe, 2] - source.ball for side in self._list_limbs(source)
                  if side.toe is not None]
        self.floor = float(np.percentile(np.min(soles, axis=0), 2))
        self.target_rotations: dict[int, np.ndarray] = {}

    def build_motion(self) -> Motion:
        """Build the motion on the target's skeleton."""
        self._transfer_trunk()
        sides = list(zip(self._list_limbs(self.source), self._list_limbs(self.target)))
        for mine, theirs in sides:
            self._transfer_limb(mine, theirs)
        world = self._align_trunk(self._compute_world_rotations())
        root = self._compute_root(world)
        places = _compute_positions(self.target.skeleton, world) + root[:, None]
        for mine, theirs in sides:
            self._solve_leg(places, mine, theirs)
        return Motion(self.target.skeleton, root, compute_local_rotations(self.target.skeleton,
                                                                          self._compute_world_rotations()), self.fps)

    @staticmethod
    def _list_limbs(anatomy: Anatomy) -> tuple[Limb, Limb]:
        return anatomy.body.left, anatomy.body.right

    def _compute_source_rotation(self, joint: int) -> np.ndarray:
        """Compute the rotation (T, 4) of the source's segment."""
        return quaternion.multiply(self.world[:, joint], self.source.axes[joint])

    def _set_target_rotation(self, joint: int, rotation: np.ndarray) -> None:
        """Set the rotation (T, 4) of the target's segment."""
        self.target_rotations[joint] = quaternion.multiply(rotation, quaternion.inverse(self.target.axes[joint]))

    def _transfer_trunk(self) -> None:
        """Transfer the rotations of pelvis, spine, neck and head; joints between share them by arc length."""
        source, target = self.source.body, self.target.body
        pelvis, chest = self._compute_source_rotation(source.hips), self._compute_source_rotation(source.chest)
        self._set_target_rotation(target.hips, pelvis)
        below = [pelvis, *(self._compute_source_rotation(joint) for joint in source.spine)]
        shares = [0.0, *compute_spine_shares(self.source.skeleton, source)]
        for joint, share in zip(target.spine, compute_spine_shares(self.target.skeleton, target)):
            self._set_target_rotation(joint, _interpolate_rotations(shares, below, share))
        neck = list_head_chain(self.source.skeleton, source)
        chain = list_head_chain(self.target.skeleton, target)
        turns = [chest, *(self._compute_source_rotation(joint) for joint in neck)]
        shares = np.linspace(0.0, 1.0, len(turns)) if neck else [0.0]
        for number, joint in enumerate(chain):
            self._set_target_rotation(joint, _interpolate_rotations(shares, turns, (number + 1) / len(chain)))

    def _transfer_limb(self, mine: Limb, theirs: Limb) -> None:
        """Transfer one side's rotations; what the source lacks follows the part that carries it, in the end the chest.
        """
        for part in _LIMB_PARTS:
            joint = getattr(theirs, part)
            if joint in self.target.known_joints:
                known = [p for p in _list_carriers(part) if getattr(mine, p) in self.source.known_joints]
                self._set_target_rotation(joint, self._compute_source_rotation(getattr(mine, known[0]) if known
                                                                               else self.source.body.chest))

    def _compute_world_rotations(self) -> np.ndarray:
        """Compute the world rotations (T, J, 4) of all target joints: those that are set, and the others carried along.
        """
        skeleton = self.target.skeleton
        world = np.empty((len(self.world), len(skeleton), 4))
        for joint, parent in enumerate(skeleton.parents):
            if joint in self.target_rotations:
                world[:, joint] = self.target_rotations[joint]
                continue
            above = world[:, parent] if parent >= 0 else quaternion.identity(len(world))
            world[:, joint] = quaternion.multiply(above, self.target.mean_rotations[joint])
            if joint in self.pairs.others and parent >= 0:
                extra = self._compute_extra_rotation(self.pairs.others[joint])
                world[:, joint] = quaternion.multiply(extra, world[:, joint])
        return world

    def _compute_extra_rotation(self, joint: int) -> np.ndarray:
        """Compute the world rotation (T, 4) of a source joint beyond that of its parent."""
        parent = self.source.skeleton.parents[joint]
        if parent < 0:
            return quaternion.identity(len(self.world))
        carried = quaternion.multiply(self.world[:, parent], self.source.mean_rotations[joint])
        return quaternion.multiply(self.world[:, joint], quaternion.inverse(carried))

    def _align_trunk(self, world: np.ndarray) -> np.ndarray:
        """Align the trunk, bending it below the chest where there are joints, so that the neck lies in the source's
        direction.
        """
        spine, tops = self.target.body.spine, self.pairs.trunk_tops
        bending = spine[:-1] or spine
        if not bending or tops is None:
            return world
        line = unit_vectors(self.places[:, tops[0]] - _compute_mid_hips(self.places, self.source), _UP)
        for _ in range(_TRUNK_ROUNDS):
            places = _compute_positions(self.target.skeleton, world)
            start, middle = places[:, bending[0]], _compute_mid_hips(places, self.target)
            neck = places[:, tops[1]]
            length = np.linalg.norm(neck - middle, axis=1, keepdims=True)
            turn = quaternion.rotation_between(neck - start, middle + line * length - start)
            for joint in bending:
                self.target_rotations[joint] = quaternion.multiply(turn, self.target_rotations[joint])
            world = self._compute_world_rotations()
        return world

    def _scale_positions(self, positions: np.ndarray) -> np.ndarray:
        """Scale source positions (T, 3) to the target's size."""
        ground = self.floor + self.source.ankle
        heights = self.floor + self.target.ankle + self.scale * (positions[:, 2] - ground)
        return np.column_stack([self.travel_scale * positions[:, :2], heights])

    def _compute_root(self, world: np.ndarray) -> np.ndarray:
        """Compute the target's root (T, 3): its hip joints' middle is where the source's is."""
        middle = _compute_mid_hips(_compute_positions(self.target.skeleton, world), self.target)
        return self._scale_positions(_compute_mid_hips(self.places, self.source)) - middle

    def _solve_leg(self, places: np.ndarray, mine: Limb, theirs: Limb) -> None:
        """Move an ankle to the source's, the knee pointing like the source's; `places` (T, J, 3): positions before
        that.
        """
        hip, knee, ankle = (places[:, j] for j in (theirs.upper_leg, theirs.lower_leg, theirs.foot))
        goal = self._scale_positions(self.places[:, mine.foot])
        upper, lower = (np.linalg.norm(b - a, axis=1) for a, b in ((hip, knee), (knee, ankle)))
        goal = _limit_reach(hip, ankle, goal, upper + lower)
        pole = self._compute_knee_pole(mine, hip, knee, ankle, _compute_bend_height(np.linalg.norm(goal - hip, axis=1),
                                                                                    upper, lower))
        swing = quaternion.rotation_between(ankle - hip, goal - hip)
        new_knee, new_ankle, _ = limb.solve_limb_bend(
            hip, goal, upper, lower=lower, pole=quaternion.rotate(swing, pole), soft=1e-9,
        )
        thigh = quaternion.rotation_between(knee - hip, new_knee - hip)
        shank = quaternion.rotation_between(ankle - knee, new_ankle - new_knee)
        self.target_rotations[theirs.upper_leg] = quaternion.multiply(thigh, self.target_rotations[theirs.upper_leg])
        self.target_rotations[theirs.lower_leg] = quaternion.multiply(shank, self.target_rotations[theirs.lower_leg])


    def _compute_knee_pole(self, mine: Limb, hip: np.ndarray, knee: np.ndarray, ankle: np.ndarray,
                           height: np.ndarray) -> np.ndarray:
        """Compute where a knee points (T, 3).

        As the source's, which shows little where it is straighter than the target's will be, `height` (T,) metres off
        the line hip-ankle; the rest of the bend is about the thigh's own hinge.
        """
        line = unit_vectors(ankle - hip, -_UP)
        ahead = quaternion.rotate(self._compute_source_rotation(mine.upper_leg), np.array([1.0, 0.0, 0.0]))
        off, ahead = (v - np.sum(v * line, axis=1, keepdims=True) * line for v in (knee - hip, ahead))
        lacking = np.maximum(height - np.linalg.norm(off, axis=1), 0.0)
        return off + lacking[:, None] * ahead


def _compute_bend_height(reach: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """Compute the distance (T,) of a limb's middle joint from the line between its ends, `reach` (T,) metres apart."""
    along = (upper**2 - lower**2 + reach**2) / np.maximum(2.0 * reach, 1e-9)
    return np.sqrt(np.maximum(upper**2 - along**2, 0.0))


def _list_carriers(part: str) -> list[str]:
    """List a limb's part and those above it that carry it, from below."""
    found = [part]
    while found[-1] in _CARRIERS:
        found.append(_CARRIERS[found[-1]])
    return found


def _limit_reach(hip: np.ndarray, ankle: np.ndarray, goal: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Limit the goal (T, 3) softly where it would stretch a leg straighter than the source's directions do."""
    requested, own = np.linalg.norm(goal - hip, axis=1), np.linalg.norm(ankle - hip, axis=1)
    limited = np.maximum(limb.soften_distance(requested, longest, _SOFT_DISTANCE), np.minimum(requested, own))
    return hip + (goal - hip) * (limited / np.maximum(requested, 1e-9))[:, None]


def _compute_mid_hips(places: np.ndarray, anatomy: Anatomy) -> np.ndarray:
    """Compute the middle between the hip joints: (T, 3) from positions (T, J, 3)."""
    return 0.5 * (places[:, anatomy.body.left.upper_leg] + places[:, anatomy.body.right.upper_leg])


def _interpolate_rotations(shares: Sequence[float] | np.ndarray, rotations: list[np.ndarray],
                           share: float) -> np.ndarray:
    """Interpolate the rotation (T, 4) at `share` among `rotations` that are known at rising `shares`."""
    high = min(int(np.searchsorted(shares, share - 1e-9)), len(shares) - 1)
    low = max(high - 1, 0)
    width = shares[high] - shares[low]
    if width < 1e-9 or abs(shares[high] - share) < 1e-9:
        return rotations[high]
    return quaternion.slerp(rotations[low], rotations[high], np.clip((share - shares[low]) / width, 0.0, 1.0))


def _compute_positions(skeleton: Skeleton, world: np.ndarray) -> np.ndarray:
    """Compute positions (T, J, 3) from world rotations (T, J, 4), the root at the origin."""
    parents = list(skeleton.parents[1:])
    bones = quaternion.rotate(world[:, parents], skeleton.offsets[1:])
    places = np.zeros((len(world), len(skeleton), 3))
    for joint, parent in enumerate(parents, 1):
        places[:, joint] = places[:, parent] + bones[:, joint - 1]
    return places
