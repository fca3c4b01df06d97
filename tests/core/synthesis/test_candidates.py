"""The cheapest pairs without weighing them all."""

import numpy as np
import pytest

from beyond_mocap.synthesis.search.path_costs import find_cheapest


def costs_of(missed, seed=1):
    """Costs of pairs that miss a speed by so much, each at least that much; counts what is weighed."""
    more = np.random.default_rng(seed).exponential(0.3, len(missed))
    weighed = []

    def cost_of(part):
        weighed.append(len(missed[part]))
        return missed[part] + more[part]

    return cost_of, missed + more, weighed


def bound_nothing(part):
    return np.zeros(part.stop - part.start)


@pytest.mark.parametrize("speed", [-1.0, 0.0, 1.3, 9.0])
def test_they_are_the_cheapest_and_few_are_weighed(speed):
    speeds = np.sort(np.random.default_rng(2).uniform(0.0, 6.0, 40000))
    cost_of, every, weighed = costs_of(np.abs(speeds - speed))
    missed = np.abs(speeds - speed)
    number, cost = find_cheapest(cost_of, lambda part: missed[part], speeds, speed, 1.0, len(speeds), 300)
    assert set(number) == set(np.argsort(every)[:300]) and np.all(np.diff(number) > 0)
    np.testing.assert_array_equal(cost, every[number])
    assert sum(weighed) < 0.3 * len(speeds)


def test_only_the_nearest_in_speed_are_looked_at():
    speeds = np.linspace(0.0, 6.0, 5000)
    number, _ = find_cheapest(costs_of(np.zeros(5000))[0], bound_nothing, speeds, 3.0, 0.0, 1000, 200)
    assert len(number) == 200 and np.all(np.abs(speeds[number] - 3.0) < 0.61)


def test_bounds_that_deceive_cost_time_only():
    """Pairs with the lowest bounds cost the most."""
    speeds = np.linspace(2.0, 2.001, 40000)
    bound = np.linspace(0.0, 1.0, 40000)
    every = np.where(bound < 0.5, 3.0, 1.0) + bound
    number, cost = find_cheapest(lambda part: every[part], lambda part: bound[part], speeds, 2.0, 1.0, 40000, 6000)
    assert len(set(number)) == 6000 and np.array_equal(np.sort(cost), np.sort(every)[:6000])


@pytest.mark.parametrize("most", [0.0, 0.05, 0.4, 3.0])
def test_none_costs_more_than_the_most(most):
    speeds = np.sort(np.random.default_rng(2).uniform(0.0, 6.0, 40000))
    missed = np.abs(speeds - 2.0)
    cost_of, every, weighed = costs_of(missed)
    number, _ = find_cheapest(cost_of, lambda part: missed[part], speeds, 2.0, 1.0, len(speeds), 300, most)
    rank = np.argsort(every)[:300]
    assert set(number) == set(rank[every[rank] <= most])
    assert most > 0.1 or sum(weighed) < 1500
