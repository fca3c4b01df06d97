"""Launches that reach one target, from the slowest on."""

import numpy as np

from beyond_mocap.ball.physics import THROWN_BALLS, Ball
from beyond_mocap.ball.shot import is_out_of_reach, solve_arcs


def test_without_air_the_slowest_launch_is_the_known_one():
    ball = Ball("stone", 0.04, 0.1)
    found = solve_arcs(np.array([0.0, 0.0, 1.5]), np.array([50.0, 0.0, 1.5]), ball)
    assert abs(found.slowest - np.sqrt(50.0 * ball.gravity)) < 0.02 * found.slowest


def test_far_targets_are_not_looked_for_up_in_the_sky():
    found = solve_arcs(np.array([0.0, 0.0, 1.5]), np.array([160.0, 0.0, 1.0]), THROWN_BALLS["baseball"])
    assert len(found.speeds) >= 10 and np.all(np.diff(found.speeds) > 0.0)


def test_a_target_is_out_of_reach_just_below_the_slowest_launch():
    ball, start = THROWN_BALLS["baseball"], np.array([0.0, 0.0, 1.5])
    for target in ((80.0, 0.0, 1.0), (30.0, 40.0, 6.0)):
        slowest = solve_arcs(start, np.array(target), ball).slowest
        assert is_out_of_reach(start, np.array(target), ball, 0.93 * slowest)
        assert not is_out_of_reach(start, np.array(target), ball, slowest)
