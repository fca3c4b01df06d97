"""Features and answers are the same in numpy and in jax, and gradients go through them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.synthetic.throws import throw
from beyond_mocap.throws.networks.answers import answered, ends, network_output
from beyond_mocap.throws.networks.chains import chains_of
from beyond_mocap.throws.networks.example import example_of
from beyond_mocap.throws.networks.features import network_input, phase_of
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.training_set import leg_reach, steps

TARGET = (12.0, 3.0, 1.2)
CASES = [ModelSettings(guided=True, carried=True), ModelSettings(kind="single", wrist="inferred", frame="static")]


@pytest.fixture(scope="module")
def example():
    made = throw(TARGET, 22.0, fps=60.0)
    return example_of("t", "s", made.motion, "right_hand", made.release, TARGET)


def told(settings, chains, reach, pose, truth, window, xp):
    """Everything that is computed of a step: inputs, phases, truths, ends, and the pose that the truth leads to; of
    arms and legs one each, because jax compiles for seconds."""
    found, after = {}, pose
    for name in [name for name in settings.networks if name not in ("left_arm", "right_leg")]:
        y = network_output(name, chains, settings, pose, truth, xp)
        x = network_input(name, chains, settings, pose, after, window, xp)
        after = answered(name, chains, settings, y, pose, after, window, xp)
        found[name] = (x, y, ends(name, chains, settings, y, xp), phase_of(name, chains, truth, window, reach, xp))
    return found, after


@pytest.mark.parametrize("settings", CASES, ids=str)
def test_the_same_in_numpy_and_jax(example, settings):
    chains, reach, parts = chains_of(example.motion.skeleton), leg_reach([example]), steps(example)
    mine = told(settings, chains, reach, *parts, np)
    theirs = told(settings, chains, reach, *jax.tree.map(jnp.asarray, parts), jnp)
    for here, there in zip(jax.tree.leaves(mine), jax.tree.leaves(theirs)):
        assert np.abs(here - np.asarray(there)).max() < 1e-4


def test_gradients_go_from_wrist_to_hips(example):
    chains, settings = chains_of(example.motion.skeleton), ModelSettings()
    pose, truth, window = jax.tree.map(lambda array: jnp.asarray(array[:5]), steps(example))
    names = ("hip", "right_arm")
    answers = {name: network_output(name, chains, settings, pose, truth, jnp) for name in names}

    def off(answers):
        after = pose
        for name in names:
            after = answered(name, chains, settings, answers[name], pose, after, window, jnp)
        return jnp.sum((after.positions - truth.positions + 0.01) ** 2)

    slopes = jax.grad(off)(answers)
    assert all(np.isfinite(slope).all() and np.abs(slope).max() > 0 for slope in slopes.values())
