"""Several motions sampled together are sampled as each by itself."""

import numpy as np

from beyond_mocap.motion.motion import Motion, sample_frames, sample_motions
from beyond_mocap.motion.quaternion import from_rotation_vector
from beyond_mocap.motion.skeleton import Skeleton


def test_rows_of_several_motions_are_those_of_each_one_to_the_last_bit():
    chance = np.random.default_rng(3)
    skeleton = Skeleton(("hips", "knee", "foot"), (-1, 0, 1), chance.normal(size=(3, 3)))
    motions = [Motion(skeleton, chance.normal(size=(count, 3)), from_rotation_vector(chance.normal(size=(count, 3, 3))),
                      30.0) for count in (1, 7, 40)]
    rows = np.split(chance.permutation(300), (20, 150))
    frames = chance.uniform(-2.0, 45.0, 300)
    frames[rows[1]] = np.round(frames[rows[1]])  # between no frames: nothing is blended
    root, rotations = sample_motions(motions, rows, frames, skeleton)
    for motion, at in zip(motions, rows):
        alone = sample_frames(motion, frames[at])
        assert np.array_equal(root[at], alone[0]) and np.array_equal(rotations[at], alone[1])
    assert sample_motions([], [], np.zeros(0), skeleton)[1].shape == (0, 3, 4)
