"""Networks trained on a made throw: what training predicts is what use predicts; losses fall; models come out whole."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.network_npz import read_model, write_model
from beyond_mocap.throws.networks.example import build_description, build_example, compute_poses
from beyond_mocap.throws.networks.frame_step import Stepper
from beyond_mocap.throws.networks.limits import JointLimits, estimate_joint_limits
from beyond_mocap.throws.networks.model import ThrowModel
from beyond_mocap.throws.networks.training_set import build_steps, find_shared_chains, measure_leg_reach
from training.config import build_config
from training.fit import fit
from training.hierarchy import TrainingProblem
from training.networks import to_phase_network
from training.recordings import build_recordings
from training.train import train

SMALL = {"units": 12, "layers": 1, "points": 2, "epochs": 8, "batch": 32, "mirrored": False, "noise": 0.0, "fps": 15.0,
         "macro": 50,
         "linear_start": False}


@pytest.fixture(scope="module")
def examples():
    made = []
    for number, target in enumerate([(12.0, 2.0, 1.0), (9.0, -3.0, 0.4)]):
        thrown = build_throw(target, 22.0, fps=60.0)
        made.append(
            build_example(f"throw {number}", "someone", thrown.motion, "right_hand", thrown.release, target, fps=15.0)
        )
    return made


def problem(examples, told):
    chains = find_shared_chains(examples)
    limits = estimate_joint_limits(np.concatenate([example.motion.rotations for example in examples]))
    config = build_config({**SMALL, **told})
    return TrainingProblem(build_recordings(examples), chains, config, measure_leg_reach(examples),
                           JointLimits(chains.skeleton, limits))


@pytest.mark.parametrize("kind", ["hierarchy", "single"])
def test_training_predicts_what_use_predicts(examples, kind):
    """One frame from the truth with the same random weights: the places of all joints."""
    trained = problem(examples, {"kind": kind})
    params = jax.tree.map(lambda a: 3.0 * a, trained.build_parameters(jax.random.key(5)))
    model = ThrowModel(settings=trained.settings, skeleton=examples[0].motion.skeleton,
                       networks={name: to_phase_network(params[name], trained.scales[name]) for name in params},
                       leg_reach=measure_leg_reach(examples), examples=tuple(examples))
    pose, _, window = build_steps(examples[0])
    at = lambda part, frame: type(part)(*(one[frame] for one in part))  # noqa: E731
    mine, _ = Stepper(model).predict_pose(at(pose, 7), at(window, 7), bounded=False)
    recorded, _, _ = trained.data
    batch = jnp.array([0])
    (start, told), (truth, _) = recorded.select_frames(batch, batch + 7), recorded.select_frames(batch, batch + 8)
    theirs, _ = jax.jit(trained._predict_frame)(params, start, truth, told, jax.random.key(0))
    assert np.abs(mine.positions - np.asarray(theirs.positions[0])).max() < 2e-4
    assert np.linalg.norm(mine.positions - pose.positions[7], axis=-1).max() > 0.01


def test_networks_alone_learn_and_a_model_comes_out(examples, tmp_path):
    config = build_config({**SMALL, "conditioned": False, "rollout": 1, "epochs": 40, "learning_rate": 0.01,
                           "points": 1})
    losses = []
    model = train(examples, config, progress=lambda share, text: losses.append(text))
    write_model(model, tmp_path / "w.npz")
    again = read_model(tmp_path / "w.npz")
    assert set(again.networks) == set(config.settings.networks) and "2 examples of 1 subject" in again.trained_on
    first, last = (float(text.split()[-1]) for text in (losses[1], losses[-1]))
    assert last < 0.5 * first


def test_frames_fed_back_are_learnt(examples):
    asked = {"kind": "single", "rollout": 3, "single_frames": 0.0, "learning_rate": 0.003, "epochs": 24, "noise": 0.02}
    told = problem(examples, asked)
    trained = fit(told, told.config)
    assert trained.losses[-1] < 0.7 * trained.losses[0]
    assert set(trained.parts) == {"loss", "single", "sizes"}


def test_alone_and_fed_back_do_not_go_together(examples):
    with pytest.raises(InputError, match="rollout"):
        problem(examples, {"conditioned": False, "rollout": 4})


def test_examples_of_another_rate_are_refused(examples):
    with pytest.raises(InputError, match="frames per second"):
        train(examples, build_config({**SMALL, "fps": 30.0}))


def test_recordings_are_held_at_their_end(examples):
    shorter = replace(examples[1], motion=examples[1].motion.frames(0, 9), release=5.0)
    told = build_recordings([examples[0], shorter])
    assert told.lengths == (len(examples[0].motion), 9)
    assert np.allclose(told.pose.root[1, -1], compute_poses(shorter).root[-1], atol=1e-6)
    assert np.allclose(told.window.phase[1, 8:], told.window.phase[1, 8]) and len(build_description(shorter)) == 9
    assert told.digest != build_recordings([examples[0]]).digest
