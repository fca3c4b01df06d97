"""Who is in step with whom, and lags that keep neighbours out of step."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.library.build import build_library
from beyond_mocap.match.crowd.variety import LAG_STEP, choose_lags, find_in_step, measure_share_in_step
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.preferences import PERIOD, PREFERRED_RANGE, build_lag_preference
from beyond_mocap.synthesis.search.request import build_request
from beyond_mocap.synthesis.synthesize import synthesize


def test_in_step_needs_the_same_clip_place_and_neighbourhood():
    shown = np.array([[0, 0, 0, 0, 1, -1], [0, 0, 0, 0, 2, -1]])
    seconds = np.array([[1.0, 1.1, 1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.4, 1.0, 1.0, 0.0]])
    positions = np.zeros((2, 6, 2))
    positions[1, 3] = [30.0, 0.0]
    assert find_in_step(shown, seconds, positions).tolist() == [[True, True, False, False, False, False]] * 2
    assert measure_share_in_step(shown, seconds, positions) == pytest.approx(0.4)
    assert measure_share_in_step(shown - 3, seconds, positions) == 0.0


def test_neighbours_are_given_other_lags():
    count = round(PERIOD / LAG_STEP)
    together = np.random.default_rng(0).uniform(0.0, 5.0, (count, 30, 2))
    found = choose_lags(np.concatenate([together, together + 500.0]))
    assert len(set(found[:count])) == count and len(set(found[count:])) == count
    assert np.all((found >= 0.0) & (found < PERIOD))


def test_taste_likes_one_lag_against_the_clock(library):
    own = build_lag_preference(library, 0.9, 0.5, start=10.0)
    first = library.frames.first[0]
    ages = np.arange(library.frames.count[0])
    for at in (0, 45):
        lag = (ages - at) / library.fps - 10.0 - 0.9
        away = np.abs(lag / PERIOD - np.round(lag / PERIOD)) * PERIOD
        cost = own.compute_cost(at, own.place[first + ages])
        assert np.all(cost[away < PREFERRED_RANGE - 0.02] == 0.0) and cost.max() == np.float32(0.5)
    assert build_lag_preference(library, 0.9, 0.0, 10.0) is None


def walker(lag, variety=0.6):
    times = np.arange(0, 8.01, 0.04)
    return Plan(track=Track(times, np.column_stack([1.4 * times, 0.0 * times])), variety=variety, lag=lag, made=False)


def share_of(takes, frames=slice(None)):
    """Share in step of takes made from clips at 30 frames per second, all at one place."""
    names = sorted({name for take in takes for name in take.clips})
    shown = np.array([[2 * names.index(t.clips[c]) + m for c, m in zip(t.clip, t.mirrored)] for t in takes])[:, frames]
    seconds = np.array([take.clip_frame for take in takes])[:, frames] / 30.0
    return measure_share_in_step(shown, seconds, np.zeros((*shown.shape, 2)))


def test_two_who_walk_alike_are_out_of_step(library):
    takes = [synthesize(library, walker(lag)) for lag in (0.0, 1.5)]
    assert share_of([synthesize(library, walker(0.0, 0.0))] * 2) == 1.0 and share_of(takes) < 0.1


def test_a_dozen_who_begin_to_run_at_once_from_short_clips_are_out_of_step(tmp_path, clip_file):
    """Each clip of 1.2 s has room for a third of the lags only; together they have room for all."""
    clip_file(tmp_path / "walk.bvh", 1.4, 5.0, "walking")
    for number in range(6):
        clip_file(tmp_path / f"run{number}.bvh", 4.0, 1.2, "running", seed=number, phase=number / 6.0)
    library = build_library(tmp_path)
    times = np.arange(0, 6.01, 0.04)
    speed = np.where((times > 2.0) & (times < 4.0), 4.0, 1.4)
    way = np.cumsum(np.append(0.0, speed[:-1] * 0.04))
    track = Track(times, np.column_stack([way, 0.0 * way]))
    plans = [Plan(track=track, variety=2.4, lag=lag, made=False) for lag in np.arange(12) * LAG_STEP]
    assert share_of([synthesize(library, plan) for plan in plans], slice(54, 126)) < 0.12


def test_no_variety_is_no_taste(library):
    assert build_request(library, resolve_plan(walker(1.0, 0.0), library)).lag_preference is None
    with pytest.raises(InputError, match="variety"):
        walker(0.0, -1.0)
