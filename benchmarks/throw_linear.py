"""What plain linear regression makes of the features, as a yardstick for the networks: it is learnt in a second.

A linear map is written as a network of one hidden layer whose units are lifted so far above zero that the ELU passes
them on unchanged.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from beyond_mocap.synthesis.phase_network.example import Example
from beyond_mocap.synthesis.phase_network.limits import learn
from beyond_mocap.synthesis.phase_network.model import ModelSettings, ThrowModel
from beyond_mocap.synthesis.phase_network.network import PhaseNetwork
from beyond_mocap.synthesis.phase_network.training_set import leg_reach, shared_chains, training_set, with_mirrors

LIFT = 256.0
"""Above any standardised answer, which ends some tens of deviations out."""
RIDGE = 30.0
"""Of standardised features: with 1 the maps follow one body so closely that they lose their way on another."""


def linear_model(examples: Sequence[Example], settings: ModelSettings) -> ThrowModel:
    """The hierarchy of `settings` with linear maps in place of its networks, by ridge regression."""
    seen = with_mirrors(examples)
    chains = shared_chains(seen)
    found = {name: fitted(one.inputs, one.answers) for name, one in training_set(seen, settings).items()}
    units = max(len(map_) for map_, *_ in found.values())
    own = ModelSettings(**{**vars(settings), "points": 1, "layers": 1, "units": units})
    limits = learn(np.concatenate([one.motion.rotations for one in seen]), (0, *chains.above, chains.hips))
    return ThrowModel(
        own, chains.skeleton, {name: _network(*one, units) for name, one in found.items()}, leg_reach(seen),
        tuple(examples), float(np.mean([one.stature for one in examples])), limits, None,
        f"{len(examples)} examples, linear regression",
    )  # fmt: skip


def fitted(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, ...]:
    """The map (out, in) between standardised columns, with their means and scales: map, mean x, scale x, mean y,
    scale y."""
    mean_x, scale_x, mean_y, scale_y = x.mean(0), x.std(0) + 1e-3, y.mean(0), y.std(0) + 1e-3
    x, y = (x - mean_x) / scale_x, (y - mean_y) / scale_y
    return np.linalg.solve(x.T @ x + RIDGE * np.eye(x.shape[1]), x.T @ y).T, mean_x, scale_x, mean_y, scale_y


def _network(map_, mean_x, scale_x, mean_y, scale_y, units: int) -> PhaseNetwork:
    out = len(map_)
    first = np.zeros((units, map_.shape[1]))
    first[:out] = map_
    second = np.eye(out, units)
    return PhaseNetwork((first[None], second[None]), (np.full((1, units), LIFT), np.full((1, out), -LIFT)),
                        mean_x, scale_x, mean_y, scale_y)  # fmt: skip
