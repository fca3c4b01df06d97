"""What plain linear regression makes of the features, with and without phases, as a yardstick for the networks: it is
learnt in a second, and has nothing to do with how long anything was trained.

A linear map is written as a network of one hidden layer whose units are lifted so far above zero that the ELU passes
them on unchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from beyond_mocap.synthesis.phase_network import phase_function
from beyond_mocap.synthesis.phase_network.example import Example
from beyond_mocap.synthesis.phase_network.limits import learn
from beyond_mocap.synthesis.phase_network.model import ModelSettings, ThrowModel
from beyond_mocap.synthesis.phase_network.network import PhaseNetwork
from beyond_mocap.synthesis.phase_network.training_set import TrainingSet, leg_reach, shared_chains, training_set

LIFT = 256.0
"""Above any standardised answer, which ends some tens of deviations out."""


def linear_model(examples: Sequence[Example], settings: ModelSettings) -> ThrowModel:
    """The model of `settings` with linear maps in place of its networks, by the ridge regression that trainings start
    from."""
    chains = shared_chains(examples)
    learnt = training_set(examples, settings)
    units = max(one.answers.shape[1] for one in learnt.values())
    networks = {name: _network(one, settings.points, units) for name, one in learnt.items()}
    return ThrowModel(
        settings=replace(settings, layers=1, units=units), skeleton=chains.skeleton, networks=networks,
        leg_reach=leg_reach(examples), examples=tuple(examples),
        stature=float(np.mean([one.stature for one in examples])),
        joint_limits=learn(np.concatenate([one.motion.rotations for one in examples]), (0, *chains.above, chains.hips)),
        trained_on=f"{len(examples)} examples, linear regression",
    )  # fmt: skip


RIDGE = {"plain": 0.01, "phased": 0.001}
"""Of each row. Maps whose weights glide with the phase stay on the road with less."""


def _network(learnt: TrainingSet, points: int, units: int) -> PhaseNetwork:
    """The map that answers best, its control points weighted by the phase."""
    from training.networks import linear_start, scales_of, sums

    (mean_x, scale_x), (mean_y, scale_y) = scales_of(learnt.inputs), scales_of(learnt.answers)
    theta = phase_function.weights(learnt.phases, points)
    told = sums((learnt.inputs - mean_x) / scale_x, (learnt.answers - mean_y) / scale_y, theta)
    found = linear_start(told, RIDGE["plain" if points == 1 else "phased"])
    out, width = found.weights.shape[1:]
    first, bias = np.zeros((points, units, width)), np.full((points, units), LIFT)
    first[:, :out], bias[:, :out] = found.weights, found.biases + LIFT
    second = np.tile(np.eye(out, units), (points, 1, 1))
    return PhaseNetwork((first, second), (bias, np.full((points, out), -LIFT)), mean_x, scale_x, mean_y, scale_y)
