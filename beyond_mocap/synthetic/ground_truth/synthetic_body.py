"""A recorded body in the axes of a marker model: the ground truth for synthetic markers.

Rigs have all kinds of rest poses and joint axes. Here the motion of any humanoid is converted to a skeleton whose
joints, at rest, have the world's axes (X forward, Y left, Z up) in a T-pose: thumbs forward, palms down, knees and
elbows turning about the body's own axes (`motion.retargeting.anatomy` finds them in the recording). The rotation of a
hand about its forearm becomes the forearm's, as radius and ulna do it. Joints keep their places; joints without a known
role are left out.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.humanoid import identify_posed_joints
from ...motion.motion import Motion, compute_local_rotations, compute_pose, forward_kinematics
from ...motion.retargeting.anatomy import Anatomy, estimate_anatomy, list_head_chain
from ...motion.skeleton import Skeleton

_X, _Y, _Z = np.eye(3)
_PARTS = {
    "shoulder": "Shoulder", "upper_arm": "Arm", "lower_arm": "ForeArm", "hand": "Hand",
    "upper_leg": "UpLeg", "lower_leg": "Leg", "foot": "Foot", "toe": "ToeBase",
}
_ARM = ("upper_arm", "lower_arm", "hand")
# m: tips of an adult whose leg (hip to ankle) is `_LEG` metres long, left side
_LEG = 0.873
_TIPS = {"Head": (0.01, 0.0, 0.19), "Hand": (0.0, 0.18, 0.0), "ToeBase": (0.07, 0.0, -0.005)}


def to_marker_axes(motion: Motion) -> Motion:
    """Convert a motion to a skeleton in the axes of marker models.

    Args:
        motion: of any humanoid; root positions in m, world, Z up.
    Returns:
        The motion, joints named as in marker models, without fingers and a rig's helper joints.
    Raises:
        InputError: if the body has no legs.
    """
    body = identify_posed_joints(motion)
    anatomy = estimate_anatomy(motion.skeleton, body, motion)
    places, world = forward_kinematics(motion)
    named = _find_joints(motion.skeleton, anatomy)
    turns = {name: _convert_segment(name, world[:, joint], anatomy.axes[joint]) for name, joint in named.items()}
    for side in ("Left", "Right"):
        _move_twist(turns, side)
    return _build_motion(named, motion, places, turns, anatomy.leg)


def _find_joints(skeleton: Skeleton, anatomy: Anatomy) -> dict[str, int]:
    """Find the joints of marker models: name -> joint, parents first."""
    body = anatomy.body
    found: dict[str, int] = {"Hips": body.hips}
    spine = list(body.spine)
    names = ["Spine", *(f"Spine{i}" for i in range(1, len(spine)))][: max(len(spine) - 1, 0)] + ["Chest"]
    found |= dict(zip(names if spine else [], spine))
    chain = list_head_chain(skeleton, body)
    above = ["Neck", *(f"Neck{i}" for i in range(1, len(chain)))][: max(len(chain) - 1, 0)] + ["Head"]
    found |= dict(zip(above if chain else [], chain))
    for side, limb in (("Left", body.left), ("Right", body.right)):
        found |= {side + name: getattr(limb, part) for part, name in _PARTS.items()}
    return {name: joint for name, joint in found.items() if joint in anatomy.known_joints}


def _convert_segment(name: str, world: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Compute the world rotation (T, 4) of a segment in T-pose axes; the anatomy's axes are those of hanging arms."""
    turn = quaternion.multiply(world, axes)
    if name.endswith(("Arm", "Hand")):
        sign = 1.0 if name.startswith("Left") else -1.0
        turn = quaternion.multiply(turn, quaternion.from_axis_angle(_X, -sign * np.pi / 2))
    return turn


def _move_twist(turns: dict[str, np.ndarray], side: str) -> None:
    """Move the hand's rotation about its length to the forearm, so that the wrist bends but does not twist."""
    if side + "Hand" not in turns:
        return
    forearm, hand = turns[side + "ForeArm"], turns[side + "Hand"]
    bend = quaternion.multiply(quaternion.inverse(forearm), hand)
    angle = 2.0 * arctan2(bend[:, 2], bend[:, 0])
    turns[side + "ForeArm"] = quaternion.multiply(forearm, quaternion.from_axis_angle(_Y, angle))


def _build_motion(named: dict[str, int], motion: Motion, places: np.ndarray, rotations: dict, leg: float) -> Motion:
    """Build the motion on its new skeleton.

    Args:
        named: name -> old joint.
        places: (T, J, 3) m of the old joints, world.
        rotations: name -> (T, 4) world rotations.
        leg: length of a leg, m.
    """
    names = list(named)
    parents = [_find_parent(name, names) for name in names]
    world = np.stack([rotations[name] for name in names], axis=1)
    offsets = np.zeros((len(names), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            bone = places[:, named[names[joint]]] - places[:, named[names[parent]]]
            offsets[joint] = quaternion.rotate(quaternion.inverse(world[:, parent]), bone).mean(axis=0)
    ends = [name for name in names if name.removeprefix("Left").removeprefix("Right") in _TIPS]
    tips = np.array([_find_tip(name, motion, named[name], rotations[name], leg) for name in ends]).reshape(-1, 3)
    skeleton = Skeleton(tuple(names), tuple(parents), offsets, tuple(names.index(name) for name in ends), tips)
    local = quaternion.normalize(compute_local_rotations(skeleton, world))
    return Motion(skeleton, places[:, named["Hips"]], local, motion.fps)


def _find_tip(name: str, motion: Motion, joint: int, turn: np.ndarray, leg: float) -> np.ndarray:
    """Find the end of a head, hand or toe (3,): the rig's own, or an average one."""
    skeleton = motion.skeleton
    if joint in skeleton.end_parents and not skeleton.children(joint):
        offset = skeleton.end_offsets[skeleton.end_parents.index(joint)]
        if np.linalg.norm(offset) > 0.02:
            _, world = forward_kinematics(motion.frames(0, 1))
            between = quaternion.multiply(quaternion.inverse(turn[0]), world[0, joint])
            return quaternion.rotate(between, offset)
    side = -1.0 if name.startswith("Right") else 1.0
    return np.array(_TIPS[name.removeprefix("Left").removeprefix("Right")]) * [1.0, side, 1.0] * leg / _LEG


def _find_parent(name: str, names: list[str]) -> int:
    """Find the nearest joint above `name` that the body has; -1 for none."""
    for above in _list_above(name):
        if above in names:
            return names.index(above)
    return -1


def _list_above(name: str) -> list[str]:
    """List the joints that can carry `name`, nearest first."""
    trunk = ["Chest", "Spine4", "Spine3", "Spine2", "Spine1", "Spine", "Hips"]
    neck = ["Head", "Neck3", "Neck2", "Neck1", "Neck", *trunk]
    for chain in (neck, trunk):
        if name in chain:
            return chain[chain.index(name) + 1 :]
    side = "Left" if name.startswith("Left") else "Right"
    arm = [side + part for part in ("Hand", "ForeArm", "Arm", "Shoulder")]
    leg = [side + part for part in ("ToeBase", "Foot", "Leg", "UpLeg")]
    return arm[arm.index(name) + 1 :] + trunk if name in arm else leg[leg.index(name) + 1 :] + ["Hips"]


def compute_size(skeleton: Skeleton) -> float:
    """Compute the body's size over that of an adult of 1.80 m, by its legs."""
    bones = [skeleton.offsets[skeleton.index(side + part)] for side in ("Left", "Right") for part in ("Leg", "Foot")]
    return float(np.linalg.norm(bones, axis=1).sum() / 2.0 / _LEG)


def build_calibration_pose(skeleton: Skeleton, seconds: float, fps: float, seed: int) -> Motion:
    """Build a static trial: standing still with arms lifted by 45 degrees, elbows slightly bent, swaying a little.

    Args:
        skeleton: as `to_marker_axes` gives it.
        seconds: s.
        fps: frames per second.
        seed: of the sway.
    Returns:
        The motion; the feet are at z = 0, the body faces +X.
    """
    rng = np.random.default_rng(seed)
    count = max(int(round(seconds * fps)), 2)
    times = np.arange(count) / fps
    local = np.broadcast_to(quaternion.identity(len(skeleton)), (count, len(skeleton), 4)).copy()
    for joint, name in enumerate(skeleton.names):
        sway = _build_sway(times, rng, np.radians(0.6), 3)
        local[:, joint] = quaternion.multiply(_find_rotation(name), quaternion.from_rotation_vector(sway))
    root = _build_sway(times, rng, 0.004, 3)
    places, _ = compute_pose(skeleton, root, local)
    feet = [joint for joint, name in enumerate(skeleton.names) if name.endswith(("ToeBase", "Foot"))]
    low = places[:, feet, 2].min() - 0.022 * _LEG
    return Motion(skeleton, root - [0.0, 0.0, low], local, fps)


def _find_rotation(name: str) -> np.ndarray:
    """Rotation (4,) of a joint in the calibration pose."""
    sign = 1.0 if name.startswith("Left") else -1.0
    if name.endswith("ForeArm"):
        return quaternion.from_axis_angle(_Z, -sign * np.radians(20.0))
    if name.endswith("Arm"):
        return quaternion.from_axis_angle(_X, -sign * np.radians(45.0))
    return quaternion.identity()


def _build_sway(times: np.ndarray, rng: np.random.Generator, size: float, columns: int) -> np.ndarray:
    """Build a slow, smooth random movement (T, columns) of about `size`."""
    rates, phases = rng.uniform(0.2, 0.9, (2, columns)), rng.uniform(0.0, 2.0 * np.pi, (2, columns))
    waves = np.sin(2.0 * np.pi * times[:, None, None] * rates + phases)
    return size * (waves - waves[:1]).sum(axis=1) * 0.6
