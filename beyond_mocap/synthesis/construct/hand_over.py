"""A stretch that was made anew joined to the frames around it, which stay: no jump, and no foot that slides for it.

Around the stretch both motions show the same footage, but what was solved over all frames (how far a foot is shifted,
how low the pelvis goes) may differ there by some centimetres. Root and joints go over from the one to the other within
the hand-over; feet go over at once, where they are in the air. A foot that stands at the border stands where the old
motion has it until it lifts: its shift is `foot_plant.shift` of a foot that does not move at all.
"""

from __future__ import annotations

import numpy as np

from ...motion import quaternion
from ...motion.foot_plant import shift
from ...motion.humanoid import Limb, identify
from ...motion.motion import pose_kinematics, world_rotation
from ...motion.skeleton import Skeleton
from .carry import Body, Resting, leg, limb_carried
from .meeting import eased

Pose = tuple[np.ndarray, np.ndarray]


def old_share(count: int, stretch: tuple[int, int], frames: int) -> np.ndarray:
    """(count,) share of the old motion: 0 within the `stretch` (first, end), 1 from `frames` around it on."""
    at = np.arange(count)
    away = np.maximum(stretch[0] - at, at - stretch[1] + 1) / (frames + 1.0)
    return eased(away, np.ones(count))


def handed_over(skeleton: Skeleton, new: Pose, old: Pose, share: np.ndarray, standing: np.ndarray, fps: float) -> Pose:
    """Root (T, 3) m and local rotations (T, J, 4) that are `new` where share (T,) is 0 and `old` where it is 1.

    new, old: root and rotations of T frames; what `old` has where share is 0 counts for nothing. standing (T, 2, 2)
    bool: heels and toes, left and right, that stand.
    """
    root = new[0] + share[:, None] * (old[0] - new[0])
    rotations = quaternion.slerp(_signed_like(new[1], old[1], share), old[1], share[:, None])
    body = Body.posed(skeleton, root, rotations)
    fresh, stays = pose_kinematics(skeleton, *new), pose_kinematics(skeleton, *old)
    legs = identify(skeleton)
    for side, limb in enumerate((legs.left, legs.right)):
        carries = standing[:, side].any(axis=1).astype(float)[:, None]
        moved, turned = _offsets([values[:, limb.foot] for values in (*fresh, *stays)], share, carries, fps)
        chain, foot = leg(limb), quaternion.multiply(turned, fresh[1][:, limb.foot])
        place = fresh[0][:, limb.foot] + moved
        place[:, 2] += _sunk(skeleton, limb, place, foot=foot, motions=[fresh[0], stays[0]], share=share)
        away = place - body.places[:, limb.foot]
        rotations = limb_carried(body, Resting.of(body, chain), away, rotations=rotations)
        above = quaternion.inverse(world_rotation(skeleton, rotations, skeleton.parents[limb.foot]))
        rotations[:, limb.foot] = quaternion.signed_like(quaternion.multiply(above, foot), rotations[:, limb.foot])
    return root, rotations


def _sunk(skeleton: Skeleton, limb: Limb, place, foot, motions: list[np.ndarray], share) -> np.ndarray:
    """(T,) m by which a foot's joints would be below the ground, which is at height 0, and below where either motion
    has
    them: what a standing foot is shifted and turned by fades as it lifts, and may take its toes down.

    place (T, 3) m and foot (T, 4): of the ankle, world; motions: joints' places (T, J, 3) m of the new and the old one.
    """
    toes = [limb.toe] if limb.toe is not None and skeleton.parents[limb.toe] == limb.foot else []
    new, old = (places[:, [limb.foot, *toes], 2].min(axis=1) for places in motions)
    allowed = np.minimum(np.where(share > 0.0, np.minimum(new, old), new), 0.0)
    ends = [place[:, 2], *(place[:, 2] + quaternion.rotate(foot, skeleton.offsets[toe])[:, 2] for toe in toes)]
    return np.maximum(allowed - np.min(ends, axis=0), 0.0)


def _offsets(feet: list[np.ndarray], share: np.ndarray, carries: np.ndarray, fps: float) -> Pose:
    """Shift (T, 3) m and turn (T, 4) that bring a new foot to where the old one is, wherever that is known; feet: place
    and rotation of the new one and of the old one."""
    place, turn, old_place, old_turn = feet
    known = share > 0.0
    away = quaternion.to_rotation_vector(quaternion.multiply(old_turn, quaternion.inverse(turn)))
    kept = np.where(known[:, None], np.column_stack([old_place - place, away]), np.nan)
    found = shift(np.zeros((len(place) - 1, 6)), carries, 30.0 / fps, kept)
    found[known] = kept[known]
    return found[:, :3], quaternion.from_rotation_vector(found[:, 3:])


def _signed_like(rotations: np.ndarray, old: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Sign-continuous rotations (T, J, 4) whose signs are the old ones' where these begin to count."""
    rotations = quaternion.continuous(rotations)
    known = np.flatnonzero(share > 0.0)
    if not len(known):
        return rotations
    at = known[0]
    return rotations * np.where(np.sum(rotations[at] * old[at], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
