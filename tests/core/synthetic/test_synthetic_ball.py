"""The made match is one that could be played, its feed hides just what it says, and the solver finds it again."""

import numpy as np
import pytest

from benchmarks.ball_touches import AnnotatedTouch, TouchAnnotation, score_touches
from beyond_mocap.ball.tracked.solve import solve_samples
from beyond_mocap.synthetic.ground_truth.synthetic_match import build_match, sample_feed

TIMES = np.arange(0.0, 60.0, 0.02)


@pytest.fixture(scope="module")
def match():
    return build_match(60.0, seed=3)


def test_players_meet_the_ball_at_every_touch_and_run_as_men_do(match):
    for touch in match.touches:
        place = match.players_at(np.array([touch.time]))[match.ids.index(touch.player), 0]
        assert np.linalg.norm(place - touch.position[:2]) < 0.65, touch
    speed = np.linalg.norm(np.diff(match.players_at(TIMES), axis=1), axis=2) / 0.02
    assert speed.max() < 10.0


def test_the_ball_goes_on_from_touch_to_touch(match):
    for touch, after in zip(match.touches, match.touches[1:]):
        assert after.time > touch.time + 0.3
        if after.label != "throw-in":
            here = match.ball_at(np.array([after.time - 1e-6]))[0]
            np.testing.assert_allclose(here, after.position, atol=1e-3)
        assert np.linalg.norm(touch.after - touch.before) > 0.3
    assert match.ball_at(TIMES)[:, 2].min() >= match.ball.radius - 1e-6


def test_all_parts_and_both_teams_come_and_the_same_seed_plays_the_same(match):
    assert {touch.part for touch in match.touches} >= {"foot", "head"}
    assert {touch.player.split("_")[0] for touch in match.touches} == {"home", "away"}
    again = build_match(20.0, seed=3)
    for touch, other in zip(match.touches, again.touches):
        assert (touch.time, touch.player) == (other.time, other.player)


def test_the_feed_scatters_by_its_noise(match):
    feed = sample_feed(match, noise=0.08, snaps=0.0)
    off = feed.ball[:, :2] - match.ball_at(feed.times)[:, :2]
    assert off.std() == pytest.approx(0.08, rel=0.15)
    assert not feed.filled.any() and not feed.wrong.any()
    assert len(feed.times) == 1500


def test_ten_hertz_without_heights(match):
    feed = sample_feed(match, fps=10.0, heights=False)
    assert len(feed.times) == 600
    assert np.isnan(feed.ball[:, 2]).all() and np.isfinite(feed.ball[:, :2]).all()


def test_filled_stretches_are_straight_between_their_corners(match):
    feed = sample_feed(match, filled=0.5)
    assert 0.5 <= feed.filled.mean() < 0.65
    bend = np.linalg.norm(np.diff(feed.ball[:, :2], 2, axis=0), axis=1)
    inside = feed.filled[:-2] & feed.filled[2:]
    assert (bend[inside] < 0.03).mean() > 0.85
    assert (bend[~inside] < 0.03).mean() < 0.4


@pytest.mark.parametrize("how", [{"filled": 0.3}, {"fps": 10.0, "heights": False}])
def test_the_solver_finds_who_touched_it_when(match, how):
    feed = sample_feed(match, **how)
    solved = solve_samples(feed.times, feed.ball, feed.positions, feed.ids, feed.teams, (feed.length, feed.width))
    read = tuple(AnnotatedTouch(touch.time, (touch.player,)) for touch in match.touches if 1.2 < touch.time < 59.0)
    reading = TouchAnnotation(((1.2, 59.0),), read, (AnnotatedTouch(1.0),))
    score = score_touches([touch.time for touch in solved.touches], [touch.player for touch in solved.touches], reading)
    assert score.f1 >= 0.8, (score.missed, score.false)
    assert np.median(np.abs(score.errors)) < 0.03
