"""The cheapest way to each frame, weighed no further than it can matter: the same as weighing every pair."""

import numpy as np
import pytest

from beyond_mocap.synthesis.search.beam_transitions import BeamTransitions, SlotCandidates
from beyond_mocap.synthesis.search.path_costs import PathCosts

STATES, FRAMES = 40, 500


@pytest.fixture(scope="module", params=[STATES, 7, 1])
def ways(library, order, request):
    """Ways on from random states that end at so many frames, and random frames that they may come to; some pairs go on
    without a cut.
    """
    costs, random = PathCosts(library, order()), np.random.default_rng(3)
    count, clips = len(library.frames), library.frames.clip
    end = np.sort(np.resize(random.integers(0, count, request.param), STATES)).astype(float)
    start = np.concatenate([random.integers(0, count, FRAMES - 6), end[:6]]).astype(float)
    piece = np.where(np.arange(FRAMES) % 50 == 7, 3, -1)
    rates = random.choice([0.875, 1.0, 1.125], (2, FRAMES))
    offered = SlotCandidates(clips[start.astype(int)], start, rates[0], random.uniform(0.0, 1.0, FRAMES), piece)
    recent = random.integers(-1, int(costs.index.bucket[-1]) + 1, (STATES, 15))
    cost = 1000.0 + random.uniform(0.0, 0.5, STATES)
    return BeamTransitions(costs, clips[end.astype(int)], end, rates[1, :STATES], cost, recent,
                           random.uniform(0.0, 0.5, STATES)), offered


def test_every_way_costs_its_cut_and_what_follows(ways):
    found, offered = ways
    every = found.compute_all(offered)
    costs, start = found.costs, offered.start.astype(int)
    cut = sum(values for _, values in costs.cuts.iter_cut_terms(found.end, start))
    # a stand may be shown again nearly for nothing
    shown = found.seen_buckets[:, costs.index.bucket[start]]
    replay = costs.weights.replay * shown * np.maximum(costs.index.lifted[start], 0.1)
    cut = np.where((found.end[:, None] == start) & (found.clip[:, None] == offered.clip), 0.0,
                   cut + replay + found.young[:, None])
    rate = costs.weights.rate_change * np.abs(found.rate[:, None] - offered.rate)
    whole = found.base + found.above[:, None] + cut + rate + offered.cost
    assert np.count_nonzero(cut == 0.0) >= 6
    np.testing.assert_allclose(every, whole, atol=1e-4)


@pytest.mark.parametrize("known", [(), (1000.1, 1000.2, np.inf)])
@pytest.mark.parametrize("most", [1, 20, FRAMES])
def test_those_that_may_be_kept_come_by_their_cheapest_way(ways, known, most):
    found, offered = ways
    every = found.compute_all(offered)
    which, cost, state = found.find_cheapest(offered, np.array(known), most)
    np.testing.assert_allclose(cost, every.min(axis=0)[which], rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(cost, every[state, which], rtol=0.0, atol=1e-4)
    free = np.flatnonzero(offered.piece < 0)
    rank = np.argsort(np.concatenate([every.min(axis=0)[free], known]), kind="stable")[:most]
    assert set(free[rank[rank < len(free)]]) <= set(which), "what the beam keeps is among them"
    assert set(np.flatnonzero(offered.piece >= 0)) <= set(which), "so are all key moments"
    assert most == FRAMES or len(which) < 3 * most + 20


def test_what_costs_more_than_the_bound_is_not_kept_after_a_cut(ways):
    found, offered = ways
    known = np.array([1000.6, 1000.9, 1003.0])
    cut = np.abs(found.end[:, None] - offered.start) >= 1.0
    whole = np.where(cut, found.compute_all(offered), np.inf).min(axis=0)
    above = offered.cost > found.bound_own_cost(known, 2)
    assert 0 < np.count_nonzero(above) and np.all(whole[above] > known[1])
    assert found.bound_own_cost(known, 4) == np.inf


def test_nothing_offered_is_nothing_found(ways):
    found, offered = ways
    none = SlotCandidates(*(values[:0] for values in vars(offered).values()))
    assert [len(part) for part in found.find_cheapest(none, np.zeros(0), 5)] == [0, 0, 0]
