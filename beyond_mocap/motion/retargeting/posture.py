"""A body's movement in anatomical terms, and its conversion to the motion of any humanoid skeleton.

A `Posture` contains the position and rotation of the pelvis, the bend of the trunk, the angles of the arms, and the
positions of the feet. Nothing in it depends on a skeleton's joints, rest pose or axes: `to_motion` does, via `neutral`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ...base.vectors import unit_vectors
from .. import limb, quaternion
from ..humanoid import Humanoid, Limb, identify_joints
from ..motion import Motion, compute_local_rotations, compute_pose
from .neutral import NeutralStance

# metres below full length from where a leg eases: less than what `gait` leaves, so that feet in contact are exact
_SOFT_DISTANCE = 0.003
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True, eq=False, kw_only=True)
class Posture:
    """T frames of a body, metres and radians, world Z up.

    Attributes:
        fps: frames per second.
        hips: (T, 3) the middle between the hip joints.
        heading: (T,) the body's facing about Z.
        pelvis: (T, 3) rotation vector of the pelvis relative to the heading about (X forward, Y left, Z up): list,
            forward tilt, rotation.
        spine: (T, 3) rotation vector of the chest relative to the pelvis, shared by the joints of the spine.
        head: (T, 3) of the head relative to the chest, shared with the neck.
        arms: (T, 2, 5), left and right: flexion (arm forward positive), abduction (sideways), inward rotation about the
            upper arm, elbow flexion, rotation of the forearm.
        wrists: (T, 2) hand flexion towards the palm.
        ankles: (T, 2, 3) positions of the ankles.
        feet: (T, 2, 3) rotation of each foot in the world: roll (sole outwards-in, about the foot's length), pitch
            (toes down positive), yaw.
        toes: (T, 2) the toes' bend against the foot, up positive.
        knees: (T, 2) extra outward rotation of the knees.
    """

    fps: float
    hips: np.ndarray
    heading: np.ndarray
    pelvis: np.ndarray
    spine: np.ndarray
    head: np.ndarray
    arms: np.ndarray
    wrists: np.ndarray
    ankles: np.ndarray
    feet: np.ndarray
    toes: np.ndarray
    knees: np.ndarray

    def __len__(self) -> int:
        return len(self.hips)

    def replace_arrays(self, **arrays: Any) -> "Posture":
        """Return the same posture with some arrays replaced."""
        return replace(self, **arrays)

    @classmethod
    def join(cls, parts: Sequence["Posture"]) -> "Posture":
        """Join the frames of several postures, one after the other, at the first one's rate."""
        arrays = {f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls) if f.name != "fps"}
        return cls(fps=parts[0].fps, **arrays)

    def frames(self, where: slice | np.ndarray) -> "Posture":
        """Return a slice of the frames, or those of given numbers (K,)."""
        return replace(self, **{f.name: getattr(self, f.name)[where] for f in fields(self) if f.name != "fps"})


def to_motion(posture: Posture, neutral: NeutralStance) -> Motion:
    """Convert a posture to a motion of a skeleton; the legs reach for the ankles by inverse kinematics.

    Args:
        posture: T frames.
        neutral: the skeleton's neutral stance.
    Returns:
        The motion of `neutral.skeleton`.
    """
    skeleton = neutral.skeleton
    body = identify_joints(skeleton)
    turns = _compute_world_rotations(posture, neutral, body)
    world = quaternion.multiply(turns, neutral.rotations)
    local = compute_local_rotations(skeleton, world)
    places, _ = compute_pose(skeleton, np.zeros((len(posture), 3)), local)
    middle = 0.5 * (places[:, body.left.upper_leg] + places[:, body.right.upper_leg])
    return Motion(skeleton, posture.hips - middle, local, posture.fps)


def compute_pelvis_rotation(posture: Posture) -> np.ndarray:
    """Compute the world rotation (T, 4) of the pelvis relative to the neutral stance."""
    return quaternion.multiply(quaternion.from_up_angle(posture.heading),
                               quaternion.from_rotation_vector(posture.pelvis))


def compute_hip_positions(posture: Posture, neutral: NeutralStance) -> np.ndarray:
    """Compute the world positions (T, 2, 3) of the hip joints, metres."""
    body = identify_joints(neutral.skeleton)
    turn = compute_pelvis_rotation(posture)
    apart = neutral.positions[body.left.upper_leg] - neutral.positions[body.right.upper_leg]
    half = 0.5 * quaternion.rotate(turn, apart)
    return np.stack([posture.hips + half, posture.hips - half], axis=1)


def compute_foot_rotation(feet: np.ndarray) -> np.ndarray:
    """Compute world rotations (..., 4) of feet from roll, pitch, yaw (..., 3), relative to a flat foot that points
    along +X.
    """
    return quaternion.multiply(
        quaternion.from_up_angle(feet[..., 2]),
        quaternion.multiply(quaternion.from_axis_angle(_Y, feet[..., 1]), quaternion.from_axis_angle(_X, feet[..., 0])),
    )


def _compute_world_rotations(posture: Posture, neutral: NeutralStance, body: Humanoid) -> np.ndarray:
    """Compute the world rotation of every joint relative to the neutral stance (T, J, 4); other joints follow their
    parents.
    """
    skeleton = neutral.skeleton
    rotations = _rotate_trunk(posture, body)
    chest = rotations[body.chest]
    for side, limb_joints in enumerate((body.left, body.right)):
        rotations.update(_rotate_arm(posture, limb_joints, side, chest))
        rotations.update(_solve_leg(posture, neutral, limb_joints, side))
    above = quaternion.from_up_angle(posture.heading)
    out = np.empty((len(posture), len(skeleton), 4))
    for joint, parent in enumerate(skeleton.parents):
        out[:, joint] = rotations.get(joint, out[:, parent] if parent >= 0 else above)
    return out


def _rotate_trunk(posture: Posture, body: Humanoid) -> dict[int, np.ndarray]:
    """Compute the rotations (T, 4) of pelvis, spine, neck and head, by joint."""
    pelvis = compute_pelvis_rotation(posture)
    rotations = {body.hips: pelvis}
    count = max(len(body.spine), 1)
    for step, joint in enumerate(body.spine, start=1):
        rotations[joint] = quaternion.multiply(pelvis, quaternion.from_rotation_vector(posture.spine * (step / count)))
    chest = rotations[body.chest]
    for joint, share in ((body.neck, 0.45), (body.head, 1.0)):
        if joint is not None:
            rotations[joint] = quaternion.multiply(chest, quaternion.from_rotation_vector(posture.head * share))
    return rotations


def _rotate_arm(posture: Posture, joints: Limb, side: int, chest: np.ndarray) -> dict[int, np.ndarray]:
    """Compute the rotations (T, 4) of one arm, by joint."""
    if joints.upper_arm is None:
        return {}
    sign = 1.0 if side == 0 else -1.0
    flex, abduct, inward, elbow, pronate = np.moveaxis(posture.arms[:, side], -1, 0)
    # a raised arm raises its collar bone: by about a third of what exceeds 30 degrees (scapulohumeral rhythm)
    raised = np.maximum(np.hypot(flex * (flex > 0), abduct) - np.radians(30.0), 0.0)
    collar = quaternion.multiply(chest, quaternion.from_axis_angle(_X, sign * 0.22 * raised))
    upper = quaternion.multiply(chest, quaternion.from_axis_angle(_X, sign * abduct))
    upper = quaternion.multiply(upper, quaternion.from_axis_angle(_Y, -flex))
    upper = quaternion.multiply(upper, quaternion.from_axis_angle(_Z, -sign * inward))
    lower = quaternion.multiply(upper, quaternion.from_axis_angle(_Y, -elbow))
    hand = quaternion.multiply(lower, quaternion.from_axis_angle(_Z, -sign * pronate))
    hand = quaternion.multiply(hand, quaternion.from_axis_angle(_X, -sign * posture.wrists[:, side]))
    rotations = {joints.upper_arm: upper}
    for joint, turn in ((joints.shoulder, collar), (joints.lower_arm, lower), (joints.hand, hand)):
        if joint is not None:
            rotations[joint] = turn
    return rotations


def _solve_leg(posture: Posture, neutral: NeutralStance, joints: Limb, side: int) -> dict[int, np.ndarray]:
    """Solve the rotations (T, 4) of one leg, by joint."""
    places = neutral.positions
    upper = float(np.linalg.norm(places[joints.lower_leg] - places[joints.upper_leg]))
    lower = float(np.linalg.norm(places[joints.foot] - places[joints.lower_leg]))
    top = compute_hip_positions(posture, neutral)[:, side]
    ankle = posture.ankles[:, side]
    pole = compute_knee_pole(posture, top, side)
    knee, end, hinge = limb.solve_limb_bend(top, ankle, np.array(upper), lower=np.array(lower), pole=pole,
                                            soft=_SOFT_DISTANCE)
    thigh = limb.build_bone_frame(unit_vectors(knee - top, -_Z), hinge)
    shank = limb.build_bone_frame(unit_vectors(end - knee, -_Z), hinge)
    foot = compute_foot_rotation(posture.feet[:, side])
    rotations = {joints.upper_leg: thigh, joints.lower_leg: shank, joints.foot: foot}
    if joints.toe is not None:
        rotations[joints.toe] = quaternion.multiply(foot, quaternion.from_axis_angle(_Y, -posture.toes[:, side]))
    return rotations


def compute_knee_pole(posture: Posture, top: np.ndarray, side: int) -> np.ndarray:
    """Compute the direction (T, 3) in which the knee points: between pelvis and foot, carried along as the leg swings.
    """
    pelvis = compute_pelvis_rotation(posture)
    sign = 1.0 if side == 0 else -1.0
    yaw = quaternion.wrap_angle(posture.feet[:, side, 2] - quaternion.to_yaw(pelvis))
    turned = np.clip(0.5 * yaw, -0.7, 0.7) + sign * posture.knees[:, side]
    down = quaternion.rotate(pelvis, -_Z)
    ahead = quaternion.rotate(pelvis, np.stack([np.cos(turned), np.sin(turned), np.zeros_like(turned)], axis=-1))
    return quaternion.rotate(quaternion.rotation_between(down, posture.ankles[:, side] - top), ahead)
