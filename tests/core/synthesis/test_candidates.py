"""The cheapest of the pairs that are nearest in speed."""

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


@pytest.mark.parametrize("speed", [-1.0, 0.0, 1.3, 9.0])
def test_they_are_the_cheapest(speed):
    speeds = np.sort(np.random.default_rng(2).uniform(0.0, 6.0, 40000))
    cost_of, every, _ = costs_of(np.abs(speeds - speed))
    number, cost = find_cheapest(cost_of, speeds, speed, 1.0, considered=len(speeds), count=300)
    assert set(number) == set(np.argsort(every)[:300]) and np.all(np.diff(number) > 0)
    np.testing.assert_array_equal(cost, every[number])


def test_only_the_nearest_in_speed_are_looked_at():
    speeds = np.linspace(0.0, 6.0, 5000)
    cost_of, _, weighed = costs_of(np.zeros(5000))
    number, _ = find_cheapest(cost_of, speeds, 3.0, 0.0, considered=1000, count=200)
    assert len(number) == 200 and np.all(np.abs(speeds[number] - 3.0) < 0.61) and weighed == [1000]


@pytest.mark.parametrize("most", [0.0, 0.05, 0.4, 3.0])
def test_none_costs_more_than_the_most(most):
    speeds = np.sort(np.random.default_rng(2).uniform(0.0, 6.0, 40000))
    cost_of, every, weighed = costs_of(np.abs(speeds - 2.0))
    number, _ = find_cheapest(cost_of, speeds, 2.0, 1.0, considered=len(speeds), count=300, most=most)
    rank = np.argsort(every)[:300]
    assert set(number) == set(rank[every[rank] <= most])
    assert most > 0.1 or sum(weighed) < 3500, "what misses the speed by more than that is not weighed"


@pytest.mark.parametrize("most", [0.05, 0.4, 3.0])
def test_the_square_of_the_missed_speed_leaves_out_more(most):
    speeds = np.sort(np.random.default_rng(2).uniform(0.0, 6.0, 40000))
    missed = np.abs(speeds - 2.0)
    cost_of, every, weighed = costs_of(np.maximum(missed - 0.17, 0.0) + 2.0 * missed**2)
    plain, _ = find_cheapest(cost_of, speeds, 2.0, 1.0, considered=len(speeds), count=300, most=most)
    number, cost = find_cheapest(cost_of, speeds, 2.0, 1.0, considered=len(speeds), count=300, most=most,
                                 square_weight=2.0)
    assert number.tolist() == plain.tolist() and cost.tolist() == every[number].tolist()
    assert weighed[1] < 0.85 * weighed[0]
