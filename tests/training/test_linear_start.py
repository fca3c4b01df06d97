"""Networks that start from regression say from the beginning what linear answers can say, phase by phase."""

import jax
import numpy as np
import pytest

from beyond_mocap.throws.networks.network import forward
from beyond_mocap.throws.networks.phases import weigh_points
from training.networks import RIDGES, build_first_weights, compute_sums, fit_linear

ROWS, INPUTS, OUTPUTS = 3000, 6, 3


def planted(points):
    """Inputs, phases' weights and answers of a linear map for each control point, a little noise on them."""
    random = np.random.default_rng(points)
    weights, biases = random.normal(size=(points, OUTPUTS, INPUTS)), random.normal(size=(points, OUTPUTS))
    x, theta = random.normal(size=(ROWS, INPUTS)), weigh_points(random.uniform(size=ROWS), points)
    y = np.einsum("nk,koi,ni->no", theta, weights, x) + theta @ biases
    return x, theta, y + 0.001 * random.normal(size=y.shape), weights


@pytest.mark.parametrize("points", [1, 4])
def test_regression_finds_the_planted_map_of_each_control_point(points):
    x, theta, y, weights = planted(points)
    found = fit_linear(compute_sums(x, y, theta), RIDGES[0])
    assert found.weights.shape == weights.shape and found.weights.dtype == np.float32
    np.testing.assert_allclose(found.weights, weights, atol=0.12)


@pytest.mark.parametrize("layers", [1, 3])
@pytest.mark.parametrize("points", [1, 4])
def test_a_network_starts_as_its_linear_answer(points, layers):
    x, theta, y, _ = planted(points)
    scale = y.std(0)
    linear = fit_linear(compute_sums(x, y / scale, theta), RIDGES[0])
    params = build_first_weights(jax.random.key(0), INPUTS, OUTPUTS, layers, 8, points, linear)
    said = forward(*(jax.tree.map(np.asarray, params[name]) for name in ("weights", "biases")), x, theta)
    expected = np.einsum("nk,koi,ni->no", theta, linear.weights, x) + theta @ linear.biases
    np.testing.assert_allclose(said, expected, atol=1e-4)
    assert np.sqrt(np.mean((said * scale - y) ** 2)) < 0.1 * np.sqrt(np.mean(y**2))


def test_without_it_all_control_points_begin_alike():
    params = build_first_weights(jax.random.key(0), INPUTS, OUTPUTS, 2, 8, 4)
    assert all(np.ptp(np.asarray(weight), axis=0).max() == 0 for weight in params["weights"])


def test_sums_of_parts_are_those_of_the_whole():
    x, theta, y, _ = planted(4)
    parts = compute_sums(x[:1000], y[:1000], theta[:1000]).add_sums(compute_sums(x[1000:], y[1000:], theta[1000:]))
    for one, other in zip(fit_linear(parts, 0.01), fit_linear(compute_sums(x, y, theta), 0.01)):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_guides_are_hardly_kept_small():
    """Two inputs that say the same: the guide among them is believed."""
    x, theta, _, _ = planted(4)
    x[:, -1] = x[:, 0]
    found = fit_linear(compute_sums(x, x[:, :OUTPUTS], theta, guides=1), 0.1)
    assert np.abs(found.weights[:, 0, -1] - 1.0).max() < 0.1 and np.abs(found.weights[:, 0, 0]).max() < 0.1
