"""Linear maps as networks: what regression says comes out of them, phase by phase."""

import numpy as np
import pytest

from benchmarks.throw_linear import RIDGE, linear_model
from beyond_mocap.motion.throws import throw
from beyond_mocap.synthesis.phase_network import phase_function
from beyond_mocap.synthesis.phase_network.example import example_of
from beyond_mocap.synthesis.phase_network.model import ModelSettings
from beyond_mocap.synthesis.phase_network.training_set import training_set
from training.networks import linear_start, scales_of, sums


@pytest.mark.parametrize("points", [1, 4])
def test_a_linear_map_is_a_network(points):
    made = throw((10.0, 1.0, 1.0), 20.0, fps=120.0)
    example = example_of("one", "ann", made.motion, "right_hand", made.release, (10.0, 1.0, 1.0))
    settings = ModelSettings(points=points)
    inputs, answers, phases = training_set([example], settings)["left_leg"]
    (mean_x, scale_x), (mean_y, scale_y) = scales_of(inputs), scales_of(answers)
    theta = phase_function.weights(phases, points)
    told = sums((inputs - mean_x) / scale_x, (answers - mean_y) / scale_y, theta)
    map_ = linear_start(told, RIDGE["plain" if points == 1 else "phased"])
    every = np.einsum("koi,ni->nko", map_.weights, (inputs - mean_x) / scale_x) + map_.biases
    wanted = np.einsum("nk,nko->no", theta, every) * scale_y + mean_y
    assert linear_model([example], settings).networks["left_leg"].predict(inputs, phases) == pytest.approx(
        wanted, abs=1e-4
    )
    assert np.abs(wanted - answers).mean() < 0.05
