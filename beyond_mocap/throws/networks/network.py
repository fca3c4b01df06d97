"""A phase-functioned network: its weights follow a spline over the phase; with one control point it is feed-forward.

`forward` is shared by training and use; `PhaseNetwork.frame_network` is the same for one frame at a time, as fast as
numpy allows.
Source: Fredriksson section 3.6.2 eq. 3.20-3.24.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import freeze_array
from .phases import weigh_points

INPUT_BOUND = 8.0
"""Standard deviations from the mean of the training data within which a network's output is reliable."""
MIN_INPUT_SPAN = 0.5
"""Metres, or shares of an axis, from the mean that are always allowed: some inputs hardly vary in the training data."""


def forward(weights, biases, x, theta, xp=np, keep=None):
    """Evaluate a network.

    Args:
        weights: one (K, out, in) per layer.
        biases: one (K, out) per layer.
        x: (..., in) normalised inputs.
        theta: (..., K) control point weights.
        xp: numpy or jax.numpy.
        keep: for training with dropout, one array or None per layer, multiplied with the layer's input: 0 or 1 /
            retention (eq. 3.27).
    Returns:
        (..., out) outputs. Between layers is an ELU, as in the PFNN (Holden, Komura and Saito 2017); the last layer
        is linear (eq. 3.21).
    """
    last = len(weights) - 1
    for layer, (weight, bias) in enumerate(zip(weights, biases)):
        if keep is not None and keep[layer] is not None:
            x = x * keep[layer]
        x = _evaluate_layer(weight, bias, x, theta, xp)
        if layer < last:
            x = elu(x, xp)
    return x


def _evaluate_layer(weight, bias, x, theta, xp):
    """Evaluate one layer: the output of every control point, then their weighted sum.

    This is eq. 3.24 and 3.20 in the other order, with the same result, and avoids blending (out, in) weights for
    every row of a batch.
    """
    points, out, width = weight.shape
    if points == 1:
        return x @ weight[0].T + bias[0]
    every = (x @ weight.reshape(points * out, width).T).reshape(*x.shape[:-1], points, out) + bias
    return (theta[..., None] * every).sum(-2)


def elu(x, xp=np):
    """Return x above zero, exp(x) - 1 below."""
    return xp.where(x > 0, x, xp.expm1(xp.minimum(x, 0)))


@dataclass(frozen=True, eq=False)
class PhaseNetwork:
    """A trained network, arrays read-only.

    Attributes:
        weights: one (K, out, in) per layer, K control points.
        biases: one (K, out) per layer.
        input_mean: (in,); the first layer receives (x - mean) / scale.
        input_scale: (in,).
        output_mean: (out,); the output is y scale + mean.
        output_scale: (out,).
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]
    input_mean: np.ndarray
    input_scale: np.ndarray
    output_mean: np.ndarray
    output_scale: np.ndarray

    def __post_init__(self):
        for name in ("weights", "biases"):
            arrays = tuple(freeze_array(one, _choose_float(one)) for one in getattr(self, name))
            object.__setattr__(self, name, arrays)
        for name in ("input_mean", "input_scale", "output_mean", "output_scale"):
            one = getattr(self, name)
            object.__setattr__(self, name, freeze_array(one, _choose_float(one)))
        _check_network(self)

    @property
    def points(self) -> int:
        """Number of control points K; 1 for a feed-forward network."""
        return self.weights[0].shape[0]

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return self.weights[0].shape[2]

    @property
    def outputs(self) -> int:
        """Number of outputs."""
        return self.weights[-1].shape[1]

    @property
    def parameters(self) -> int:
        """Number of trained values: weights and biases."""
        return sum(one.size for one in (*self.weights, *self.biases))

    def predict(self, x: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Compute outputs (..., out) for inputs (..., in) at phases (...) of 0 .. 1.

        The precision is that of weights and inputs.
        """
        theta = weigh_points(phase, self.points)
        normal = (x - self.input_mean) / self.input_scale
        return forward(self.weights, self.biases, normal, theta) * self.output_scale + self.output_mean

    @property
    def input_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest input (in,) near the training data, float32; see `INPUT_BOUND` and `MIN_INPUT_SPAN`."""
        mean = self.input_mean.astype(float)
        span = np.maximum(INPUT_BOUND * np.abs(self.input_scale.astype(float)), MIN_INPUT_SPAN)
        return (mean - span).astype(np.float32), (mean + span).astype(np.float32)

    @cached_property
    def frame_network(self) -> "FrameNetwork":
        """The same network for one frame at a time, in float32; prepared once."""
        return FrameNetwork(self)


class FrameNetwork:
    """A network prepared for single frames.

    Float32, the scales inside the first and the last layer, all control points of a layer in one matrix, so that a
    layer is one matrix-vector product. Column-major in memory, which makes the product up to 50 % faster, and faster
    than blending the weights first.
    """

    def __init__(self, network: PhaseNetwork):
        weights, biases = _merge_scales(network)
        self.points = network.points
        self._layers = [
            (np.asfortranarray(w.reshape(-1, w.shape[2]), np.float32), np.ascontiguousarray(b, np.float32))
            for w, b in zip(weights, biases)
        ]

    def __call__(self, x: np.ndarray, theta: np.typing.ArrayLike) -> np.ndarray:
        """Compute outputs (out,) float32 for inputs (in,), at control point weights (K,) (`weigh_points`)."""
        x, theta = np.asarray(x, np.float32), np.asarray(theta, np.float32)
        last = len(self._layers) - 1
        for layer, (weight, bias) in enumerate(self._layers):
            every = (weight @ x).reshape(bias.shape)
            every += bias
            x = theta @ every
            if layer < last:
                x = np.maximum(x, np.expm1(np.minimum(x, 0)))
        return x


def _merge_scales(network: PhaseNetwork) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Merge the normalisation into the weights and biases of the first and last layer, in float64."""
    weights = [np.asarray(w, float) for w in network.weights]
    biases = [np.asarray(b, float) for b in network.biases]
    mean, scale = network.input_mean.astype(float), network.input_scale.astype(float)
    weights[0] = weights[0] / scale
    biases[0] = biases[0] - weights[0] @ mean
    mean, scale = network.output_mean.astype(float), network.output_scale.astype(float)
    weights[-1] = weights[-1] * scale[:, None]
    biases[-1] = biases[-1] * scale + mean
    return weights, biases


def _choose_float(values) -> np.dtype:
    """Choose float32 for float32 values, float64 for all others."""
    return np.dtype(np.float32 if getattr(values, "dtype", None) == np.float32 else np.float64)


def _check_network(network: PhaseNetwork) -> None:
    """Raise InputError if shapes do not match or a value is not finite."""
    if not network.weights or len(network.weights) != len(network.biases):
        raise InputError("network", f"{len(network.weights)} weights, {len(network.biases)} biases",
                         "one of each per layer")  # fmt: skip
    width = len(network.input_mean) if network.input_mean.ndim == 1 else -1
    points = network.weights[0].shape[0]
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases), 1):
        is_wrong = weight.ndim != 3 or weight.size == 0 or weight.shape[0] != points or weight.shape[2] != width
        if is_wrong or bias.shape != weight.shape[:2]:
            raise InputError(f"network: layer {layer}", f"weights {weight.shape}, biases {bias.shape}",
                             f"({points}, out, {width}) and ({points}, out)")  # fmt: skip
        width = weight.shape[1]
    for name, size in (("input_mean", network.inputs), ("input_scale", network.inputs),
                       ("output_mean", network.outputs), ("output_scale", network.outputs)):  # fmt: skip
        if getattr(network, name).shape != (size,):
            raise InputError(f"network: {name}", f"shape {getattr(network, name).shape}", f"({size},)")
    scales = (network.input_mean, network.input_scale, network.output_mean, network.output_scale)
    if not all(np.isfinite(one).all() for one in (*network.weights, *network.biases, *scales)):
        raise InputError("network", "NaN or infinite values", "finite numbers", "train it again")
    if not (np.all(network.input_scale > 0) and np.all(network.output_scale > 0)):
        raise InputError("network", "a scale that is not positive", "positive scales", "train it again")
