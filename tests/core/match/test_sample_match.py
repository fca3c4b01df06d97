"""The sample's small match: it is what its script makes, could be played, and reads as it was planted."""

import pathlib
import sys

import numpy as np
import pytest

from beyond_mocap.ball.tracked.solve import solve_ball
from beyond_mocap.files.freeze_frames import read_freeze_frames
from beyond_mocap.files.joints.joint_readers import read_joints
from beyond_mocap.files.tracking.tracking import read_match
from beyond_mocap.match.joint_clock import align_joints

SAMPLE = pathlib.Path(__file__).parents[3] / "sample_blend"


@pytest.fixture(scope="module")
def small():
    sys.path.insert(0, str(SAMPLE))
    import make_match

    yield make_match
    sys.path.remove(str(SAMPLE))


def test_joints_and_moments_are_what_their_script_makes(small, tmp_path):
    import make_joints

    make_joints.write_files(tmp_path)
    made = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    assert len(made) == 3
    for path in made:
        assert path.read_bytes() == (SAMPLE / "match" / path.relative_to(tmp_path)).read_bytes(), path.name


def test_joints_are_where_the_dots_are(small, tmp_path):
    """Both on one clock; the freeze frames have the people of their moments."""
    match = read_match(SAMPLE / "match" / "small" / "small.dat", cache_dir=tmp_path)
    feed = align_joints(read_joints(path := SAMPLE / "match" / "small" / "small_joints.csv"), match, path)
    assert [person.id for person in feed.people] == ["home_10", "away_9"] and not feed.notes
    for person in feed.people:
        track = match.track(person.id, 2.0, 8.0)
        hips = person.positions[:, [person.landmarks.index(f"{side}_hip") for side in ("left", "right")], :2]
        assert np.linalg.norm(hips.mean(axis=1) - track.positions, axis=1).max() < 0.4
    frames = read_freeze_frames(*(SAMPLE / "match" / "moment" / name for name in ("360.json", "events.json")))
    assert [(one.clock, one.player, one.labels[:2], len(one.roles)) for one in frames] == [
        ("00:01", "Dan Striker", ("kick", "right"), 8), ("00:08", "Cora Wing", ("kick", "right"), 8),
        ("00:10", "Dan Striker", ("header", "standing"), 7)]


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
