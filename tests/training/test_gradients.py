"""The network of the numpy side and that of the training are one function: same values, and jax's gradients are the
slopes that the numpy side has."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.throws.networks import phases
from beyond_mocap.throws.networks.limb_reach import solve_two_bones
from beyond_mocap.throws.networks.network import forward
from beyond_mocap.throws.networks.phases import weigh_points

SIZES = (6, 5, 5, 4)
STEP = 1e-6


def made(points):
    """Weights, biases, inputs (3, 6), phases (3,), dropout masks and the weights of the answer's sum."""
    random = np.random.default_rng(points)
    pairs = list(zip(SIZES, SIZES[1:]))
    weights = [random.normal(size=(points, out, width)) for width, out in pairs]
    biases = [random.normal(size=(points, out)) for _, out in pairs]
    keep = [(random.uniform(size=(3, width)) < 0.7) / 0.7 for width in SIZES[:-1]]
    return weights, biases, random.normal(size=(3, 6)), np.array([0.05, 0.45, 0.97]), keep, random.normal(size=(3, 4))


def value(xp, weights, biases, x, phase, keep, answer):
    """One number out of the network: a weighted sum of what it answers."""
    theta = weigh_points(phase, weights[0].shape[0], xp)
    return (forward(weights, biases, x, theta, xp, keep) * answer).sum()


def slopes(function, array):
    """Central differences of a function of no arguments by each value of an array, which it reads."""
    out = np.zeros_like(array)
    for place in np.ndindex(array.shape):
        kept = array[place]
        array[place] = kept + STEP
        above = function()
        array[place] = kept - STEP
        out[place] = (above - function()) / (2 * STEP)
        array[place] = kept
    return out


@pytest.mark.parametrize("dropout", [False, True])
@pytest.mark.parametrize("points", [1, 2, 4])
def test_gradients_of_the_training_are_the_slopes_of_numpy(points, dropout):
    weights, biases, x, phase, keep, answer = made(points)
    keep = keep if dropout else None
    with jax.enable_x64(True):
        asked = jax.jit(jax.value_and_grad(lambda *four: value(jnp, *four, keep, answer), (0, 1, 2, 3)))
        there, got = jax.tree.map(np.asarray, asked(weights, biases, x, phase))
    here = lambda: value(np, weights, biases, x, phase, keep, answer)  # noqa: E731
    assert there == pytest.approx(here(), rel=1e-12)
    for arrays, gradients in zip((weights, biases, [x], [phase]), (got[0], got[1], [got[2]], [got[3]])):
        for array, gradient in zip(arrays, gradients):
            np.testing.assert_allclose(gradient, slopes(here, array), rtol=1e-5, atol=1e-7)


def test_float32_training_says_what_float64_numpy_says():
    weights, biases, x, phase, _, answer = made(4)
    asked = jax.jit(lambda *four: value(jnp, *four, None, answer))
    there = float(asked(*jax.tree.map(np.float32, (weights, biases, x, phase))))
    assert there == pytest.approx(value(np, weights, biases, x, phase, None, answer), rel=1e-4)


def test_the_distance_phase_is_the_same_function():
    distance = np.linspace(0.2, 1.2, 21)
    there = phases.compute_distance_phase(jnp.asarray(distance), (0.4, 1.0), jnp)
    np.testing.assert_allclose(there, phases.compute_distance_phase(distance, (0.4, 1.0)), atol=1e-6)


def test_a_straight_limb_has_slopes():
    """Straight and asked to stay so, in single precision: where the bend's sine is zero its root has no slope."""
    top, middle, end = (jnp.array([0.0, 0.0, height], jnp.float32) for height in (1.0, 0.6, 0.2))
    across = jnp.array([0.0, 1.0, 0.0], jnp.float32)

    def bent(middle, target):
        first, second, place = solve_two_bones(top, middle, end, target, across, jnp)
        return (first**2).sum() + second[0].sum() + place.sum()

    slopes = jax.grad(bent, (0, 1))(middle, end)
    assert all(np.isfinite(slope).all() for slope in slopes)
