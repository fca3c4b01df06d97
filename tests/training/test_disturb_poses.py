"""Poses beside the truth, and that networks which have seen such come back from them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.motion.humanoid import compute_heading_from_positions
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.example import build_example, compute_poses
from beyond_mocap.throws.networks.frame_step import HierarchyPredictor
from beyond_mocap.throws.networks.limits import JointLimits, estimate_joint_limits
from beyond_mocap.throws.networks.model import ThrowModel
from beyond_mocap.throws.networks.training_set import build_steps, measure_leg_reach
from training.config import build_config
from training.hierarchy import TrainingProblem
from training.networks import ARRAYS, to_phase_network
from training.recordings import (
    HEADING_NOISE,
    POSITION_NOISE,
    build_recordings,
    disturb_poses,
    sample_noise,
    to_rotations,
)

TARGETS = [(12.0, 2.0, 1.0), (9.0, -3.0, 0.4), (15.0, 0.0, 1.4)]


@pytest.fixture(scope="module")
def examples():
    made = [(target, build_throw(target, 22.0, fps=60.0)) for target in TARGETS]
    return [build_example("t", "s", one.motion, "right_hand", one.release, target, fps=15.0) for target, one in made]


def beside(chains, pose, angle, xp=np):
    count = len(pose.root)
    still = np.zeros((count, len(chains.skeleton), 3)), np.full(count, angle), np.zeros((count, 3))
    return disturb_poses(chains, pose, *still, xp)


def test_a_body_is_turned_through_its_hips(examples):
    pose, chains = compute_poses(examples[0]), find_chains(examples[0].motion.skeleton)
    turned = beside(chains, pose, 0.3)
    facing = [compute_heading_from_positions(chains.skeleton, one.positions) for one in (pose, turned)]
    np.testing.assert_allclose(facing[1] - facing[0], 0.3, atol=1e-6)
    np.testing.assert_allclose(turned.positions[:, chains.hips], pose.positions[:, chains.hips], atol=1e-6)
    again = beside(chains, jax.tree.map(jnp.asarray, type(pose)(*(one[:2] for one in pose))), 0.3, ARRAYS)
    np.testing.assert_allclose(again.positions, turned.positions[:2], atol=1e-5)


def test_what_is_drawn_is_as_large_as_asked_and_the_same_again(examples):
    chains = find_chains(examples[0].motion.skeleton)
    vectors, facing, shift = sample_noise(chains, 4000, 0.05, 1)
    riding = [joint for joint in range(len(chains.skeleton)) if joint not in chains.joints]
    assert np.all(vectors[:, riding] == 0.0) and np.array_equal(vectors, sample_noise(chains, 4000, 0.05, 1)[0])
    for found, expected in ((vectors[:, list(chains.joints)], 1.0), (facing, HEADING_NOISE), (shift, POSITION_NOISE)):
        assert np.std(found) == pytest.approx(0.05 * expected, rel=0.05)
    assert np.allclose(np.linalg.norm(vectors, axis=-1),
                       np.arccos((np.trace(to_rotations(vectors), axis1=-2, axis2=-1) - 1) / 2), atol=1e-4)


def test_regression_that_saw_poses_beside_the_truth_comes_back_to_it(examples):
    """Of a body that is turned away by 15 degrees, one predicted frame leaves less than with regression on the
    truth."""
    chains, reach = find_chains(examples[0].motion.skeleton), measure_leg_reach(examples)
    limits = JointLimits(chains.skeleton,
                         estimate_joint_limits(np.concatenate([one.motion.rotations for one in examples])))
    pose, truth, window = build_steps(examples[0])
    turned, left = beside(chains, pose, np.radians(15.0)), []
    for noise in (0.0, 0.07):
        config = build_config({"units": 96, "layers": 1, "points": 1, "fps": 15.0, "ridge": 0.03, "start_noise": noise})
        trained = TrainingProblem(build_recordings(examples), chains, config, reach, limits)
        params = trained.build_parameters(jax.random.key(0))
        networks = {name: to_phase_network(params[name], trained.scales[name]) for name in params}
        says = HierarchyPredictor(ThrowModel(settings=trained.settings, skeleton=chains.skeleton, networks=networks,
                                             leg_reach=reach, examples=tuple(examples)), chains)
        found = [says(*(type(part)(*(one[frame] for one in part)) for part in (turned, window))).positions
                 for frame in (8, 12, 20, 25)]
        facing = [
            compute_heading_from_positions(chains.skeleton, one)
            for one in (np.array(found), truth.positions[[8, 12, 20, 25]])
        ]
        left.append(np.degrees(np.abs(facing[0] - facing[1]).mean()))
    assert left[1] < 0.6 * left[0] and left[1] < 9.0
