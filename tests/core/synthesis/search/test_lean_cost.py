"""What a piece costs that leans otherwise than its track is accelerated."""

import numpy as np

from beyond_mocap.synthesis.search.lean_cost import FREE_LEAN, compute_lean_cost


def test_lean_costs_by_how_far_it_is_from_the_wanted_one_in_any_direction():
    wanted = np.array([0.1, -0.2])
    away = np.array([[0.3, 0.0], [0.0, 0.3], [-0.18, 0.24], [0.0, 0.0], [0.03, 0.04]])
    cost = compute_lean_cost((wanted + away).astype(np.float32), wanted)
    assert np.allclose(cost, [0.3 - FREE_LEAN] * 3 + [0.0, 0.0], atol=1e-6)
    assert cost.dtype == np.float32
