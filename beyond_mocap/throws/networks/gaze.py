"""Where a kicker looks: heads hold still in space while the trunk winds up, which hands and feet do not show.

In recorded kicks the head stays within some 7 degrees of its mean in the second before contact, and the chest within
15. Networks turn the head with the trunk. So the head moves part of the way as the heads of the examples do at that
time before or after the contact, as seen from the line along which the kicker comes to the ball. Where it points on
average stays as the networks have it: in examples that is as much the suit's as the person's.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...motion import quaternion
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion, forward_kinematics
from .description import Description, interpolate_positions
from .example import build_description, orient_example
from .limits import JointLimits
from .model import ThrowModel

_SECONDS = 0.1  # standard deviation in time over which heads of examples are averaged
_NECK_SHARE = 0.5  # of the turn of the head that the neck makes


def turn_head(model: ThrowModel, description: Description, motion: Motion, share: float,
              limits: JointLimits | None = None) -> Motion:
    """Let the head of a kick move part of the way as the heads of the examples do, about the mean that it has.

    Args:
        model: model with examples.
        description: description that the motion follows.
        motion: the motion, T frames.
        share: share of the way, 0 to 1.
        limits: limits of neck and head, None for none.
    Returns:
        The motion; as it was for throws and for bodies without a head.
    """
    body = identify_joints(motion.skeleton)
    if not share or model.settings.action != "kick" or body.head is None or not model.examples:
        return motion
    seconds = (np.arange(len(motion)) - description.release) / description.fps
    approach = quaternion.from_up_angle(_measure_approach(description))
    known, heads = _collect_heads(model, description.limb)
    away = (known - np.clip(seconds, known.min(), known.max())[:, None]) / _SECONDS
    wanted = quaternion.multiply(approach, quaternion.average(heads, np.exp(-0.5 * away**2)))
    world, turned = forward_kinematics(motion)[1], motion
    own = world[:, body.head]
    held = quaternion.multiply(quaternion.inverse(wanted), own)
    wanted = quaternion.multiply(wanted, quaternion.average(held, np.ones((1, len(held)))))
    for joint, part in ((body.neck, _NECK_SHARE * share), (body.head, share)):
        if joint is not None:
            aim = quaternion.slerp(own, quaternion.match_signs(wanted, own), part)
            turn = quaternion.multiply(aim, quaternion.inverse(own))
            turned = _set_rotation(turned, joint, quaternion.multiply(turn, world[:, joint]))
    return turned if limits is None else _limit_joints(turned, motion, limits)


def _set_rotation(motion: Motion, joint: int, world: np.ndarray) -> Motion:
    """Give a joint other world rotations (T, 4)."""
    parent = forward_kinematics(motion)[1][:, motion.skeleton.parents[joint]]
    rotations = motion.rotations.copy()
    rotations[:, joint] = quaternion.multiply(quaternion.inverse(parent), world)
    return replace(motion, rotations=rotations)


def _limit_joints(motion: Motion, before: Motion, limits: JointLimits) -> Motion:
    """Limit the joints that differ from `before` to their ranges."""
    local, over = limits.limit_rotations(quaternion.to_matrix(motion.rotations))
    changed = np.any(motion.rotations != before.rotations, axis=-1) & (over > 0.0)
    return replace(motion, rotations=np.where(changed[..., None], quaternion.from_matrix(local), motion.rotations))


def _measure_approach(description: Description) -> np.ndarray:
    """Measure the direction (rad about Z) from where hands and feet are first to where the foot meets the ball."""
    ball = interpolate_positions(description, np.array(description.release))[description.limb]
    way = ball - description.effectors[0].mean(axis=0)
    return np.arctan2(way[1], way[0])


@lru_cache(maxsize=8)
def _collect_heads(model: ThrowModel, limb: int) -> tuple[np.ndarray, np.ndarray]:
    """Collect the heads of all examples, mirrored where the other foot kicks.

    Returns:
        Seconds (N,) from the contact, and rotations (N, 4) relative to the approach.
    """
    seconds, rotations = [], []
    for example in model.examples:
        own = orient_example(example, limb)
        head = identify_joints(own.motion.skeleton).head
        back = quaternion.from_up_angle(-_measure_approach(build_description(own)))
        seconds.append((np.arange(len(own.motion)) - own.release) / own.motion.fps)
        rotations.append(quaternion.multiply(back, forward_kinematics(own.motion)[1][:, head]))
    return np.concatenate(seconds), np.concatenate(rotations)
