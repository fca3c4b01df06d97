"""Where a free ball meets a wall, or the ground before it."""

import numpy as np

from beyond_mocap.ball.flight import find_wall_impact
from beyond_mocap.ball.physics import BASEBALL, FOOTBALL, Ball

FREE = Ball("free", 0.05, 0.2, 9.81)


def test_a_ball_without_air_meets_it_where_a_parabola_does():
    place, seconds = find_wall_impact(
        np.array([0.0, 0, 1.5]), np.array([20.0, 2.0, 3.0]), FREE, np.array([10.0, 0.0]), [1.0, 0]
    )
    assert abs(seconds - 0.5) < 1e-6
    assert np.allclose(place, [10.0, 1.0, 1.5 + 1.5 - 0.5 * 9.81 * 0.25], atol=1e-6)


def test_a_slanting_wall_and_air():
    ahead = np.array([1.0, 1.0])
    place, seconds = find_wall_impact(
        np.array([0.0, 0, 2.0]), np.array([15.0, 12.0, 1.0]), BASEBALL, np.array([6.0, 0.0]), ahead
    )
    assert abs((place[:2] - [6.0, 0.0]) @ ahead) < 1e-4
    assert seconds > 6.0 / 27.0


def test_the_ground_comes_first():
    place, _ = find_wall_impact(np.array([0.0, 0, 1.5]), np.array([10.0, 0, 0.0]), BASEBALL, np.array([40.0, 0.0]),
                                [1.0, 0])
    assert abs(place[2] - BASEBALL.radius) < 1e-6 and 4.0 < place[0] < 6.0


def test_a_ball_that_rolls_goes_on_to_the_wall():
    place, _ = find_wall_impact(np.array([0.0, 0, 0.11]), np.array([15.0, 0, 0.0]), FOOTBALL, np.array([11.0, 0.0]),
                                [1.0, 0])
    assert abs(place[0] - 11.0) < 1e-4 and abs(place[2] - 0.11) < 1e-3
