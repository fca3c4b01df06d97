"""A body's movement in anatomical terms, and how any humanoid skeleton takes it on.

A `Posture` says where the pelvis is and how it is turned, how the trunk bends, what the arms do, and where the feet
are. Nothing in it speaks of a particular skeleton's joints, rest pose or axes: `to_motion` does, through `neutral`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ...base.vectors import unit_vectors
from .. import limb, quaternion
from ..humanoid import Humanoid, Limb, identify
from ..motion import Motion, local_rotations, pose_kinematics
from .neutral import Neutral

# metres below full stretch from where a leg eases: less than what `gait` leaves, so that standing feet are met exactly
_SOFT = 0.003
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True, eq=False, kw_only=True)
class Posture:
    """T frames of a body, metres and radians, world Z up.

    hips (T, 3): the middle between the hip joints. heading (T,): the body's facing about Z. pelvis (T, 3): turn of the
    pelvis relative to the heading as a rotation vector about (X forward, Y left, Z up): list, forward tilt, turn. spine
    (T, 3): rotation vector of the chest relative to the pelvis, shared by the joints of the spine. head (T, 3): of the
    head relative to the chest, shared with the neck. arms (T, 2, 5), left and right: flexion (arm forward positive),
    abduction (sideways), inward turn about the upper arm, elbow flexion, turn of the forearm. wrists (T, 2): hand
    flexion towards the palm. ankles (T, 2, 3): where the ankles are. feet (T, 2, 3): rotation of each foot in the
    world: roll (sole outwards-in, about the foot's length), pitch (toes down positive), yaw. toes (T, 2): the toes'
    bend against the foot, up positive. knees (T, 2): extra turn of the knees outwards."""

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

    def changed(self, **arrays: Any) -> "Posture":
        """The same posture with some arrays replaced."""
        return replace(self, **arrays)

    @classmethod
    def joined(cls, parts: Sequence["Posture"]) -> "Posture":
        """The frames of several, one after the other, at the first one's rate."""
        arrays = {f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls) if f.name != "fps"}
        return cls(fps=parts[0].fps, **arrays)

    def frames(self, where: slice) -> "Posture":
        """A stretch of the frames."""
        return replace(self, **{f.name: getattr(self, f.name)[where] for f in fields(self) if f.name != "fps"})


def to_motion(posture: Posture, neutral: Neutral) -> Motion:
    """The motion of `neutral.skeleton` that takes on `posture`, legs reaching for the ankles by inverse kinematics."""
    skeleton = neutral.skeleton
    body = identify(skeleton)
    turns = _turns(posture, neutral, body)
    world = quaternion.multiply(turns, neutral.rotations)
    local = local_rotations(skeleton, world)
    places, _ = pose_kinematics(skeleton, np.zeros((len(posture), 3)), local)
    middle = 0.5 * (places[:, body.left.upper_leg] + places[:, body.right.upper_leg])
    return Motion(skeleton, posture.hips - middle, local, posture.fps)


def pelvis_rotation(posture: Posture) -> np.ndarray:
    """World turn (T, 4) of the pelvis relative to the neutral stance."""
    return quaternion.multiply(quaternion.about_up(posture.heading), quaternion.from_rotation_vector(posture.pelvis))


def hip_joints(posture: Posture, neutral: Neutral) -> np.ndarray:
    """World positions (T, 2, 3) of the hip joints, metres."""
    body = identify(neutral.skeleton)
    turn = pelvis_rotation(posture)
    apart = neutral.positions[body.left.upper_leg] - neutral.positions[body.right.upper_leg]
    half = 0.5 * quaternion.rotate(turn, apart)
    return np.stack([posture.hips + half, posture.hips - half], axis=1)


def foot_rotation(feet: np.ndarray) -> np.ndarray:
    """World turns (..., 4) of feet given as roll, pitch, yaw (..., 3), relative to a flat foot that points along +X."""
    return quaternion.multiply(
        quaternion.about_up(feet[..., 2]),
        quaternion.multiply(quaternion.about_axis(_Y, feet[..., 1]), quaternion.about_axis(_X, feet[..., 0])),
    )


def _turns(posture: Posture, neutral: Neutral, body: Humanoid) -> np.ndarray:
    """World turn of every joint relative to the neutral stance (T, J, 4); other joints follow their parents."""
    skeleton = neutral.skeleton
    said = _trunk(posture, body)
    chest = said[body.chest]
    for side, limb_joints in enumerate((body.left, body.right)):
        said.update(_arm(posture, limb_joints, side, chest))
        said.update(_leg(posture, neutral, limb_joints, side))
    above = quaternion.about_up(posture.heading)
    out = np.empty((len(posture), len(skeleton), 4))
    for joint, parent in enumerate(skeleton.parents):
        out[:, joint] = said.get(joint, out[:, parent] if parent >= 0 else above)
    return out


def _trunk(posture: Posture, body: Humanoid) -> dict[int, np.ndarray]:
    pelvis = pelvis_rotation(posture)
    said = {body.hips: pelvis}
    count = max(len(body.spine), 1)
    for step, joint in enumerate(body.spine, start=1):
        said[joint] = quaternion.multiply(pelvis, quaternion.from_rotation_vector(posture.spine * (step / count)))
    chest = said[body.chest]
    for joint, share in ((body.neck, 0.45), (body.head, 1.0)):
        if joint is not None:
            said[joint] = quaternion.multiply(chest, quaternion.from_rotation_vector(posture.head * share))
    return said


def _arm(posture: Posture, joints: Limb, side: int, chest: np.ndarray) -> dict[int, np.ndarray]:
    if joints.upper_arm is None:
        return {}
    sign = 1.0 if side == 0 else -1.0
    flex, abduct, inward, elbow, pronate = np.moveaxis(posture.arms[:, side], -1, 0)
    # a raised arm takes its collar bone along: about a third of the way beyond 30 degrees (scapulohumeral rhythm)
    raised = np.maximum(np.hypot(flex * (flex > 0), abduct) - np.radians(30.0), 0.0)
    collar = quaternion.multiply(chest, quaternion.about_axis(_X, sign * 0.22 * raised))
    upper = quaternion.multiply(chest, quaternion.about_axis(_X, sign * abduct))
    upper = quaternion.multiply(upper, quaternion.about_axis(_Y, -flex))
    upper = quaternion.multiply(upper, quaternion.about_axis(_Z, -sign * inward))
    lower = quaternion.multiply(upper, quaternion.about_axis(_Y, -elbow))
    hand = quaternion.multiply(lower, quaternion.about_axis(_Z, -sign * pronate))
    hand = quaternion.multiply(hand, quaternion.about_axis(_X, -sign * posture.wrists[:, side]))
    said = {joints.upper_arm: upper}
    for joint, turn in ((joints.shoulder, collar), (joints.lower_arm, lower), (joints.hand, hand)):
        if joint is not None:
            said[joint] = turn
    return said


def _leg(posture: Posture, neutral: Neutral, joints: Limb, side: int) -> dict[int, np.ndarray]:
    places = neutral.positions
    upper = float(np.linalg.norm(places[joints.lower_leg] - places[joints.upper_leg]))
    lower = float(np.linalg.norm(places[joints.foot] - places[joints.lower_leg]))
    top = hip_joints(posture, neutral)[:, side]
    ankle = posture.ankles[:, side]
    pole = knee_pole(posture, top, side)
    knee, end, hinge = limb.bend(top, ankle, np.array(upper), lower=np.array(lower), pole=pole, soft=_SOFT)
    thigh = limb.bone_frame(unit_vectors(knee - top, -_Z), hinge)
    shank = limb.bone_frame(unit_vectors(end - knee, -_Z), hinge)
    foot = foot_rotation(posture.feet[:, side])
    said = {joints.upper_leg: thigh, joints.lower_leg: shank, joints.foot: foot}
    if joints.toe is not None:
        said[joints.toe] = quaternion.multiply(foot, quaternion.about_axis(_Y, -posture.toes[:, side]))
    return said


def knee_pole(posture: Posture, top: np.ndarray, side: int) -> np.ndarray:
    """Where the knee points (T, 3): between pelvis and foot, carried along as the leg swings."""
    pelvis = pelvis_rotation(posture)
    sign = 1.0 if side == 0 else -1.0
    yaw = quaternion.wrapped(posture.feet[:, side, 2] - quaternion.yaw(pelvis))
    turned = np.clip(0.5 * yaw, -0.7, 0.7) + sign * posture.knees[:, side]
    down = quaternion.rotate(pelvis, -_Z)
    ahead = quaternion.rotate(pelvis, np.stack([np.cos(turned), np.sin(turned), np.zeros_like(turned)], axis=-1))
    return quaternion.rotate(quaternion.between(down, posture.ankles[:, side] - top), ahead)
