"""A small chain for tests: a trunk with two limbs, a hinge and a joint of two angles in them, markers at random."""

import numpy as np

from beyond_mocap.markers.pose.chain import Chain, build_chain, build_poses
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.skeleton import Skeleton

SKELETON = Skeleton(
    ("Hips", "Chest", "LeftArm", "LeftForeArm", "LeftHand", "LeftUpLeg", "LeftLeg"),
    (-1, 0, 1, 2, 3, 0, 5),
    [[0, 0, 0], [0, 0, 0.3], [0, 0.2, 0.2], [0, 0.3, 0], [0, 0.25, 0], [0, 0.1, 0], [0, 0, -0.4]],
)
HINGE, SADDLE = 3, 6


def build_small_chain(seed=0, per_joint=3, stiffness=0.0, **limits) -> Chain:
    """The chain; joint 3 turns about one axis, joint 6 about two."""
    rng = np.random.default_rng(seed)
    joint = np.repeat(np.arange(len(SKELETON)), per_joint)
    free = np.ones((len(SKELETON), 3), dtype=bool)
    free[HINGE, 1:], free[SADDLE, 2] = False, False
    orders = ("XZY", "YXZ", "ZXY", "ZXY", "XYZ", "YXZ", "YXZ")
    return build_chain(
        SKELETON, joint, rng.normal(0.0, 0.08, (len(joint), 3)), orders, free,
        stiffness=np.full(len(SKELETON), stiffness), **limits,
    )


def sample_poses(small_chain: Chain, count: int, seed=1, size=0.7):
    """Poses within the limits, about `size` radians from rest."""
    rng = np.random.default_rng(seed)
    turns = quaternion.from_rotation_vector(rng.normal(0.0, size, (count, len(small_chain.skeleton), 3)))
    return build_poses(small_chain, rng.normal(0.0, 1.0, (count, 3)), turns)
