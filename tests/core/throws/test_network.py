"""Networks against sums written out, and the fast road for single frames against the plain one."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks import network as networks
from beyond_mocap.throws.networks.network import PhaseNetwork
from beyond_mocap.throws.networks.phases import weigh_points


def made(points=4, sizes=(7, 5, 6, 3), dtype=float, seed=0):
    """A network of random numbers."""
    random = np.random.default_rng(seed)
    pairs = list(zip(sizes, sizes[1:]))
    return PhaseNetwork(
        tuple(random.normal(size=(points, out, width)).astype(dtype) for width, out in pairs),
        tuple(random.normal(size=(points, out)).astype(dtype) for _, out in pairs),
        random.normal(size=sizes[0]), np.exp(random.normal(size=sizes[0])),
        random.normal(size=sizes[-1]), np.exp(random.normal(size=sizes[-1])),
    )  # fmt: skip


def written_out(network, x, phase):
    """eq. 3.20-3.24 with blended weights, one row."""
    theta = weigh_points(phase, network.points)
    a = (x - network.input_mean) / network.input_scale
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases)):
        a = np.einsum("k,koi->oi", theta, weight) @ a + theta @ bias
        if layer < len(network.weights) - 1:
            a = np.where(a > 0, a, np.exp(np.minimum(a, 0)) - 1)
    return a * network.output_scale + network.output_mean


@pytest.mark.parametrize("points", [1, 2, 4])
def test_predict_is_the_blended_network(points):
    network, random = made(points), np.random.default_rng(1)
    x, phase = random.normal(size=(3, 4, 7)), random.uniform(size=(3, 4))
    expected = [[written_out(network, x[i, j], phase[i, j]) for j in range(4)] for i in range(3)]
    np.testing.assert_allclose(network.predict(x, phase), expected, rtol=1e-10, atol=1e-10)


def test_one_control_point_ignores_the_phase():
    network, x = made(1), np.ones((2, 7))
    np.testing.assert_array_equal(network.predict(x, np.zeros(2)), network.predict(x, np.ones(2)))


@pytest.mark.parametrize("points", [1, 4])
def test_single_frames_answer_as_the_whole_batch_does(points):
    network, random = made(points, dtype=np.float32), np.random.default_rng(2)
    x, phase = random.normal(size=(20, 7)), random.uniform(size=20)
    thetas = weigh_points(phase, points)
    got = np.array([network.frame_network(row, theta) for row, theta in zip(x, thetas)])
    expected = network.predict(x, phase)
    assert np.abs(got - expected).max() < 1e-5 * np.abs(expected).max()


def test_masks_multiply_what_a_layer_is_given():
    network, x = made(), np.ones((2, 7))
    theta = weigh_points(np.array([0.2, 0.9]))
    nothing = [np.zeros((2, w.shape[2])) for w in network.weights]
    got = networks.forward(network.weights, network.biases, x, theta, keep=nothing)
    np.testing.assert_allclose(got, theta @ network.biases[-1])
    same = networks.forward(network.weights, network.biases, x, theta, keep=[None] * 3)
    np.testing.assert_array_equal(same, networks.forward(network.weights, network.biases, x, theta))


def test_float32_weights_stay_float32_and_arrays_are_read_only():
    network = made(dtype=np.float32)
    assert network.weights[0].dtype == np.float32 and not network.weights[0].flags.writeable
    assert (network.points, network.inputs, network.outputs) == (4, 7, 3)
    assert network.parameters == 4 * (7 * 5 + 5 + 5 * 6 + 6 + 6 * 3 + 3)


@pytest.mark.parametrize("field, value, said", [
    ("weights", (np.ones((4, 5, 7)), np.ones((4, 6, 4)), np.ones((4, 3, 6))), "layer 2"),
    ("weights", (), "0 weights"),
    ("biases", (np.ones((4, 5)), np.ones((4, 6)), np.ones((1, 3))), "layer 3"),
    ("input_mean", np.zeros(6), "layer 1"),
    ("output_scale", np.zeros(3), "scale"),
    ("output_scale", np.ones(2), "output_scale"),
    ("input_scale", np.full(7, np.nan), "NaN"),
])
def test_what_does_not_fit_is_said(field, value, said):
    network = made()
    fields = {name: getattr(network, name) for name in PhaseNetwork.__dataclass_fields__}
    with pytest.raises(InputError, match=said):
        PhaseNetwork(**(fields | {field: value}))
