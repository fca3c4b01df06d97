"""A recorded body in the axes of a marker model: the truth that planted markers are put on.

Rigs rest in all kinds of poses and turn about all kinds of axes. Here any humanoid's motion is written on a skeleton
whose joints, at rest, have the world's axes (X forward, Y left, Z up) in a T-pose: thumbs forward, palms down, knees
and elbows turning about the body's own axes (`motion.retargeting.anatomy` finds them in the recording). The turn of a
hand about its forearm is the forearm's, as radius and ulna do it. Joints keep their places but for those of no meaning.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import arctan2
from ...motion import quaternion
from ...motion.humanoid import identify_posed
from ...motion.motion import Motion, forward_kinematics, local_rotations, pose_kinematics
from ...motion.retargeting.anatomy import Anatomy, head_chain, study
from ...motion.skeleton import Skeleton

_X, _Y, _Z = np.eye(3)
_PARTS = {
    "shoulder": "Shoulder", "upper_arm": "Arm", "lower_arm": "ForeArm", "hand": "Hand",
    "upper_leg": "UpLeg", "lower_leg": "Leg", "foot": "Foot", "toe": "ToeBase",
}
_ARM = ("upper_arm", "lower_arm", "hand")
# tips of an adult whose leg (hip to ankle) is `_LEG` metres long: left side
_LEG = 0.873
_TIPS = {"Head": (0.01, 0.0, 0.19), "Hand": (0.0, 0.18, 0.0), "ToeBase": (0.07, 0.0, -0.005)}


def in_marker_axes(motion: Motion) -> Motion:
    """`motion` on a skeleton in the axes of marker models, joints named as there; InputError where no legs are found.

    Root positions metres, world, Z up; joints that mean nothing (fingers, a rig's helpers) are left out."""
    body = identify_posed(motion)
    anatomy = study(motion.skeleton, body, motion)
    places, world = forward_kinematics(motion)
    named = _named(motion.skeleton, anatomy)
    turns = {name: _segment(name, world[:, joint], anatomy.axes[joint]) for name, joint in named.items()}
    for side in ("Left", "Right"):
        _forearm_turns_hand(turns, side)
    return _written(named, motion, places, turns, anatomy.leg)


def _named(skeleton: Skeleton, anatomy: Anatomy) -> dict[str, int]:
    """Names of the marker models -> joints, parents first."""
    body = anatomy.body
    found: dict[str, int] = {"Hips": body.hips}
    spine = list(body.spine)
    names = ["Spine", *(f"Spine{i}" for i in range(1, len(spine)))][: max(len(spine) - 1, 0)] + ["Chest"]
    found |= dict(zip(names if spine else [], spine))
    chain = head_chain(skeleton, body)
    above = ["Neck", *(f"Neck{i}" for i in range(1, len(chain)))][: max(len(chain) - 1, 0)] + ["Head"]
    found |= dict(zip(above if chain else [], chain))
    for side, limb in (("Left", body.left), ("Right", body.right)):
        found |= {side + name: getattr(limb, part) for part, name in _PARTS.items()}
    return {name: joint for name, joint in found.items() if joint in anatomy.known}


def _segment(name: str, world: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """World turn (T, 4) of a segment in T-pose axes; anatomy's axes are those of hanging arms."""
    turn = quaternion.multiply(world, axes)
    if name.endswith(("Arm", "Hand")):
        sign = 1.0 if name.startswith("Left") else -1.0
        turn = quaternion.multiply(turn, quaternion.about_axis(_X, -sign * np.pi / 2))
    return turn


def _forearm_turns_hand(turns: dict[str, np.ndarray], side: str) -> None:
    """Gives the forearm the hand's turn about its length, so that the wrist bends but does not twist."""
    if side + "Hand" not in turns:
        return
    forearm, hand = turns[side + "ForeArm"], turns[side + "Hand"]
    bend = quaternion.multiply(quaternion.inverse(forearm), hand)
    angle = 2.0 * arctan2(bend[:, 2], bend[:, 0])
    turns[side + "ForeArm"] = quaternion.multiply(forearm, quaternion.about_axis(_Y, angle))


def _written(named: dict[str, int], motion: Motion, places: np.ndarray, turns: dict, leg: float) -> Motion:
    """The motion on its new skeleton: places (T, J, 3) of the old joints, turns: name -> (T, 4) in the world."""
    names = list(named)
    parents = [_parent(name, names) for name in names]
    world = np.stack([turns[name] for name in names], axis=1)
    offsets = np.zeros((len(names), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            bone = places[:, named[names[joint]]] - places[:, named[names[parent]]]
            offsets[joint] = quaternion.rotate(quaternion.inverse(world[:, parent]), bone).mean(axis=0)
    ends = [name for name in names if name.removeprefix("Left").removeprefix("Right") in _TIPS]
    tips = np.array([_tip(name, motion, named[name], turns[name], leg) for name in ends]).reshape(-1, 3)
    skeleton = Skeleton(tuple(names), tuple(parents), offsets, tuple(names.index(name) for name in ends), tips)
    local = quaternion.normalized(local_rotations(skeleton, world))
    return Motion(skeleton, places[:, named["Hips"]], local, motion.fps)


def _tip(name: str, motion: Motion, joint: int, turn: np.ndarray, leg: float) -> np.ndarray:
    """The end of a head, hand or toe (3,): the rig's own or, where it has none, a usual one."""
    skeleton = motion.skeleton
    if joint in skeleton.end_parents and not skeleton.children(joint):
        offset = skeleton.end_offsets[skeleton.end_parents.index(joint)]
        if np.linalg.norm(offset) > 0.02:
            _, world = forward_kinematics(motion.frames(0, 1))
            between = quaternion.multiply(quaternion.inverse(turn[0]), world[0, joint])
            return quaternion.rotate(between, offset)
    side = -1.0 if name.startswith("Right") else 1.0
    return np.array(_TIPS[name.removeprefix("Left").removeprefix("Right")]) * [1.0, side, 1.0] * leg / _LEG


def _parent(name: str, names: list[str]) -> int:
    """The nearest joint above `name` that the body has."""
    for above in _above(name):
        if above in names:
            return names.index(above)
    return -1


def _above(name: str) -> list[str]:
    """Joints that may carry `name`, nearest first."""
    trunk = ["Chest", "Spine4", "Spine3", "Spine2", "Spine1", "Spine", "Hips"]
    neck = ["Head", "Neck3", "Neck2", "Neck1", "Neck", *trunk]
    for chain in (neck, trunk):
        if name in chain:
            return chain[chain.index(name) + 1 :]
    side = "Left" if name.startswith("Left") else "Right"
    arm = [side + part for part in ("Hand", "ForeArm", "Arm", "Shoulder")]
    leg = [side + part for part in ("ToeBase", "Foot", "Leg", "UpLeg")]
    return arm[arm.index(name) + 1 :] + trunk if name in arm else leg[leg.index(name) + 1 :] + ["Hips"]


def adult_share(skeleton: Skeleton) -> float:
    """How large the body is against an adult of 1.80 m: by its legs."""
    bones = [skeleton.offsets[skeleton.index(side + part)] for side in ("Left", "Right") for part in ("Leg", "Foot")]
    return float(np.linalg.norm(bones, axis=1).sum() / 2.0 / _LEG)


def calibration_pose(skeleton: Skeleton, seconds: float, fps: float, seed: int) -> Motion:
    """Somebody who stands still for a static trial: arms lifted 45 degrees, elbows bent a little, swaying a little.

    skeleton: one of `in_marker_axes`. The feet stand at z = 0, the body faces +X."""
    rng = np.random.default_rng(seed)
    count = max(int(round(seconds * fps)), 2)
    times = np.arange(count) / fps
    local = np.broadcast_to(quaternion.identity(len(skeleton)), (count, len(skeleton), 4)).copy()
    for joint, name in enumerate(skeleton.names):
        sway = _sway(times, rng, np.radians(0.6), 3)
        local[:, joint] = quaternion.multiply(_held(name), quaternion.from_rotation_vector(sway))
    root = _sway(times, rng, 0.004, 3)
    places, _ = pose_kinematics(skeleton, root, local)
    feet = [joint for joint, name in enumerate(skeleton.names) if name.endswith(("ToeBase", "Foot"))]
    low = places[:, feet, 2].min() - 0.022 * _LEG
    return Motion(skeleton, root - [0.0, 0.0, low], local, fps)


def _held(name: str) -> np.ndarray:
    """How a joint is turned in the calibration pose: (4,)."""
    sign = 1.0 if name.startswith("Left") else -1.0
    if name.endswith("ForeArm"):
        return quaternion.about_axis(_Z, -sign * np.radians(20.0))
    if name.endswith("Arm"):
        return quaternion.about_axis(_X, -sign * np.radians(45.0))
    return quaternion.identity()


def _sway(times: np.ndarray, rng: np.random.Generator, size: float, columns: int) -> np.ndarray:
    """Slow, smooth unrest (T, columns) of about `size`."""
    rates, phases = rng.uniform(0.2, 0.9, (2, columns)), rng.uniform(0.0, 2.0 * np.pi, (2, columns))
    waves = np.sin(2.0 * np.pi * times[:, None, None] * rates + phases)
    return size * (waves - waves[:1]).sum(axis=1) * 0.6
