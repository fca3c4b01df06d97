"""The output of a network, and how it becomes a pose.

Hips in the world, all other joints relative to their parents; the single network predicts positions and rotations of
all joints, which need not be consistent.
Source: Fredriksson sections 7.2 and 7.3, eq. 7.5.
"""

from __future__ import annotations

import numpy as np

from .chains import HIERARCHY, LIMB_OF, Chains
from .description import Windows
from .kinematics import Pose, flatten, from_six, take_joints, to_six, update_joints
from .model import SINGLE, ModelSettings


def build_output(name: str, chains: Chains, settings: ModelSettings, pose: Pose, after: Pose, xp=np):
    """Build the output y (..., out) that leads from `pose` to `after`: the training target of a network."""
    if name in ("hip", SINGLE):
        joints = list_predicted_joints(name, chains, settings)
        places = take_joints(after.positions, joints, -2, xp) - compute_origin(chains, settings, pose)[..., None, :]
        return xp.concatenate([flatten(places, 2), flatten(to_six(take_joints(after.turns, joints, -3, xp), xp),
                                                           2)], axis=-1)
    return flatten(to_six(take_joints(after.local, list_predicted_joints(name, chains, settings), -3, xp), xp), 2)


def apply_output(
    name: str, chains: Chains, settings: ModelSettings, y, pose: Pose, after: Pose, window: Windows, xp=np
) -> Pose:
    """Apply the output of a network to a pose.

    The single network's positions are left out here and its rotations used, so that bones keep their length;
    `split_single_output` returns them.

    Args:
        name: name of the network.
        chains: chains of the skeleton.
        settings: settings of the model.
        y: (..., out) output.
        pose: state in frame n.
        after: what is known of frame n + 1 so far.
        window: network inputs of frame n.
        xp: numpy or jax.numpy.
    Returns:
        `after` with valid positions and rotations of the network's chain.
    """
    if name == SINGLE:
        return _build_single_pose(chains, settings, y, pose, xp)
    if name == "hip":
        place = y[..., :3] + compute_origin(chains, settings, pose)
        return _place_hips(chains, after, place, from_six(y[..., 3:9], xp), xp)
    joints = list_predicted_joints(name, chains, settings)
    turns = from_six(y.reshape(*y.shape[:-1], len(joints), 6), xp)
    local = {joint: turns[..., i, :, :] for i, joint in enumerate(joints)}
    given = {}
    if name in LIMB_OF[:2] and settings.wrist == "given":
        number = LIMB_OF.index(name)
        given = {chains.effectors[number]: window.hands_next[..., number, :, :]}
    return update_joints(chains.skeleton, after, chains.known[name], root=after.root, local=local, given=given, xp=xp)


def split_single_output(chains: Chains, settings: ModelSettings, y, pose: Pose, xp=np):
    """Split the output of the single network into positions (..., j, 3) m and rotations (..., j, 3, 3), world.

    They are those of `chains.joints`; the bones between them have any length (section 7.3).
    """
    count = len(chains.joints)
    places = y[..., : 3 * count].reshape(*y.shape[:-1], count, 3) + compute_origin(chains, settings, pose)[..., None, :]
    return places, from_six(y[..., 3 * count :].reshape(*y.shape[:-1], count, 6), xp)


def compute_end_positions(name: str, chains: Chains, settings: ModelSettings, y, xp=np):
    """Compute the end positions (..., E, 3) m of an output y (..., out) that the loss compares (E_i of eq. 7.5).

    For the hip both upper legs, for the body both upper arms and the head (Fredriksson: the upper arms only, which
    lost the motion of the head), for a limb its wrist or toe, each in the reference frame of the chain; for the
    single network its four effectors. Joints that no network moves count as at rest.
    """
    if name == SINGLE:
        count = len(chains.joints)
        places = y[..., : 3 * count].reshape(*y.shape[:-1], count, 3)
        return take_joints(places, tuple(chains.joints.index(joint) for joint in chains.effectors), -2, xp)
    if name == "hip":
        turn = from_six(y[..., 3:9], xp)
        return xp.stack([y[..., :3] + xp.matmul(turn, _compute_leg_offset(chains, leg)) for leg in (2, 3)], axis=-2)
    joints = list_predicted_joints(name, chains, settings)
    turns = from_six(y.reshape(*y.shape[:-1], len(joints), 6), xp)
    if name == "body":
        goals = (*chains.tops[:2], chains.head)
    else:
        goals = (chains.effectors[LIMB_OF.index(name)],)
    return xp.stack([_compute_position(
        chains, joints, turns, reference=chains.references[name], goal=goal, xp=xp,
    ) for goal in goals], axis=-2)


def _compute_leg_offset(chains: Chains, number: int) -> np.ndarray:
    """Compute the position (3,) m of a leg's first joint relative to the hips, joints between them at rest."""
    offset, joint = np.zeros(3), chains.sockets[number]
    while joint != chains.hips:
        offset, joint = offset + chains.skeleton.offsets[joint], chains.skeleton.parents[joint]
    return offset


def _compute_position(chains: Chains, joints: tuple[int, ...], turns, reference: int, goal: int, xp):
    """Compute the position (..., 3) m of joint `goal` in the frame of `reference`; turns (..., N, 3, 3) of `joints`."""
    place, joint = chains.skeleton.offsets[goal], chains.skeleton.parents[goal]
    while joint != reference:
        if joint in joints:
            place = xp.matmul(turns[..., joints.index(joint), :, :], place[..., None])[..., 0]
        place, joint = place + chains.skeleton.offsets[joint], chains.skeleton.parents[joint]
    return place


def _place_hips(chains: Chains, after: Pose, place, turn, xp) -> Pose:
    """Place the hips at (..., 3) m with rotation (..., 3, 3); joints above them only move."""
    root, above = place, None
    for joint in (*chains.above, chains.hips):
        if joint == 0:
            above = after.local[..., 0, :, :]
            continue
        root = root - xp.matmul(above, chains.skeleton.offsets[joint])
        above = xp.matmul(above, after.local[..., joint, :, :])
    return update_joints(chains.skeleton, after, chains.known["hip"], root=root, local={}, given={chains.hips: turn},
                         xp=xp)


def _build_single_pose(chains: Chains, settings: ModelSettings, y, pose: Pose, xp) -> Pose:
    """Build the pose with the hip position and all rotations that the single network predicts."""
    places, turns = split_single_output(chains, settings, y, pose, xp)
    own = {joint: turns[..., i, :, :] for i, joint in enumerate(chains.joints)}
    after = _place_hips(chains, pose, places[..., 0, :], own[chains.hips], xp)
    for name in HIERARCHY[1:]:
        given = {joint: own[joint] for joint in chains.members[name]}
        after = update_joints(chains.skeleton, after, chains.known[name], root=after.root, local={}, given=given, xp=xp)
    return after


def compute_origin(chains: Chains, settings: ModelSettings, pose: Pose):
    """Compute the point (..., 3) m from which the hip and single network measure positions."""
    level = np.array([1.0, 1.0, 0.0] if settings.frame == "hip" else [0.0, 0.0, 0.0])
    return pose.positions[..., chains.hips, :] * level


def list_predicted_joints(name: str, chains: Chains, settings: ModelSettings) -> tuple[int, ...]:
    """List the joints whose rotation (for hip and single also position) a network predicts."""
    if name == SINGLE:
        return chains.joints
    members = chains.members[name]
    return members[:-1] if name in LIMB_OF[:2] and settings.wrist == "given" else members
