"""Small made things that several tests here share: a skeleton with every awkward joint, and a motion of it."""

import numpy as np

NAMES = ("Hips", "LHipJoint", "LeftUpLeg", "LeftLeg", "LeftFoot", "RHipJoint", "RightUpLeg", "RightLeg", "RightFoot",
         "Spine", "Neck", "LeftArm", "LeftForeArm", "RightArm", "RightForeArm")
PARENTS = (-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 9, 11, 9, 13)
OFFSETS = np.array([
    [0, 0, 0],
    [0, 0, 0], [0.0, 0.0912345678, -0.06], [0.01, 0, -0.41], [0, 0, -0.43],  # a zero-length joint, as CMU has them
    [0, 0, 0], [0.0, -0.0912345678, -0.06], [0.01, 0, -0.41], [0, 0, -0.43],
    [0, 0, 0.25], [0, 0, 0.22], [0, 0.19, 0.18], [0, 0.29, 0], [0, -0.19, 0.18], [0, -0.29, 0],
])
END_PARENTS = (4, 8, 10, 12, 14)
END_OFFSETS = np.array([[0.18, 0, -0.05], [0.18, 0, -0.05], [0, 0, 0.18], [0, 0.26, 0], [0, -0.26, 0]])


def build_skeleton(core):
    """Fifteen joints, one of zero length on either side."""
    return core("motion.skeleton").Skeleton(NAMES, PARENTS, OFFSETS, END_PARENTS, END_OFFSETS)


def build_motion(core, frames=61, fps=30.0, seed=4):
    """Smooth turns of every joint, more than once around for the root; the root on a curve."""
    quaternion = core("motion.quaternion")
    dice = np.random.default_rng(seed)
    time = np.arange(frames)[:, None, None] / fps
    axis = dice.normal(size=(1, len(NAMES), 3))
    angle = 1.2 * np.sin(2.0 * time + dice.uniform(0, 6, (1, len(NAMES), 1)))
    rotations = quaternion.from_rotation_vector(axis / np.linalg.norm(axis, axis=-1, keepdims=True) * angle)
    rotations[:, 0] = quaternion.multiply(quaternion.from_up_angle(5.0 * time[:, 0, 0]), rotations[:, 0])
    root = np.stack([3 * time, np.sin(3 * time), 0.9 + 0.05 * np.cos(9 * time)], axis=-1)[:, 0, 0]
    return core("motion.motion").Motion(build_skeleton(core), root, rotations, fps)
