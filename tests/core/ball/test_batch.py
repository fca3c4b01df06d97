"""Many flights at once against one after the other."""

import numpy as np
import pytest

from beyond_mocap.ball import batch
from beyond_mocap.ball.flight import Launch, simulate_flight
from beyond_mocap.ball.physics import BALLS, FOOTBALL, PAPER


def launches(count, seed=0, spin=30.0):
    rng = np.random.default_rng(seed)
    return (rng.uniform([-5, -5, 0.1], [5, 5, 2], (count, 3)), rng.uniform([-20, -20, -5], [20, 20, 12], (count, 3)),
            rng.normal(0.0, spin, (count, 3)))


@pytest.mark.parametrize("name", sorted(BALLS))
@pytest.mark.parametrize("seconds", [0.3, 1.0, 3.0, 8.0])
def test_each_is_where_it_is_alone(name, seconds):
    ball = BALLS[name]
    position, velocity, spin = launches(8, spin=30.0 if ball.friction else 0.0)
    places, speeds = batch.simulate_states(position, velocity, spin, ball, seconds)
    for i in range(8):
        alone = simulate_flight(Launch(0.0, position[i], velocity[i], spin[i]), ball,
                                seconds + 1.0).states([seconds])[0]
        assert places[i] == pytest.approx(alone[:3], abs=2e-4 if seconds > 3.0 else 1e-4)
        assert speeds[i] == pytest.approx(alone[3:6], abs=1e-3)


def test_each_has_its_own_time():
    position, velocity, spin = launches(5)
    seconds = np.linspace(0.0, 2.0, 5)
    together = batch.simulate_states(position, velocity, spin, FOOTBALL, seconds)[0]
    alone = [batch.simulate_states(position[i], velocity[i], spin[i], FOOTBALL, seconds[i])[0][0] for i in range(5)]
    assert together == pytest.approx(np.array(alone), abs=1e-5)
    assert together[0] == pytest.approx(position[0])


def test_courses_pass_through_the_states():
    position, velocity, spin = launches(5)
    times = np.array([0.0, 0.13, 0.9, 2.2])
    places, speeds = batch.simulate_trajectories(position, velocity, spin, FOOTBALL, times)
    assert places.shape == speeds.shape == (5, 4, 3)
    for i, seconds in enumerate(times):
        assert places[:, i] == pytest.approx(batch.simulate_states(position, velocity, spin, FOOTBALL, seconds)[0],
                                             abs=1e-4)


def test_bounces_are_counted_and_can_be_limited():
    balls = batch.build_balls((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), None, PAPER)
    assert batch.simulate_balls(balls, PAPER, 1.5).bounces == [3]
    limited = batch.simulate_balls(balls, PAPER, 3.0, most_bounces=1)
    assert limited.bounces == [1] and limited.position[0, 2] < 0.0


def test_what_is_given_stays_as_it_is():
    position, velocity, spin = launches(3)
    kept = position.copy(), velocity.copy(), spin.copy()
    balls = batch.build_balls(position, velocity, spin, FOOTBALL)
    batch.simulate_balls(balls, FOOTBALL, 1.0)
    assert all(np.array_equal(one, other) for one, other in zip(kept, (position, velocity, spin)))
    assert np.array_equal(balls.velocity, velocity)


def test_the_ground_may_lie_anywhere():
    position, velocity, spin = launches(4)
    low = batch.simulate_states(position, velocity, spin, FOOTBALL, 2.0)[0]
    high = batch.simulate_states(position + [0, 0, 3.0], velocity, spin, FOOTBALL, 2.0, ground=3.0)[0]
    assert high - [0, 0, 3.0] == pytest.approx(low, abs=1e-6)
