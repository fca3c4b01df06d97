"""The networks as jax trains them: first weights, and to and from what use has (`PhaseNetwork`)."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.synthesis.phase_network.network import PhaseNetwork

SMALLEST_SCALE = 1e-3
"""Values that hardly change in training are divided by no less than this, so that use does not blow them up."""


def first_weights(key, inputs: int, outputs: int, layers: int, units: int, points: int) -> dict:
    """{"weights": [(K, out, in)], "biases": [(K, out)]}: uniform within sqrt(6 / (in + out)) (Glorot and Bengio 2010);
    all control points begin alike, so that a network starts as its feed-forward twin, and the last layer a tenth as
    large."""
    widths = [inputs, *[units] * layers, outputs]
    weights, biases = [], []
    for layer, (width, out) in enumerate(zip(widths, widths[1:])):
        bound = np.sqrt(6.0 / (width + out)) * (0.1 if layer == layers else 1.0)
        one = jax.random.uniform(jax.random.fold_in(key, layer), (1, out, width), jnp.float32, -bound, bound)
        weights.append(jnp.tile(one, (points, 1, 1)))
        biases.append(jnp.zeros((points, out), jnp.float32))
    return {"weights": weights, "biases": biases}


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
