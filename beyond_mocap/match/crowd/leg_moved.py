"""A leg whose foot is put elsewhere, frame by frame: what comes out of a frame depends on no other frame.

The knee opens or closes until the ankle is as far from the hip as it has to be, about the axis about which it is bent;
of a leg that is nearly straight and shows none, about the axis square to leg and foot, since knees point where toes do.
Then the whole leg swings about the hip the shortest way. A foot that stays where it is leaves the leg as it is.
"""

from __future__ import annotations

import numpy as np

from ...base.vectors import unit_vectors
from ...motion import limb as two_bones
from ...motion import quaternion
from ...motion.humanoid import Limb
from ...motion.skeleton import Skeleton

SOFT = 0.01
"""Metres below full length from where on a leg eases."""

_CLEAR = 0.05  # sine of a knee's bend below which its axis counts less and less
_LEAST = 0.05  # m, the least distance from hip to ankle


def leg_moved(
    skeleton: Skeleton, limb: Limb, places: np.ndarray, world: np.ndarray, shift: np.ndarray
) -> dict[int, np.ndarray]:
    """Local rotations (W, 4) by joint with which the ankle lies `shift` (W, 3) m from where the pose has it against the
    hip; the foot keeps its rotation in the world.

    places (W, J, 3) m and world (W, J, 4): of all joints in the pose that is given.
    """
    hip, knee, ankle = (places[:, joint] for joint in (limb.upper_leg, limb.lower_leg, limb.foot))
    thigh, shin, line = knee - hip, ankle - knee, ankle - hip
    lengths, goal = (np.linalg.norm(thigh, axis=1), np.linalg.norm(shin, axis=1)), line + shift
    own, wanted = np.linalg.norm(line, axis=1), np.linalg.norm(goal, axis=1)
    eased = [two_bones.soft_distance(length, lengths[0] + lengths[1], SOFT) for length in (own, wanted)]
    reach = np.clip(own + eased[1] - eased[0], _LEAST, lengths[0] + lengths[1])
    opened = two_bones.inner_angle(*lengths, reach) - two_bones.inner_angle(*lengths, own)
    toes = places[:, limb.toe_or_foot] - ankle if limb.toe is not None else np.zeros(line.shape)
    bend = quaternion.about_axis(_hinge(thigh, shin, line, toes), -opened)
    swing = quaternion.between(thigh + quaternion.rotate(bend, shin), goal)
    lower = quaternion.multiply(bend, world[:, limb.lower_leg])
    carried = quaternion.multiply(swing, quaternion.multiply(bend, world[:, skeleton.parents[limb.foot]]))
    upper = quaternion.multiply(swing, world[:, limb.upper_leg])
    return {
        limb.upper_leg: in_parent(skeleton, world, limb.upper_leg, upper),
        limb.lower_leg: in_parent(skeleton, world, limb.lower_leg, lower),
        limb.foot: quaternion.multiply(quaternion.inverse(carried), world[:, limb.foot]),
    }


def in_parent(skeleton: Skeleton, world: np.ndarray, joint: int, turned: np.ndarray) -> np.ndarray:
    """(W, 4): a world rotation of a joint as one against its parent's."""
    return quaternion.multiply(quaternion.inverse(world[:, skeleton.parents[joint]]), turned)


def _hinge(thigh: np.ndarray, shin: np.ndarray, line: np.ndarray, toes: np.ndarray) -> np.ndarray:
    """(W, 3) unit: the axis about which the knee is bent, by which a positive turn bends it further."""
    bones = np.linalg.norm(thigh, axis=1) * np.linalg.norm(shin, axis=1)
    shows = np.cross(thigh, shin) / bones[:, None]
    across = unit_vectors(np.cross(toes, line), np.array([0.0, 1.0, 0.0]))
    share = np.clip(np.linalg.norm(shows, axis=1, keepdims=True) / _CLEAR, 0.0, 1.0)
    mixed = share * unit_vectors(shows, across) + (1.0 - share) * across
    down = unit_vectors(line, across)
    return unit_vectors(mixed - np.sum(mixed * down, axis=1, keepdims=True) * down, across)
