"""The networks as jax trains them: first weights, and to and from what use has (`PhaseNetwork`)."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.synthesis.phase_network.network import PhaseNetwork

SMALLEST_SCALE = 1e-3
"""Values that hardly change in training are divided by no less than this, so that use does not blow them up."""


LIFT = 6.0
"""What is added to a value that is to pass an ELU unchanged: so many deviations below its mean hardly any comes."""
RIDGE = 0.01
"""Ridge of the linear start for each row of normalised inputs. A tenth of it follows the examples more closely and runs
away when frames are fed back on another body."""


def first_weights(key, inputs: int, outputs: int, layers: int, units: int, points: int, linear=None) -> dict:
    """{"weights": [(K, out, in)], "biases": [(K, out)]}: uniform within sqrt(6 / (in + out)) (Glorot and Bengio 2010);
    all control points begin alike, so that a network starts as its feed-forward twin, and the last layer a tenth as
    large. linear (out, in) or None: a linear answer that the network starts from, on `outputs` of its units, lifted so
    that ELUs let it pass, where they are at most half."""
    widths = [inputs, *[units] * layers, outputs]
    weights, biases = [], []
    for layer, (width, out) in enumerate(zip(widths, widths[1:])):
        bound = np.sqrt(6.0 / (width + out)) * (0.1 if layer == layers else 1.0)
        one = jax.random.uniform(jax.random.fold_in(key, layer), (out, width), jnp.float32, -bound, bound)
        bias = jnp.zeros(out, jnp.float32)
        if linear is not None and 2 * outputs <= units:
            one, bias = _passing(one, bias, jnp.asarray(linear), layer, layers)
        weights.append(jnp.tile(one[None], (points, 1, 1)))
        biases.append(jnp.tile(bias[None], (points, 1)))
    return {"weights": weights, "biases": biases}


def _passing(weight, bias, linear, layer: int, last: int):
    """A layer whose first units carry the linear answer."""
    count = len(linear)
    if layer == 0:
        return weight.at[:count].set(linear), bias.at[:count].set(LIFT)
    weight = weight.at[:count].set(jnp.eye(count, weight.shape[1]))
    if layer < last:
        return weight.at[count:, :count].set(0.0), bias
    return weight, bias.at[:count].set(-LIFT)


def linear_start(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The linear answer (out, in) to normalised inputs x (N, in) that comes nearest to y (N, out), by ridge regression."""
    x, y = x.astype(float), y.astype(float)
    return np.linalg.solve(x.T @ x + RIDGE * len(x) * np.eye(x.shape[1]), x.T @ y).T.astype(np.float32)


def scales_of(values: np.ndarray, smallest: float = SMALLEST_SCALE) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of each column, float32, the latter at least `smallest` (its share of the largest)."""
    mean, scale = values.mean(0), values.std(0)
    return mean.astype(np.float32), np.maximum(scale, smallest).astype(np.float32)


def to_use(params: dict, scales: dict) -> PhaseNetwork:
    """The trained network for use; scales: input_mean, input_scale, output_mean, output_scale."""
    arrays = {name: tuple(np.asarray(one) for one in params[name]) for name in ("weights", "biases")}
    return PhaseNetwork(**arrays, **{name: np.asarray(value) for name, value in scales.items()})


def from_use(network: PhaseNetwork) -> tuple[dict, dict]:
    """Parameters and scales of a trained network, to go on from."""
    params = {name: [jnp.asarray(one) for one in getattr(network, name)] for name in ("weights", "biases")}
    names = ("input_mean", "input_scale", "output_mean", "output_scale")
    return params, {name: np.asarray(getattr(network, name)) for name in names}
