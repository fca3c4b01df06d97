"""What a network's answer is, and how it becomes a pose: hips in the world, all other joints relative to their
parents; the single network says places and turns of all joints, which need not fit together (Fredriksson §7.2, §7.3,
eq. 7.5)."""

from __future__ import annotations

import numpy as np

from .chains import HIERARCHY, LIMB_OF, Chains
from .description import Windows
from .kinematics import Pose, flat, from_six, picked, six, spread
from .model import SINGLE, ModelSettings


def network_output(name: str, chains: Chains, settings: ModelSettings, pose: Pose, after: Pose, xp=np):
    """The answer y (..., out) that leads from `pose` to `after`: what a network is trained to say."""
    if name in ("hip", SINGLE):
        joints = predicted(name, chains, settings)
        places = picked(after.positions, joints, -2, xp) - origin(chains, settings, pose)[..., None, :]
        return xp.concatenate([flat(places, 2), flat(six(picked(after.turns, joints, -3, xp), xp), 2)], axis=-1)
    return flat(six(picked(after.local, predicted(name, chains, settings), -3, xp), xp), 2)


def answered(
    name: str, chains: Chains, settings: ModelSettings, y, pose: Pose, after: Pose, window: Windows, xp=np
) -> Pose:
    """`after` with what the network's answer y (..., out) says; places and turns of its chain are right from then on.

    The single network's places are left out here and its turns taken, so that bones keep their length: `floating` has
    them."""
    if name == SINGLE:
        return _single_pose(chains, settings, y, pose, xp)
    if name == "hip":
        place = y[..., :3] + origin(chains, settings, pose)
        return _hips_at(chains, after, place, from_six(y[..., 3:9], xp), xp)
    joints = predicted(name, chains, settings)
    turns = from_six(y.reshape(*y.shape[:-1], len(joints), 6), xp)
    local = {joint: turns[..., i, :, :] for i, joint in enumerate(joints)}
    given = {}
    if name in LIMB_OF[:2] and settings.wrist == "given":
        number = LIMB_OF.index(name)
        given = {chains.effectors[number]: window.hands_next[..., number, :, :]}
    return spread(chains.skeleton, after, chains.known[name], root=after.root, local=local, given=given, xp=xp)


def floating(chains: Chains, settings: ModelSettings, y, pose: Pose, xp=np):
    """What the single network says of each of `chains.joints`: places (..., j, 3) m and turns (..., j, 3, 3), in the
    world. Bones between them have any length (§7.3)."""
    count = len(chains.joints)
    places = y[..., : 3 * count].reshape(*y.shape[:-1], count, 3) + origin(chains, settings, pose)[..., None, :]
    return places, from_six(y[..., 3 * count :].reshape(*y.shape[:-1], count, 6), xp)


def ends(name: str, chains: Chains, settings: ModelSettings, y, xp=np):
    """Where an answer y (..., out) brings the ends that the loss looks at (E_i of eq. 7.5): (..., E, 3) metres.

    Of hip both upper legs, of body both upper arms and the head (his two, and the head, whose motion was lost in
    his), of a limb its wrist or toe, each in the chain's reference frame; of the single network its four effectors.
    Joints that ride along are taken as at rest."""
    if name == SINGLE:
        count = len(chains.joints)
        places = y[..., : 3 * count].reshape(*y.shape[:-1], count, 3)
        return picked(places, tuple(chains.joints.index(joint) for joint in chains.effectors), -2, xp)
    if name == "hip":
        turn = from_six(y[..., 3:9], xp)
        return xp.stack([y[..., :3] + xp.matmul(turn, _from_hips(chains, leg)) for leg in (2, 3)], axis=-2)
    joints = predicted(name, chains, settings)
    turns = from_six(y.reshape(*y.shape[:-1], len(joints), 6), xp)
    if name == "body":
        goals = (*chains.sockets[:2], chains.head)
    else:
        goals = (chains.effectors[LIMB_OF.index(name)],)
    return xp.stack([_reached(
        chains, joints, turns, reference=chains.references[name], goal=goal, xp=xp,
    ) for goal in goals], axis=-2)


def _from_hips(chains: Chains, number: int) -> np.ndarray:
    """A leg's first joint seen from the hips, joints between at rest: (3,) m."""
    way, joint = np.zeros(3), chains.sockets[number]
    while joint != chains.hips:
        way, joint = way + chains.skeleton.offsets[joint], chains.skeleton.parents[joint]
    return way


def _reached(chains: Chains, joints: tuple[int, ...], turns, reference: int, goal: int, xp):
    """Place (..., 3) m of a joint in the frame of `reference`, out of the rotations (..., N, 3, 3) of `joints`."""
    place, joint = chains.skeleton.offsets[goal], chains.skeleton.parents[goal]
    while joint != reference:
        if joint in joints:
            place = xp.matmul(turns[..., joints.index(joint), :, :], place[..., None])[..., 0]
        place, joint = place + chains.skeleton.offsets[joint], chains.skeleton.parents[joint]
    return place


def _hips_at(chains: Chains, after: Pose, place, turn, xp) -> Pose:
    """The body with its hips at a place (..., 3) m, turned by (..., 3, 3); joints above them only move."""
    root, above = place, None
    for joint in (*chains.above, chains.hips):
        if joint == 0:
            above = after.local[..., 0, :, :]
            continue
        root = root - xp.matmul(above, chains.skeleton.offsets[joint])
        above = xp.matmul(above, after.local[..., joint, :, :])
    return spread(chains.skeleton, after, chains.known["hip"], root=root, local={}, given={chains.hips: turn}, xp=xp)


def _single_pose(chains: Chains, settings: ModelSettings, y, pose: Pose, xp) -> Pose:
    """The body with the hips' place and all turns that the single network says."""
    places, turns = floating(chains, settings, y, pose, xp)
    own = {joint: turns[..., i, :, :] for i, joint in enumerate(chains.joints)}
    after = _hips_at(chains, pose, places[..., 0, :], own[chains.hips], xp)
    for name in HIERARCHY[1:]:
        given = {joint: own[joint] for joint in chains.members[name]}
        after = spread(chains.skeleton, after, chains.known[name], root=after.root, local={}, given=given, xp=xp)
    return after


def origin(chains: Chains, settings: ModelSettings, pose: Pose):
    """Where hip and single network measure from: (..., 3) metres."""
    level = np.array([1.0, 1.0, 0.0] if settings.frame == "hip" else [0.0, 0.0, 0.0])
    return pose.positions[..., chains.hips, :] * level


def predicted(name: str, chains: Chains, settings: ModelSettings) -> tuple[int, ...]:
    """Joints whose rotation (and place: hip, single) a network says."""
    if name == SINGLE:
        return chains.joints
    members = chains.members[name]
    return members[:-1] if name in LIMB_OF[:2] and settings.wrist == "given" else members
