"""A stretch played so that it travels what it should when it should."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.synthesis.search.distance import distribute_error, warp_time

WAYS = st.lists(st.floats(0.0, 0.4), min_size=2, max_size=60).map(
    lambda steps: np.concatenate([[0.0], np.cumsum(steps)])
)


@settings(max_examples=100, deadline=None)
@given(WAYS, WAYS)
def test_the_whole_stretch_is_played_forward(source, target):
    frames = warp_time(source, target)
    assert len(frames) == len(target)
    assert frames[0] == 0.0 and frames[-1] == pytest.approx(len(source) - 1)
    assert np.all(np.diff(frames) >= 0.0)


@settings(max_examples=50, deadline=None)
@given(WAYS)
def test_the_own_way_is_played_as_recorded(way):
    assert np.allclose(warp_time(way, way), np.arange(len(way)), atol=1e-6)


def test_each_frame_has_travelled_its_share():
    source = np.linspace(0.0, 6.0, 61) ** 1.3
    target = 5.0 * (1.0 - np.cos(np.linspace(0.0, np.pi, 90))) / 2.0
    frames = warp_time(source, target)
    travelled = np.interp(frames, np.arange(61), source)
    assert np.allclose(travelled / source[-1], target / target[-1], atol=0.01)


def test_where_nobody_moves_time_passes():
    assert np.allclose(warp_time(np.zeros(31), np.zeros(61)), np.arange(61) / 2.0)
    pause = np.concatenate([np.linspace(0, 2, 21), np.full(20, 2.0), np.linspace(2, 4, 21)])
    assert np.diff(warp_time(pause, pause)).min() > 0.9
    slow = np.linspace(0, len(pause) - 1, 2 * len(pause) - 1)
    assert np.allclose(warp_time(pause, np.interp(slow, np.arange(len(pause)), pause)), slow, atol=0.05)


@pytest.mark.parametrize("source, target", [(1, 5), (5, 1), (1, 1)])
def test_a_single_frame_is_shown(source, target):
    assert warp_time(np.zeros(source), np.arange(float(target))).tolist() == [0.0] * target


@pytest.mark.parametrize("error", [2.0, -1.3, 0.0])
@pytest.mark.parametrize("frames, window", [(200, 60), (60, 60), (30, 60), (2, 60)])
def test_catching_up_regains_all_of_the_error(error, frames, window):
    metres = distribute_error(error, frames, window)
    assert len(metres) == frames and metres[0] == pytest.approx(0.0, abs=1e-12)
    if frames > window:
        assert metres[window] == pytest.approx(error) and np.allclose(metres[window:], error)
    assert np.all(np.diff(metres) * np.sign(error) >= 0.0)


def test_catching_up_follows_the_logistic():
    """Eq. 28: from 1 % at the window's start to 99 % at its end, half in the middle."""
    metres = distribute_error(1.0, 61, 60)
    assert metres[30] == pytest.approx(0.5)
    printed = 1.0 / (1.0 + np.exp(-4.59512 / 30.0 * (np.arange(61) - 30.0)))
    assert printed[0] == pytest.approx(0.01, abs=1e-4) and np.abs(metres - printed).max() < 0.0101
    assert np.allclose(metres + metres[::-1], 1.0)


@pytest.mark.parametrize("frames", [1, 0])
def test_nothing_to_catch_up_in(frames):
    assert len(distribute_error(1.0, frames, 60)) == frames and np.all(distribute_error(1.0, frames, 60) == 0.0)
