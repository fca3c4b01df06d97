"""The networks as jax trains them: first weights, what use has of them (`PhaseNetwork`), and the arrays they run on."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.throws.networks.network import PhaseNetwork

SMALLEST_SCALE = 1e-3
"""Values that hardly change in training are divided by no less than this, so that use does not blow them up."""


LIFT = 6.0
"""What is added to a value that is to pass an ELU unchanged: so many deviations below its mean hardly any comes."""
RIDGES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
"""Ridges of the linear start, for each row of normalised inputs: smaller ones follow the examples more closely and run
away when frames are fed back on another body, or on recordings with some noise."""
GUIDE = 0.01
"""What the ridge counts for inputs that say how inverse kinematics would reach (`features.guides`): they hold on any
body, all others are a little of their own."""
_ROWS = 2048


class Linear(NamedTuple):
    """A linear answer at each control point: weights (K, out, in), biases (K, out)."""

    weights: np.ndarray
    biases: np.ndarray


def first_weights(
    key, inputs: int, outputs: int, layers: int, units: int, points: int, linear: Linear | None = None
) -> dict:
    """{"weights": [(K, out, in)], "biases": [(K, out)]}: uniform within sqrt(6 / (in + out)) (Glorot and Bengio 2010),
    alike at all control points, and the last layer a tenth as large. linear: an answer that the network starts from, on
    `outputs` of its units, lifted so that ELUs let it pass, where they are at most half; else all control points begin
    alike, so that the network starts as its feed-forward twin."""
    widths = [inputs, *[units] * layers, outputs]
    weights, biases = [], []
    for layer, (width, out) in enumerate(zip(widths, widths[1:])):
        bound = np.sqrt(6.0 / (width + out)) * (0.1 if layer == layers else 1.0)
        one = jax.random.uniform(jax.random.fold_in(key, layer), (out, width), jnp.float32, -bound, bound)
        weight, bias = jnp.tile(one[None], (points, 1, 1)), jnp.zeros((points, out), jnp.float32)
        if linear is not None and 2 * outputs <= units:
            weight, bias = _passing(weight, bias, linear, layer, layers)
        weights.append(weight)
        biases.append(bias)
    return {"weights": weights, "biases": biases}


def _passing(weight, bias, linear: Linear, layer: int, last: int):
    """A layer whose first units carry the linear answer."""
    count = linear.weights.shape[1]
    if layer == 0:
        return weight.at[:, :count].set(linear.weights), bias.at[:, :count].set(linear.biases + LIFT)
    weight = weight.at[:, :count].set(jnp.eye(count, weight.shape[2]))
    if layer < last:
        return weight.at[:, count:, :count].set(0.0), bias
    return weight, bias.at[:, :count].set(-LIFT)


class Sums(NamedTuple):
    """What regression needs of rows: squares (C, C) of the columns, products (C, out) with the answers, how many rows;
    points: control points; guides: how many of the last inputs are to count `GUIDE` of the ridge."""

    squares: np.ndarray
    products: np.ndarray
    rows: int
    points: int
    guides: int = 0

    def plus(self, other: "Sums") -> "Sums":
        """Of both sets of rows."""
        squares, products = self.squares + other.squares, self.products + other.products
        return Sums(squares, products, self.rows + other.rows, self.points, self.guides)


def sums(x: np.ndarray, y: np.ndarray, theta: np.ndarray, guides: int = 0) -> Sums:
    """Of normalised inputs x (N, in) and answers y (N, out); theta: (N, K) control point weights."""
    points = theta.shape[1]
    count = (x.shape[1] + 1) * (1 if points == 1 else points + 1)
    squares, products = np.zeros((count, count)), np.zeros((count, y.shape[1]))
    for first in range(0, len(x), _ROWS):
        rows = slice(first, first + _ROWS)
        columns = _columns(x[rows].astype(float), theta[rows].astype(float))
        squares += columns.T @ columns
        products += columns.T @ y[rows].astype(float)
    return Sums(squares, products, len(x), points, guides)


def linear_start(told: Sums, ridge: float) -> Linear:
    """The linear answer, whose weights glide with the phase, that comes nearest, by ridge regression.

    With one control point that is y = W x + b. With several it is y = sum_k theta_k ((W + D_k) x + b_k): what is common
    to all phases and what is not are kept small alike, so that no control point strays where it has few frames."""
    count, out = told.products.shape
    shares = 1 if told.points == 1 else told.points + 1
    weight = np.ones((shares, count // shares))
    weight[:, -1 - told.guides : -1] = GUIDE
    found = np.linalg.solve(told.squares + np.diag(ridge * told.rows * weight.ravel()), told.products)
    found = found.reshape(shares, count // shares, out)
    every = found if told.points == 1 else found[:1] + found[1:]
    return Linear(every[:, :-1].swapaxes(1, 2).astype(np.float32), every[:, -1].astype(np.float32))


def _columns(x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """(x, 1), and with several control points also theta_k (x, 1) of each."""
    x = np.concatenate([x, np.ones((len(x), 1))], axis=1)
    if theta.shape[1] == 1:
        return x
    return np.concatenate([x, (theta[:, :, None] * x[:, None]).reshape(len(x), -1)], axis=1)


def scales_of(values: np.ndarray, smallest: float = SMALLEST_SCALE) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of each column, float32, the latter at least `smallest` (its share of the
    largest)."""
    mean, scale = values.mean(0), values.std(0)
    return mean.astype(np.float32), np.maximum(scale, smallest).astype(np.float32)


def to_use(params: dict, scales: dict) -> PhaseNetwork:
    """The trained network for use; scales: input_mean, input_scale, output_mean, output_scale."""
    arrays = {name: tuple(np.asarray(one) for one in params[name]) for name in ("weights", "biases")}
    return PhaseNetwork(**arrays, **{name: np.asarray(value) for name, value in scales.items()})


class _Arrays:
    """`jax.numpy`, but for `take`."""

    def __getattr__(self, name: str):
        return getattr(jnp, name)

    @staticmethod
    def take(values, indices: np.ndarray, axis: int):
        """`values` at fixed `indices` along an axis: runs of neighbours are sliced and put together."""
        axis = axis % values.ndim
        indices = [int(index) for index in indices]
        starts = [i for i, index in enumerate(indices) if i == 0 or index != indices[i - 1] + 1]
        runs = [indices[first:last] for first, last in zip(starts, [*starts[1:], len(indices)])]
        return jnp.concatenate([jax.lax.slice_in_dim(values, r[0], r[-1] + 1, axis=axis) for r in runs], axis)


ARRAYS = _Arrays()
"""The array module that training gives to everything that takes one (`xp`)."""
