"""Who is in step with whom, and lags that keep neighbours out of step."""

import numpy as np
import pytest

from beyond_mocap.errors import InputError
from beyond_mocap.match.variety import APART, in_step, lags, share_in_step
from beyond_mocap.motion.track import Track
from beyond_mocap.plan import Plan
from beyond_mocap.synthesis.variety import LIKED, PERIOD, taste
from beyond_mocap.synthesis.wanted import wanted
from beyond_mocap.synthesize import synthesize


def test_in_step_needs_the_same_clip_place_and_neighbourhood():
    shown = np.array([[0, 0, 0, 0, 1, -1], [0, 0, 0, 0, 2, -1]])
    seconds = np.array([[1.0, 1.1, 1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.4, 1.0, 1.0, 0.0]])
    positions = np.zeros((2, 6, 2))
    positions[1, 3] = [30.0, 0.0]
    assert in_step(shown, seconds, positions).tolist() == [[True, True, False, False, False, False]] * 2
    assert share_in_step(shown, seconds, positions) == pytest.approx(0.4)
    assert share_in_step(shown - 3, seconds, positions) == 0.0


def test_neighbours_are_given_other_lags():
    count = round(PERIOD / APART)
    together = np.random.default_rng(0).uniform(0.0, 5.0, (count, 30, 2))
    found = lags(np.concatenate([together, together + 500.0]))
    assert len(set(found[:count])) == count and len(set(found[count:])) == count
    assert np.all((found >= 0.0) & (found < PERIOD))


def test_taste_likes_one_lag_against_the_clock(library):
    own = taste(library, 0.9, 0.5, start=10.0)
    first = library.frames.first[0]
    ages = np.arange(library.frames.count[0])
    for at in (0, 45):
        lag = (ages - at) / library.fps - 10.0 - 0.9
        away = np.abs(lag / PERIOD - np.round(lag / PERIOD)) * PERIOD
        cost = own.cost(at, first + ages)
        assert np.all(cost[away < LIKED - 0.02] == 0.0) and cost.max() == np.float32(0.5)
    assert taste(library, 0.9, 0.0, 10.0) is None


def walker(lag, variety=0.6):
    times = np.arange(0, 8.01, 0.04)
    return Plan(track=Track(times, np.column_stack([1.4 * times, 0.0 * times])), variety=variety, lag=lag, made=False)


def test_two_who_walk_alike_are_out_of_step(library):
    takes = [synthesize(library, walker(lag)) for lag in (0.0, 1.5)]
    same = [synthesize(library, walker(0.0, 0.0))] * 2
    shares = []
    for pair in (same, takes):
        names = sorted({name for take in pair for name in take.clips})
        shown = [[2 * names.index(t.clips[c]) + m for c, m in zip(t.clip, t.mirrored)] for t in pair]
        seconds = [t.clip_frame / 30.0 for t in pair]
        shares.append(share_in_step(np.array(shown), np.array(seconds), np.zeros((2, len(shown[0]), 2))))
    assert shares[0] == 1.0 and shares[1] < 0.1


def test_no_variety_is_no_taste(library):
    assert wanted(library, walker(1.0, 0.0)).taste is None
    with pytest.raises(InputError, match="variety"):
        walker(0.0, -1.0)
