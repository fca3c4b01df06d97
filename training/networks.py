"""The networks as jax trains them: first weights, conversion to `PhaseNetwork`, and the array module they use."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks.network import PhaseNetwork

SMALLEST_SCALE = 1e-3
"""Smallest divisor of a value: values that hardly vary in training are not amplified in use."""


LIFT = 6.0
"""Offset for a value that has to pass an ELU unchanged: values this many deviations below the mean are very rare."""
RIDGES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
"""Ridges of the linear start, for each row of normalised inputs: smaller ones follow the examples more closely but
diverge when frames are fed back on another body, or on noisy recordings.
"""
GUIDE_RIDGE = 0.01
"""Relative ridge of inputs from inverse kinematics (`features.count_guides`): they are valid on any body, all others
are partly specific to the body.
"""
_ROWS = 2048


class LinearOutput(NamedTuple):
    """A linear output at each control point.

    Attributes:
        weights: (K, out, in).
        biases: (K, out).
    """

    weights: np.ndarray
    biases: np.ndarray


def build_first_weights(
    key, inputs: int, outputs: int, layers: int, units: int, points: int, linear: LinearOutput | None = None
) -> dict:
    """Build the first weights of a network.

    Uniform within sqrt(6 / (in + out)) (Glorot and Bengio 2010), equal at all control points, so that the network
    starts as its feed-forward equivalent; the last layer a tenth as large.

    Args:
        key: random key of jax.
        inputs: number of inputs.
        outputs: number of outputs.
        layers: hidden layers.
        units: units per hidden layer.
        points: control points K.
        linear: linear output to start from, on `outputs` of the units, lifted so that ELUs pass it, or None.
    Returns:
        {"weights": [(K, out, in)], "biases": [(K, out)]}.
    Raises:
        InputError: if there are fewer units than outputs of the linear start.
    """
    if linear is not None and outputs > units:
        raise InputError("training: units", f"{units} for {outputs} outputs", f"{outputs} or more, for linear_start")
    widths = [inputs, *[units] * layers, outputs]
    weights, biases = [], []
    for layer, (width, out) in enumerate(zip(widths, widths[1:])):
        bound = np.sqrt(6.0 / (width + out)) * (0.1 if layer == layers else 1.0)
        initial = jax.random.uniform(jax.random.fold_in(key, layer), (out, width), jnp.float32, -bound, bound)
        weight, bias = jnp.tile(initial[None], (points, 1, 1)), jnp.zeros((points, out), jnp.float32)
        if linear is not None:
            weight, bias = _set_linear_units(weight, bias, linear, layer, layers)
        weights.append(weight)
        biases.append(bias)
    return {"weights": weights, "biases": biases}


def _set_linear_units(weight, bias, linear: LinearOutput, layer: int, last: int):
    """Set the first units of a layer to the linear output."""
    count = linear.weights.shape[1]
    if layer == 0:
        return weight.at[:, :count].set(linear.weights), bias.at[:, :count].set(linear.biases + LIFT)
    weight = weight.at[:, :count].set(jnp.eye(count, weight.shape[2]))
    if layer < last:
        return weight.at[:, count:, :count].set(0.0), bias
    return weight, bias.at[:, :count].set(-LIFT)


class RegressionSums(NamedTuple):
    """Sums over rows for regression.

    Attributes:
        squares: (C, C) of the columns.
        products: (C, out) with the outputs.
        rows: number of rows.
        points: number of control points.
        guides: number of last inputs with the relative ridge `GUIDE_RIDGE`.
    """

    squares: np.ndarray
    products: np.ndarray
    rows: int
    points: int
    guides: int = 0

    def add_sums(self, other: "RegressionSums") -> "RegressionSums":
        """Add the sums of two sets of rows."""
        squares, products = self.squares + other.squares, self.products + other.products
        return RegressionSums(squares, products, self.rows + other.rows, self.points, self.guides)


def compute_sums(x: np.ndarray, y: np.ndarray, theta: np.ndarray, guides: int = 0) -> RegressionSums:
    """Compute the sums of normalised inputs x (N, in) and outputs y (N, out); theta: (N, K) control point weights."""
    points = theta.shape[1]
    count = (x.shape[1] + 1) * (1 if points == 1 else points + 1)
    squares, products = np.zeros((count, count)), np.zeros((count, y.shape[1]))
    for first in range(0, len(x), _ROWS):
        rows = slice(first, first + _ROWS)
        columns = _build_columns(x[rows].astype(float), theta[rows].astype(float))
        squares += columns.T @ columns
        products += columns.T @ y[rows].astype(float)
    return RegressionSums(squares, products, len(x), points, guides)


def fit_linear(sums: RegressionSums, ridge: float) -> LinearOutput:
    """Fit the linear output with weights that vary with the phase, by ridge regression.

    With one control point that is y = W x + b. With several it is y = sum_k theta_k ((W + D_k) x + b_k): common and
    varying parts have the same ridge, so that no control point diverges where it has few frames.
    """
    count, out = sums.products.shape
    shares = 1 if sums.points == 1 else sums.points + 1
    weight = np.ones((shares, count // shares))
    weight[:, -1 - sums.guides : -1] = GUIDE_RIDGE
    # columns: `shares` blocks of (inputs, 1); the first is common to all phases, the others belong to one point each
    found = np.linalg.solve(sums.squares + np.diag(ridge * sums.rows * weight.ravel()), sums.products)
    found = found.reshape(shares, count // shares, out)
    every = found if sums.points == 1 else found[:1] + found[1:]
    return LinearOutput(every[:, :-1].swapaxes(1, 2).astype(np.float32), every[:, -1].astype(np.float32))


def _build_columns(x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Build the columns (x, 1), and with several control points also theta_k (x, 1) of each."""
    x = np.concatenate([x, np.ones((len(x), 1))], axis=1)
    if theta.shape[1] == 1:
        return x
    return np.concatenate([x, (theta[:, :, None] * x[:, None]).reshape(len(x), -1)], axis=1)


def compute_scales(values: np.ndarray, smallest: float = SMALLEST_SCALE) -> tuple[np.ndarray, np.ndarray]:
    """Compute mean and standard deviation of each column, float32, the latter at least `smallest`."""
    mean, scale = values.mean(0), values.std(0)
    return mean.astype(np.float32), np.maximum(scale, smallest).astype(np.float32)


def to_phase_network(params: dict, scales: dict) -> PhaseNetwork:
    """Convert trained parameters to a network; scales: input_mean, input_scale, output_mean, output_scale."""
    arrays = {name: tuple(np.asarray(one) for one in params[name]) for name in ("weights", "biases")}
    return PhaseNetwork(**arrays, **{name: np.asarray(value) for name, value in scales.items()})


class _ArrayModule:
    """`jax.numpy` with a different `take`."""

    def __getattr__(self, name: str):
        return getattr(jnp, name)

    @staticmethod
    def take(values, indices: np.ndarray, axis: int):
        """Take values at fixed indices along an axis: runs of neighbours are sliced and joined."""
        axis = axis % values.ndim
        indices = [int(index) for index in indices]
        starts = [i for i, index in enumerate(indices) if i == 0 or index != indices[i - 1] + 1]
        runs = [indices[first:last] for first, last in zip(starts, [*starts[1:], len(indices)])]
        return jnp.concatenate([jax.lax.slice_in_dim(values, r[0], r[-1] + 1, axis=axis) for r in runs], axis)


ARRAYS = _ArrayModule()
"""Array module that training passes to every function with a parameter `xp`."""
