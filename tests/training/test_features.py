"""Features and answers are the same in numpy and in jax, and gradients go through them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.example import build_example
from beyond_mocap.throws.networks.features import build_input, compute_phase
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.network_output import apply_output, build_output, compute_end_positions
from beyond_mocap.throws.networks.training_set import build_steps, measure_leg_reach

TARGET = (12.0, 3.0, 1.2)
CASES = [ModelSettings(guided=True, carried=True, shoulder="arm"),
         ModelSettings(kind="single", wrist="inferred", frame="static")]


@pytest.fixture(scope="module")
def example():
    made = build_throw(TARGET, 22.0, fps=60.0)
    return build_example("t", "s", made.motion, "right_hand", made.release, TARGET)


def told(settings, chains, reach, pose, truth, window, xp):
    """Everything that is computed of a step: inputs, phases, truths, ends, and the pose that the truth leads to; of
    arms and legs one each, because jax compiles for seconds."""
    found, after = {}, pose
    for name in [name for name in settings.networks if name not in ("left_arm", "right_leg")]:
        y = build_output(name, chains, settings, pose, truth, xp)
        x = build_input(name, chains, settings, pose, after, window, xp)
        after = apply_output(name, chains, settings, y, pose, after, window, xp)
        found[name] = (x, y, compute_end_positions(name, chains, settings, y, xp),
                       compute_phase(name, chains, truth, window, reach, xp))
    return found, after


@pytest.mark.parametrize("settings", CASES, ids=str)
def test_the_same_in_numpy_and_jax(example, settings):
    chains = find_chains(example.motion.skeleton, settings.shoulder)
    reach, parts = measure_leg_reach([example]), build_steps(example)
    mine = told(settings, chains, reach, *parts, np)
    theirs = told(settings, chains, reach, *jax.tree.map(jnp.asarray, parts), jnp)
    for here, there in zip(jax.tree.leaves(mine), jax.tree.leaves(theirs)):
        assert np.abs(here - np.asarray(there)).max() < 1e-4


def test_gradients_go_from_wrist_to_hips(example):
    chains, settings = find_chains(example.motion.skeleton), ModelSettings()
    pose, truth, window = jax.tree.map(lambda array: jnp.asarray(array[:5]), build_steps(example))
    names = ("hip", "right_arm")
    answers = {name: build_output(name, chains, settings, pose, truth, jnp) for name in names}

    def off(answers):
        after = pose
        for name in names:
            after = apply_output(name, chains, settings, answers[name], pose, after, window, jnp)
        return jnp.sum((after.positions - truth.positions + 0.01) ** 2)

    slopes = jax.grad(off)(answers)
    assert all(np.isfinite(slope).all() and np.abs(slope).max() > 0 for slope in slopes.values())
