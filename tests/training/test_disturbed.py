"""Poses beside the truth, and that networks which have seen such come back from them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.motion.humanoid import heading_from_positions
from beyond_mocap.synthetic.throws import throw
from beyond_mocap.throws.networks.chains import chains_of
from beyond_mocap.throws.networks.example import example_of, poses
from beyond_mocap.throws.networks.frame_step import OneFrame
from beyond_mocap.throws.networks.limits import JointLimits, learn
from beyond_mocap.throws.networks.model import ThrowModel
from beyond_mocap.throws.networks.training_set import leg_reach, steps
from training.config import config_of
from training.hierarchy import Networks
from training.networks import ARRAYS, to_use
from training.recordings import FACING, PLACE, disturbed, drawn, recordings, small_turns

TARGETS = [(12.0, 2.0, 1.0), (9.0, -3.0, 0.4), (15.0, 0.0, 1.4)]


@pytest.fixture(scope="module")
def examples():
    made = [(target, throw(target, 22.0, fps=60.0)) for target in TARGETS]
    return [example_of("t", "s", one.motion, "right_hand", one.release, target, fps=15.0) for target, one in made]


def beside(chains, pose, angle, xp=np):
    count = len(pose.root)
    still = np.zeros((count, len(chains.skeleton), 3)), np.full(count, angle), np.zeros((count, 3))
    return disturbed(chains, pose, *still, xp)


def test_a_body_is_turned_through_its_hips(examples):
    pose, chains = poses(examples[0]), chains_of(examples[0].motion.skeleton)
    turned = beside(chains, pose, 0.3)
    facing = [heading_from_positions(chains.skeleton, one.positions) for one in (pose, turned)]
    np.testing.assert_allclose(facing[1] - facing[0], 0.3, atol=1e-6)
    np.testing.assert_allclose(turned.positions[:, chains.hips], pose.positions[:, chains.hips], atol=1e-6)
    again = beside(chains, jax.tree.map(jnp.asarray, type(pose)(*(one[:2] for one in pose))), 0.3, ARRAYS)
    np.testing.assert_allclose(again.positions, turned.positions[:2], atol=1e-5)


def test_what_is_drawn_is_as_large_as_asked_and_the_same_again(examples):
    chains = chains_of(examples[0].motion.skeleton)
    vectors, facing, shift = drawn(chains, 4000, 0.05, 1)
    riding = [joint for joint in range(len(chains.skeleton)) if joint not in chains.joints]
    assert np.all(vectors[:, riding] == 0.0) and np.array_equal(vectors, drawn(chains, 4000, 0.05, 1)[0])
    for found, expected in ((vectors[:, list(chains.joints)], 1.0), (facing, FACING), (shift, PLACE)):
        assert np.std(found) == pytest.approx(0.05 * expected, rel=0.05)
    assert np.allclose(np.linalg.norm(vectors, axis=-1),
                       np.arccos((np.trace(small_turns(vectors), axis1=-2, axis2=-1) - 1) / 2), atol=1e-4)


def test_regression_that_saw_poses_beside_the_truth_comes_back_to_it(examples):
    """Of a body that is turned away by 15 degrees, one predicted frame leaves less than with regression on the
    truth."""
    chains, reach = chains_of(examples[0].motion.skeleton), leg_reach(examples)
    limits = JointLimits(chains.skeleton, learn(np.concatenate([one.motion.rotations for one in examples])))
    pose, truth, window = steps(examples[0])
    turned, left = beside(chains, pose, np.radians(15.0)), []
    for noise in (0.0, 0.07):
        config = config_of({"units": 96, "layers": 1, "points": 1, "fps": 15.0, "ridge": 0.03, "start_noise": noise})
        trained = Networks(recordings(examples), chains, config, reach, limits)
        params = trained.first(jax.random.key(0))
        networks = {name: to_use(params[name], trained.scales[name]) for name in params}
        says = OneFrame(ThrowModel(settings=trained.settings, skeleton=chains.skeleton, networks=networks,
                                   leg_reach=reach, examples=tuple(examples)), chains)
        found = [says(*(type(part)(*(one[frame] for one in part)) for part in (turned, window))).positions
                 for frame in (8, 12, 20, 25)]
        facing = [
            heading_from_positions(chains.skeleton, one) for one in (np.array(found), truth.positions[[8, 12, 20, 25]])
        ]
        left.append(np.degrees(np.abs(facing[0] - facing[1]).mean()))
    assert left[1] < 0.6 * left[0] and left[1] < 9.0
