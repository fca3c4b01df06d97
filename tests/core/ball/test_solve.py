"""The ball solved from planted feeds: passes between players who stand, with noise, gaps and rates of several kinds."""

import numpy as np
import pytest

from beyond_mocap.ball.tracked.solve import solve_samples
from beyond_mocap.base.errors import InputError
from beyond_mocap.synthetic.ground_truth.synthetic_match import build_match, sample_feed

PLACES = np.array([[0.0, 0.0], [14.0, 3.0], [20.0, -9.0], [4.0, -12.0], [-9.0, -3.0]])
NAMES = [f"home_{number}" for number in range(len(PLACES))]
TOUCHED = 1.3  # s between a pass's end and the next kick


def planted(rate=25.0, noise=0.0, seed=0, speed=13.0, rounds=2):
    """(times, ball, positions, touches): passes along PLACES; every player stops the ball at his foot, then passes."""
    random = np.random.default_rng(seed)
    knots, touches, time = [(0.0, PLACES[0] + [0.3, 0.0])], [], TOUCHED
    for leg in range(rounds * len(PLACES)):
        giver, taker = leg % len(PLACES), (leg + 1) % len(PLACES)
        knots.append((time, PLACES[giver] + [0.35, 0.0]))
        touches.append((time, NAMES[giver]))
        time += np.linalg.norm(PLACES[taker] - PLACES[giver]) / speed + 0.013
        knots.append((time, PLACES[taker] + [0.3, 0.0]))
        touches.append((time, NAMES[taker]))
        time += TOUCHED
    times = np.arange(0.0, time, 1.0 / rate)
    when, where = np.array([k[0] for k in knots]), np.array([k[1] for k in knots])
    ball = np.stack([np.interp(times, when, where[:, axis]) for axis in range(2)], axis=1)
    ball = ball + random.normal(0.0, noise, ball.shape)
    ball = np.pad(ball, ((0, 0), (0, 1)), constant_values=np.nan)
    positions = np.repeat(PLACES[:, None], len(times), axis=1)
    return times, ball, positions, touches


def share_found(touches, solved, within):
    """Recall and precision of planted touches, right player, within some seconds."""
    def near(time, player):
        return any(abs(t.time - time) <= within and t.player == player for t in solved.touches)

    true = [near(*touch) for touch in touches]
    right = [any(abs(t.time - time) <= within and t.player == who for time, who in touches) for t in solved.touches]
    return np.mean(true), np.mean(right)


@pytest.mark.parametrize("rate, noise", [(25.0, 0.01), (25.0, 0.08), (10.0, 0.03), (50.0, 0.05)])
def test_touches_are_found_with_their_players(rate, noise):
    times, ball, positions, touches = planted(rate, noise)
    solved = solve_samples(times, ball, positions, NAMES)
    recall, precision = share_found(touches, solved, 0.1)
    assert recall >= 0.9
    assert precision >= 0.85


def test_moments_lie_between_samples():
    times, ball, positions, touches = planted(10.0, 0.0)
    solved = solve_samples(times, ball, positions, NAMES)
    found = np.array([touch.time for touch in solved.touches])
    off = [np.abs(found - time).min() for time, _ in touches]
    assert np.median(off) < 0.02  # a fifth of the samples' step


def test_nobody_near_means_nobody():
    times, ball, positions, _ = planted()
    solved = solve_samples(times, ball, positions + 30.0, NAMES)
    assert {touch.player for touch in solved.touches} <= {""}


def test_a_gap_leaves_the_touches_around_it():
    times, ball, positions, touches = planted(noise=0.02)
    gap = (times > 2.6) & (times < 3.1)
    ball = np.where(gap[:, None], np.nan, ball)
    solved = solve_samples(times, ball, positions, NAMES)
    away = [touch for touch in touches if not 2.4 < touch[0] < 3.3]
    assert share_found(away, solved, 0.1)[0] >= 0.85
    assert np.isnan(solved.residuals[gap]).all()


def test_single_wrong_samples_are_left_out():
    times, ball, positions, touches = planted(noise=0.02)
    ball[[20, 90, 170], :2] += [3.0, -2.0]
    solved = solve_samples(times, ball, positions, NAMES)
    assert solved.outlier[[20, 90, 170]].all()
    assert np.count_nonzero(solved.outlier) < 6
    assert share_found(touches, solved, 0.1)[0] >= 0.9


def test_the_path_goes_through_the_touches_and_near_the_samples():
    times, ball, positions, _ = planted(noise=0.04)
    solved = solve_samples(times, ball, positions, NAMES)
    at = solved.ball.at(np.array([touch.time for touch in solved.touches]))
    places = np.array([touch.position for touch in solved.touches])
    assert np.linalg.norm(at - places, axis=1).max() < 1e-6
    assert np.nanpercentile(solved.residuals, 95) < 0.12


def test_filled_samples_are_told():
    times, ball, positions, _ = planted()
    random = np.random.default_rng(1)
    noisy = (times > 6.0)[:, None] * random.normal(0.0, 0.06, (len(times), 2))
    ball[:, :2] = np.round(ball[:, :2] + noisy, 2)
    solved = solve_samples(times, ball, positions, NAMES)
    assert solved.filled[(times > 1.4) & (times < 2.2)].all()
    assert not solved.filled[times > 6.2].any()


def test_too_few_samples_are_refused():
    with pytest.raises(InputError, match="samples of the ball"):
        solve_samples(np.arange(9.0), np.full((9, 3), np.nan), np.zeros((1, 9, 2)), ["home_1"])


def test_samples_too_far_apart_are_refused():
    times = np.arange(20) * 2.0
    ball = np.column_stack([times, 0.0 * times, 0.0 * times])
    with pytest.raises(InputError, match="1.5 s apart"):
        solve_samples(times, ball, np.zeros((1, 20, 2)), ["home_1"])


def test_over_a_long_gap_the_path_goes_straight():
    times, ball, positions, _ = planted(noise=0.02)
    start, end = 1.6, 9.0  # the ball flies when the feed loses it
    ball = np.where(((times > start) & (times < end))[:, None], np.nan, ball)
    path = solve_samples(times, ball, positions, NAMES).ball
    inside = np.linspace(start + 0.1, end - 0.1, 40)
    places = path.at(inside)
    assert np.linalg.norm(path.velocity(np.array([start - 0.1]))) > 8.0
    assert np.abs(places - np.linspace(places[0], places[-1], 40)).max() < 1e-6
    assert np.allclose(path.velocity(inside), (places[-1] - places[0]) / (inside[-1] - inside[0]))


def test_samples_told_twice_leave_the_players_where_they_are():
    times, ball, positions, touches = planted(noise=0.02, rounds=1)
    away = times[:, None] * [2.0, 0.0]  # everybody walks, and the ball with them
    ball, positions = ball + np.pad(away, ((0, 0), (0, 1))), positions + away
    twice = np.sort(np.concatenate([np.arange(len(times)), np.arange(50)]))
    plain = solve_samples(times, ball, positions, NAMES)
    again = solve_samples(times[twice], ball[twice], positions[:, twice], NAMES)
    assert share_found(touches, plain, 0.1)[0] >= 0.8
    assert [(t.time, t.player) for t in again.touches] == [(t.time, t.player) for t in plain.touches]


@pytest.mark.parametrize("fps, heights", [(25.0, True), (10.0, False)])
def test_a_made_match_is_solved(fps, heights):
    match = build_match(45.0, 4)
    feed = sample_feed(match, fps=fps, heights=heights)
    solved = solve_samples(feed.times, feed.ball, feed.positions, feed.ids, feed.teams, (feed.length, feed.width))
    touches = [(touch.time, touch.player) for touch in match.touches if 1.0 < touch.time < 44.0]
    recall, precision = share_found(touches, solved, 0.1)
    assert 2.0 * recall * precision / (recall + precision) >= 0.85
