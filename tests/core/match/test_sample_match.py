"""The sample's small match: it is what its script makes, could be played, and reads as it was planted."""

import pathlib
import sys

import numpy as np
import pytest

from beyond_mocap.ball.tracked.solve import solve_ball
from beyond_mocap.files.tracking.tracking import read_match

SAMPLE = pathlib.Path(__file__).parents[3] / "sample_blend"


@pytest.fixture(scope="module")
def small():
    sys.path.insert(0, str(SAMPLE))
    import make_match

    yield make_match
    sys.path.remove(str(SAMPLE))


def test_the_small_match_is_what_its_script_makes(small, tmp_path):
    small.write_match_files(tmp_path)
    made = sorted(tmp_path.iterdir())
    assert len(made) == 6
    for path in made:
        assert path.read_bytes() == (SAMPLE / "match" / "small" / path.name).read_bytes(), path.name


def test_the_small_match_could_be_played(small):
    times = np.arange(0.0, small.SECONDS, 0.02)
    for player in small.PLAYERS:
        path = small.compute_player(player, times)
        there = np.isfinite(path[:, 0])
        velocity = np.gradient(path[there], times[there], axis=0)
        assert np.linalg.norm(velocity, axis=1).max() < 7.5, player
        assert np.linalg.norm(np.gradient(velocity, times[there], axis=0), axis=1).max() < 6.0, player
    for one in small.compute_touches():
        away = one.position[:2] - small.compute_player(one.touch.player, np.array([one.time]))[0]
        assert 0.15 < np.linalg.norm(away) < 0.45, one.time


@pytest.mark.parametrize("name", ["small_Home.csv", "small.dat"])
def test_every_touch_of_the_small_match_is_found(small, tmp_path, name):
    match = read_match(SAMPLE / "match" / "small" / name, cache_dir=tmp_path)
    found = solve_ball(match).touches
    planted = small.compute_touches()
    assert [touch.player for touch in found] == [one.touch.player for one in planted]
    assert max(abs(touch.time - one.time) for touch, one in zip(found, planted)) < 0.05
