"""Fit a body to joints: the trunk turns as hips and shoulders do, limbs reach for wrists and ankles.

Every rotation follows from the joints of its frame, so no search is needed: the joints were smoothed over time before.
Elbows and knees bend in the plane of the seen ones, and where a limb is straight forwards or backwards as they do in
people.
"""

from __future__ import annotations

import numpy as np

from ..base.vectors import cross_product, unit_vectors
from ..motion import limb, quaternion
from ..motion.humanoid import Limb, identify_joints
from ..motion.motion import Motion, compute_local_rotations, compute_pose
from ..motion.retargeting.neutral import NeutralStance

NEEDED = tuple(f"{side}_{part}" for part in ("shoulder", "hip", "knee", "ankle") for side in ("left", "right"))
"""Landmarks without which a body cannot be fitted."""
_TOES = ("big_toe", "small_toe", "foot")
_USUAL_BEND = 0.02  # metres by which an elbow or knee that is straight points the way it bends
_MOST_RAISED = np.radians(45.0)  # of a collar bone out of its rest (Inman et al. 1944: 40 in a raised arm)
_MOST_BENT = np.radians(40.0)  # of a foot up against its shank
_SOFT = 0.003  # metres below full length from where a limb eases
_UP = np.array([0.0, 0.0, 1.0])
_LEFT = np.array([0.0, 1.0, 0.0])
_FORWARD = np.array([1.0, 0.0, 0.0])


def collect_joints(landmarks: tuple[str, ...], positions: np.ndarray) -> dict[str, np.ndarray]:
    """Collect joints by name: those seen, and `left_toe`, `right_toe` and `face` made of the finer points.

    Args:
        landmarks: L names.
        positions: (T, L, 3) metres, without gaps.
    Returns:
        Name -> (T, 3).
    """
    seen = np.isfinite(positions).all(axis=(0, 2))
    joints = {name: positions[:, number] for number, name in enumerate(landmarks) if seen[number]}
    for side in ("left", "right"):
        toes = [joints[f"{side}_{toe}"] for toe in _TOES if f"{side}_{toe}" in joints]
        if toes:
            joints[f"{side}_toe"] = np.mean(toes, axis=0)
    return joints


def fit_body(joints: dict[str, np.ndarray], fps: float, stance: NeutralStance) -> Motion:
    """Fit a body with bones of fixed length to joints.

    Args:
        joints: name -> (T, 3) metres, world, Z up, smooth and without gaps; NEEDED at least.
        fps: frames per second.
        stance: of the skeleton.
    Returns:
        The motion.
    """
    fit = _BodyFit(joints, stance)
    fit.turn_trunk()
    fit.turn_head()
    for side, joints_of in (("left", fit.body.left), ("right", fit.body.right)):
        fit.bend_leg(side, joints_of)
        fit.bend_arm(side, joints_of)
    local, root, _ = fit.compute_pose()
    return Motion(fit.neutral.skeleton, root, local, fps)


class _BodyFit:
    """The rotations of a body so far, relative to its neutral stance.

    Attributes:
        joints: name -> (T, 3) metres.
        neutral: the neutral stance of the skeleton.
        body: its joints by meaning.
        turns: joint -> (T, 4) world rotation relative to the neutral stance; others follow their parent.
    """

    def __init__(self, joints: dict[str, np.ndarray], neutral: NeutralStance):
        self.joints, self.neutral = joints, neutral
        self.body = identify_joints(self.neutral.skeleton)
        self.turns: dict[int, np.ndarray] = {}
        self.places = np.zeros(0)

    def compute_pose(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute local rotations (T, J, 4), root positions (T, 3) and positions of all joints (T, J, 3)."""
        skeleton, count = self.neutral.skeleton, len(self.joints["left_hip"])
        world = np.empty((count, len(skeleton), 4))
        for joint, parent in enumerate(skeleton.parents):
            world[:, joint] = self.turns[joint] if joint in self.turns else world[:, parent]
        local = compute_local_rotations(skeleton, quaternion.multiply(world, self.neutral.rotations))
        places, _ = compute_pose(skeleton, np.zeros((count, 3)), local)
        middle = 0.5 * (places[:, self.body.left.upper_leg] + places[:, self.body.right.upper_leg])
        root = 0.5 * (self.joints["left_hip"] + self.joints["right_hip"]) - middle
        return local, root, places + root[:, None]

    def turn_trunk(self) -> None:
        """Turn pelvis and chest as hips and shoulders lie across the trunk; the spine shares what lies between."""
        left, right, rest = self.body.left, self.body.right, self.neutral.positions
        hips, shoulders = self._measure_across("hip"), self._measure_across("shoulder")
        trunk = self._measure_trunk()
        own = 0.5 * (rest[left.upper_arm] + rest[right.upper_arm] - rest[left.upper_leg] - rest[right.upper_leg])
        still = quaternion.inverse(build_frame(own[None], (rest[left.upper_leg] - rest[right.upper_leg])[None]))
        pelvis, chest = (quaternion.multiply(build_frame(trunk, across), still) for across in (hips, shoulders))
        self.turns[self.body.hips] = pelvis
        for number, joint in enumerate(self.body.spine, 1):
            self.turns[joint] = quaternion.slerp(pelvis, chest, number / len(self.body.spine))
        self.places = self.compute_pose()[2]

    def turn_head(self) -> None:
        """Turn the head as the ears and the nose, or the eyes, lie; without them it follows the chest."""
        joints, head = self.joints, self.body.head
        across = next((joints[f"left_{part}"] - joints[f"right_{part}"] for part in ("ear", "eye")
                       if f"left_{part}" in joints and f"right_{part}" in joints), None)
        front = joints.get("nose")
        if head is None or across is None or front is None:
            return
        part = "ear" if "left_ear" in joints and "right_ear" in joints else "eye"
        ahead = front - 0.5 * (joints[f"left_{part}"] + joints[f"right_{part}"])
        level = cross_product(unit_vectors(ahead, _FORWARD), unit_vectors(across, _LEFT))
        turn = build_frame(level, across)
        self.turns[head] = turn
        if self.body.neck is not None:
            self.turns[self.body.neck] = quaternion.slerp(self.turns[self.body.chest], turn, 0.45)

    def bend_leg(self, side: str, joints_of: Limb) -> None:
        """Bend a leg so that its ankle is where it is seen, and lay its foot along the toes; where these are not seen,
        along the shank.
        """
        pelvis = self.turns[self.body.hips]
        chain = (joints_of.upper_leg, joints_of.lower_leg, joints_of.foot)
        hinge, thigh, shank = self._bend((f"{side}_knee", f"{side}_ankle"), chain, self.places[:, chain[0]],
                                         quaternion.rotate(pelvis, _FORWARD))
        self.turns[joints_of.upper_leg] = limb.build_bone_frame(thigh, hinge)
        self.turns[joints_of.lower_leg] = limb.build_bone_frame(shank, hinge)
        if f"{side}_toe" in self.joints and joints_of.toe is not None:
            ahead = self.joints[f"{side}_toe"] - self.joints[f"{side}_ankle"]
            own = self.neutral.positions[joints_of.toe] - self.neutral.positions[joints_of.foot]
            self.turns[joints_of.foot] = quaternion.multiply(
                build_foot_frame(ahead, -hinge), quaternion.inverse(build_foot_frame(own[None], _LEFT[None])))
        elif joints_of.toe is not None:
            self._raise_ball(joints_of, self.joints[f"{side}_ankle"][:, 2])

    def _raise_ball(self, joints_of: Limb, ankle: np.ndarray) -> None:
        """Turn a foot up against its shank where its ball would be in the ground, by the height of its ankle (T,): so
        its heel rises before the push-off.
        """
        rest, foot = self.neutral.positions, self.turns[joints_of.lower_leg]
        own = rest[joints_of.toe] - rest[joints_of.foot]
        ball = unit_vectors(quaternion.rotate(foot, own[None]), _FORWARD)[:, 2]
        lowest = (rest[joints_of.toe, 2] - ankle) / np.linalg.norm(own)
        up = np.arcsin(np.clip(lowest, -1.0, 1.0)) - np.arcsin(np.clip(ball, -1.0, 1.0))
        turn = quaternion.from_axis_angle(_LEFT, -np.clip(up, 0.0, _MOST_BENT))
        self.turns[joints_of.foot] = quaternion.multiply(foot, turn)

    def bend_arm(self, side: str, joints_of: Limb) -> None:
        """Bend an arm so that its wrist is where it is seen; one whose wrist or elbow is not seen hangs."""
        if f"{side}_elbow" not in self.joints or f"{side}_wrist" not in self.joints or joints_of.upper_arm is None:
            return
        chest = self.turns[self.body.chest]
        top = self._raise_shoulder(side, joints_of, chest)
        chain = (joints_of.upper_arm, joints_of.lower_arm, joints_of.hand)
        hinge, upper, lower = self._bend((f"{side}_elbow", f"{side}_wrist"), chain, top,
                                         -quaternion.rotate(chest, _FORWARD))
        self.turns[joints_of.upper_arm] = limb.build_bone_frame(upper, -hinge)
        self.turns[joints_of.lower_arm] = limb.build_bone_frame(lower, -hinge)

    def _raise_shoulder(self, side: str, joints_of: Limb, chest: np.ndarray) -> np.ndarray:
        """Turn the collar bone towards the seen shoulder, as far as one can; return where the arm begins (T, 3)."""
        if joints_of.shoulder is None:
            return self.places[:, joints_of.upper_arm]
        rest, base = self.neutral.positions, self.places[:, joints_of.shoulder]
        own = quaternion.rotate(chest, (rest[joints_of.upper_arm] - rest[joints_of.shoulder])[None])
        turn = quaternion.to_rotation_vector(quaternion.rotation_between(
            unit_vectors(own, _LEFT), unit_vectors(self.joints[f"{side}_shoulder"] - base, _LEFT)))
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        turn = quaternion.from_rotation_vector(turn * np.minimum(1.0, _MOST_RAISED / np.maximum(angle, 1e-9)))
        self.turns[joints_of.shoulder] = quaternion.multiply(turn, chest)
        return base + quaternion.rotate(turn, own)

    def _bend(self, names: tuple[str, str], chain: tuple[int, int, int], top: np.ndarray,
              usual: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Solve a limb that begins at `top` (T, 3), so that its middle and end joint are where those names are seen; a
        straight one bends towards `usual` (T, 3). Return its hinge and unit directions of both bones, (T, 3) each.
        """
        rest, (middle, end) = self.neutral.positions, (self.joints[name] for name in names)
        upper, lower = (np.linalg.norm(rest[last] - rest[first]) for first, last in zip(chain, chain[1:]))
        seen = middle - top
        line = unit_vectors(end - top, -_UP)
        pole = seen - np.sum(seen * line, axis=1, keepdims=True) * line
        pole = pole + _USUAL_BEND * usual
        bent, reached, hinge = limb.solve_limb_bend(top, end, np.array(upper), lower=np.array(lower), pole=pole,
                                                    soft=_SOFT)
        return hinge, unit_vectors(bent - top, -_UP), unit_vectors(reached - bent, -_UP)

    def _measure_across(self, part: str) -> np.ndarray:
        return self.joints[f"left_{part}"] - self.joints[f"right_{part}"]

    def _measure_trunk(self) -> np.ndarray:
        """Measure the vector (T, 3) from the middle of the hips to that of the shoulders."""
        joints = self.joints
        return 0.5 * (joints["left_shoulder"] + joints["right_shoulder"] - joints["left_hip"] - joints["right_hip"])


def build_frame(up: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Build rotations (T, 4) whose Z is along `up` (T, 3) and whose Y is `across` (T, 3) as far as that is square."""
    z = unit_vectors(up, _UP)
    y = unit_vectors(across - np.sum(across * z, axis=1, keepdims=True) * z, _LEFT)
    return quaternion.from_axes(cross_product(y, z), y, z)


def build_foot_frame(ahead: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Build rotations (T, 4) whose X is along `ahead` (T, 3) and whose Y is `across` as far as that is square."""
    x = unit_vectors(ahead, _FORWARD)
    y = unit_vectors(across - np.sum(across * x, axis=1, keepdims=True) * x, _LEFT)
    return quaternion.from_axes(x, y, cross_product(x, y))
