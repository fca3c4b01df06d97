"""The joint tree of SMPL with the bones of a person: from published means, or from a body model that the user has.

The joints and their order are those of M. Loper et al. 2015, "SMPL: a skinned multi-person linear model", section 3.
The lengths of bones are not stored with a motion, and the body model that has them may not be passed on. Without it
they are shares of the stature, as in `motion.retargeting.adult` (Drillis and Contini 1966), with the arms of a
T-pose.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from ...motion.retargeting.adult import build_adult_skeleton
from ...motion.skeleton import Skeleton
from ..plain_npz import read_named_arrays

JOINTS = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
"""The 22 joints that SMPL, SMPL-H and SMPL-X share, in their order."""
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
PELVIS_AT_REST = np.array([0.0, -0.22, 0.03])
"""Metres from the model's origin, whose place `trans` is, to the pelvis, in the file's axes: no rotation moves it.
Known to a centimetre without the model."""
LEG_RANGE = (0.4, 1.3)
"""Metres, thigh and shank of a body model."""
MAX_MODEL_BYTES = 1 << 30
STATURE_RANGE = (1.0, 2.4)
"""Metres; children of school age to the tallest adults."""
_ADULT_JOINTS = {
    "pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck": "Neck", "head": "Head",
    "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "foot": "ToeBase", "collar": "Shoulder", "shoulder": "Arm",
    "elbow": "ForeArm", "wrist": "Hand",
}  # fmt: skip
_SHANK_LEAN = np.radians(6.0)
"""How far the shank leans back in the rest pose. The straightest knees of SMPL motions are rotated by -5 to -6 degrees
(1st percentile of 18 estimated from video); no knee bends that far backwards, so the rest pose is bent by that."""
_PELVIS_HEIGHT = 0.033
"""Share of the stature by which SMPL's pelvis lies higher above the hips than the adult's: some 9 cm in all."""
TOE_HEIGHT = 0.009
"""Share of the stature from the sole up to the toe joint of the adult (the ankle's .039 less .030)."""
_STANCE_SHARE = 0.35  # of all foot joints and frames: the slowest, which stand, where both feet do for half of a walk
_ROUNDS = 20
# core axes (forward, left, up) of SMPL's (left, up, forward)
TO_CORE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def build_smpl_skeleton(stature: float) -> Skeleton:
    """Build the skeleton of a person of mean proportions.

    Args:
        stature: metres.
    Returns:
        22 joints in the T-pose, facing +X, with tips of head, hands and toes.
    """
    adult = build_adult_skeleton(stature)
    offsets = np.array([adult.offsets[adult.index(_name_adult_joint(joint))] for joint in JOINTS])
    for joint in ("left_hip", "right_hip", "spine1"):
        offsets[JOINTS.index(joint), 2] -= _PELVIS_HEIGHT * stature
    tips = adult.end_offsets.copy()
    for number, joint in enumerate(JOINTS):
        if joint.endswith(("elbow", "wrist")):
            offsets[number] = _point_sideways(joint, offsets[number])
        elif joint.endswith("ankle"):
            offsets[number] = np.linalg.norm(offsets[number]) * np.array([-np.sin(_SHANK_LEAN), 0.0,
                                                                           -np.cos(_SHANK_LEAN)])
    parts = [_name_smpl_joint(adult.names[joint]) for joint in adult.end_parents]
    tips = [_point_sideways(part, tip) if part.endswith("wrist") else tip for part, tip in zip(parts, tips)]
    return Skeleton(JOINTS, PARENTS, offsets, tuple(map(JOINTS.index, parts)), np.array(tips))


def build_smpl_pose(stature: float) -> Motion:
    """Build a frame in the T-pose on the ground, of a person of mean proportions `stature` metres tall."""
    skeleton = build_smpl_skeleton(stature)
    motion = Motion(skeleton, np.zeros((1, 3)), quaternion.identity(1, len(JOINTS)), 30.0)
    lowest = forward_kinematics(motion)[0][0, :, 2].min()
    return Motion(skeleton, np.array([[0.0, 0.0, -lowest]]), motion.rotations, 30.0)


def _name_adult_joint(joint: str) -> str:
    """Return the adult's name for a joint of SMPL."""
    side, _, part = joint.rpartition("_")
    return side.capitalize() + _ADULT_JOINTS[part]


def _name_smpl_joint(name: str) -> str:
    """Return SMPL's name for a joint of the adult."""
    return next(joint for joint in JOINTS if _name_adult_joint(joint) == name)


def _point_sideways(joint: str, offset: np.ndarray) -> np.ndarray:
    """Return a bone of the arm as it is in the T-pose."""
    return np.array([0.0, np.linalg.norm(offset) * (1.0 if joint.startswith("left") else -1.0), 0.0])


def estimate_smpl_stature(motion: Motion) -> float:
    """Estimate how tall a person is whose steps fit the recorded travel.

    A planted foot does not move: with the pelvis' velocity v and the velocity f of a foot relative to the pelvis for a
    body of 1 m, the stature s minimizes |v + s f| over the frames in which a foot stands, which are those where that
    is smallest.

    Args:
        motion: on a skeleton of 1 m.
    Returns:
        Metres; 0 where nothing moves enough to tell.
    """
    places, _ = forward_kinematics(motion)
    feet = [JOINTS.index(f"{side}_{part}") for side in ("left", "right") for part in ("ankle", "foot")]
    travel = np.tile(np.diff(motion.root_positions, axis=0), (len(feet), 1))
    swing = np.concatenate([np.diff(places[:, foot] - motion.root_positions, axis=0) for foot in feet])
    if not len(travel):
        return 0.0
    stature = 1.7
    for _ in range(_ROUNDS):
        speed = np.linalg.norm(travel + stature * swing, axis=1)
        standing = speed <= np.quantile(speed, _STANCE_SHARE)
        power = np.sum(swing[standing] ** 2)
        if power < len(motion) * (0.01 / motion.fps) ** 2:  # feet hardly move relative to the pelvis
            return 0.0
        stature = float(-np.sum(travel[standing] * swing[standing]) / power)
    return stature if STATURE_RANGE[0] <= stature <= STATURE_RANGE[1] else 0.0


def read_model_skeleton(path: Path, betas: np.ndarray) -> tuple[Skeleton, np.ndarray]:
    """Read the bones of a person out of a body model of SMPL's family.

    Joints are the model's regressor applied to its mean shape and the person's differences from it (Loper et al. 2015,
    eq. 8 and 10).

    Args:
        path: the model's .npz.
        betas: (B,) shape of the person, those of the model's first B.
    Returns:
        22 joints with tips as in `build_smpl_skeleton`, and the place (3,) of the pelvis at rest, core axes, metres.
    Raises:
        InputError: if it is not such a model, or stores its arrays as objects.
    """
    names = ("v_template", "shapedirs", "J_regressor")
    kinds = tuple(np.dtype(kind) for kind in ("<f4", "<f8"))
    arrays = read_named_arrays(path, "a body model of SMPL as .npz", kinds, MAX_MODEL_BYTES, names)
    if missing := [name for name in names if name not in arrays]:
        raise InputError(path, f"no array {missing[0]}", "a body model of SMPL as .npz", "choose the model's file")
    mean, shapes, regressor = (arrays[name] for name in names)
    if (mean.ndim, shapes.ndim, regressor.ndim) != (2, 3, 2) or regressor.shape[1] != len(mean) or len(
            regressor) < len(JOINTS) or shapes.shape[:2] != mean.shape or mean.shape[1] != 3:
        raise InputError(path, f"arrays of shapes {mean.shape}, {shapes.shape}, {regressor.shape}",
                         "vertices (V, 3), shapes (V, 3, B), regressor (J, V)", "choose the model's file")
    count = min(len(betas), shapes.shape[2])
    places = regressor @ (mean + shapes[:, :, :count] @ betas[:count])
    places = places[: len(JOINTS)] @ TO_CORE.T
    leg = sum(float(np.linalg.norm(places[JOINTS.index(f"left_{one}")] - places[JOINTS.index(f"left_{other}")]))
              for one, other in (("hip", "knee"), ("knee", "ankle")))
    if not LEG_RANGE[0] <= leg <= LEG_RANGE[1]:
        raise InputError(path, f"legs of {leg:.3g} m", f"{LEG_RANGE[0]:g} to {LEG_RANGE[1]:g} m",
                         "choose a body model in metres")
    offsets = places - places[np.maximum(PARENTS, 0)]
    stature = float(np.ptp(mean[:, 1]))
    plain = build_smpl_skeleton(stature)
    return Skeleton(JOINTS, PARENTS, offsets, plain.end_parents, plain.end_offsets), places[0]
