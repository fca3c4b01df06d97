"""Launches that arrive: judged by `fly`, which the solver does not use."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.ball.aim import _compute_step, solve_launches
from beyond_mocap.ball.aim_problem import build_reach_error
from beyond_mocap.ball.flight import Launch, simulate_flight
from beyond_mocap.ball.ground_launch import solve_ground_launches
from beyond_mocap.ball.physics import BALLS, FOOTBALL, HUMAN_BALL_SPEEDS, PAPER, TENNIS, vector_length
from beyond_mocap.base.errors import InputError


def aims(count, seed=0):
    """Starts and targets (B, 3) 4 to 20 m apart at heights that feet and heads reach, with times (B,) that leave
    room."""
    rng = np.random.default_rng(seed)
    start = rng.uniform([-5, -5, 0.15], [5, 5, 1.2], (count, 3))
    angle, far = rng.uniform(0.0, 6.28, count), rng.uniform(4.0, 20.0, count)
    target = start + np.stack([far * np.cos(angle), far * np.sin(angle), np.zeros(count)], axis=1)
    target[:, 2] = rng.uniform(0.15, 1.0, count)
    return start, target, rng.uniform(1.0, 2.0, count) + far / 30.0


def missed(start, target, aimed, ball, i):
    """Metres by which `fly` says aim i misses, and how often the ball has bounced by then."""
    flight = simulate_flight(Launch(0.0, start[i], aimed.velocity[i], aimed.spin[i]), ball, aimed.seconds[i])
    return np.linalg.norm(flight.at([aimed.seconds[i]])[0] - target[i]), len(flight.bounces)


@pytest.mark.parametrize("name", ["paper", "football", "tennis"])
@pytest.mark.parametrize("bounces", [0, 1, 2])
def test_targets_are_hit_after_the_bounces_asked_for(name, bounces):
    ball = BALLS[name]
    start, target, seconds = aims(12)
    aimed = solve_launches(start, target, ball, seconds + 0.4 * bounces, bounces)
    assert aimed.possible.mean() > 0.9
    for i in np.flatnonzero(aimed.possible):
        miss, made = missed(start, target, aimed, ball, i)
        assert miss < 0.02 and made == bounces


def test_spin_is_aimed_with():
    start, target, seconds = aims(10, 1)
    spin = np.random.default_rng(2).normal(0.0, 25.0, (10, 3))
    aimed = solve_launches(start, target, FOOTBALL, seconds, spin=spin)
    assert aimed.possible.all() and np.array_equal(aimed.spin, spin)
    assert max(missed(start, target, aimed, FOOTBALL, i)[0] for i in range(10)) < 0.02
    assert np.abs(aimed.velocity - solve_launches(start, target, FOOTBALL, seconds).velocity).max() > 0.5


def test_without_drag_and_bounce_it_is_the_textbooks_launch():
    start, target = np.array([0.0, 0.0, 1.0]), np.array([6.0, 8.0, 1.0])
    aimed = solve_launches(start, target, replace(PAPER, linear_drag=0.0), 2.0)
    assert aimed.velocity[0] == pytest.approx([3.0, 4.0, 9.8], abs=1e-6)


def test_a_bounce_comes_late_where_an_early_one_would_do_too():
    aimed = solve_launches((0.0, 0.0, 0.5), (8.0, 0.0, 0.5), PAPER, 2.0, bounces=1)
    assert aimed.velocity[0, 2] > 0.0
    flight = simulate_flight(Launch(0.0, np.array([0.0, 0.0, 0.5]), aimed.velocity[0]), PAPER, 2.0)
    assert flight.bounces[0] > 1.0


def test_a_ball_on_the_ground_has_bounced_before():
    """The launch that is there by its first touch of the ground has bounced at that moment, and does not count."""
    start, target = np.array([[2.945, -1.032, 0.64]]), np.array([[0.11, 2.638, FOOTBALL.radius]])
    seconds = np.array([0.9])
    direct = solve_launches(start, target, FOOTBALL, seconds).velocity
    aimed = solve_launches(start, target, FOOTBALL, seconds, 1, initial_velocity=direct)
    assert aimed.possible.all()
    flight = simulate_flight(Launch(0.0, start[0], aimed.velocity[0]), FOOTBALL, 0.9)
    assert np.linalg.norm(flight.at([0.9])[0] - target[0]) < 0.01
    assert np.sum(flight.bounces < 0.9 - 4e-3) == 1


def test_the_free_time_is_the_slowest_launchs():
    start, target, _ = aims(4, 3)
    for bounces in (0, 1):
        aimed = solve_launches(start, target, FOOTBALL, None, bounces)
        assert aimed.possible.all()
        for share in (0.8, 1.25):
            other = solve_launches(start, target, FOOTBALL, aimed.seconds * share, bounces)
            assert np.all(vector_length(aimed.velocity) < vector_length(other.velocity) + 0.15)


def test_a_given_loft_is_taken():
    aimed = solve_launches((0.0, 0.0, 0.2), (25.0, 0.0, 0.2), FOOTBALL, None, loft=np.radians(35.0))
    assert np.degrees(np.arctan2(aimed.velocity[0, 2], aimed.velocity[0, 0])) == pytest.approx(35.0, abs=3.0)


def test_a_launch_nearby_keeps_its_branch():
    start, seconds = np.array([0.0, 0.0, 0.5]), 2.0
    early = np.array([[5.0, 0.0, -6.0]])
    one = solve_launches(start, (8.0, 0.0, 0.5), PAPER, seconds, bounces=1, initial_velocity=early)
    if one.possible[0]:
        moved = solve_launches(start, (8.1, 0.05, 0.5), PAPER, seconds, bounces=1, initial_velocity=one.velocity)
        assert np.linalg.norm(moved.velocity - one.velocity) < 0.5
    unknown = solve_launches(start, (8.0, 0.0, 0.5), PAPER, seconds, bounces=1,
                             initial_velocity=np.full((1, 3), np.nan))
    assert unknown.possible.all()


@settings(max_examples=25, deadline=None)
@given(st.floats(3.0, 30.0), st.floats(-3.1, 3.1), st.floats(0.12, 2.0), st.floats(0.12, 2.4), st.floats(0.7, 3.0),
       st.sampled_from(sorted(BALLS)))
def test_any_target_in_the_air_is_hit(far, angle, low, high, seconds, name):
    start = np.array([[1.0, 2.0, low]])
    target = start + [[far * np.cos(angle), far * np.sin(angle), high - low]]
    aimed = solve_launches(start, target, BALLS[name], max(seconds, far / 20.0))
    if aimed.possible[0]:
        assert missed(start, target, aimed, BALLS[name], 0)[0] < 0.02
    else:  # only where the ground is in the way: the straight way down there is a bounce
        flight = simulate_flight(Launch(0.0, start[0], aimed.velocity[0]), BALLS[name], aimed.seconds[0])
        assert aimed.miss[0] > 0.02 and (len(flight.bounces) or flight.rolls_from is not None)


def test_a_turned_aim_is_the_turned_launch():
    aimed = solve_launches((0.0, 0.0, 0.3), [[10.0, 0.0, 0.5], [0.0, 10.0, 0.5]], FOOTBALL, 1.5, bounces=1)
    assert aimed.velocity[0, [0, 2]] == pytest.approx(aimed.velocity[1, [1, 2]], abs=1e-3)


def test_what_no_human_can_kick_is_not_possible():
    aimed = solve_launches((0.0, 0.0, 0.11), (90.0, 0.0, 1.0), FOOTBALL, 1.2, fastest=HUMAN_BALL_SPEEDS["foot"])
    assert not aimed.possible[0]
    error = build_reach_error((0.0, 0.0, 0.11), (90.0, 0.0, 1.0), aimed, 0, HUMAN_BALL_SPEEDS["foot"], "pass 3")
    assert isinstance(error, InputError)
    assert all(part in str(error) for part in ("pass 3", "90.0 m", "38 m/s"))


def test_a_ball_on_the_ground_is_not_struck_into_it():
    aimed = solve_launches((0.0, 0.0, 0.11), (20.0, 0.0, 1.0), FOOTBALL, [1.2, 2.0], bounces=1)
    assert aimed.velocity[1, 2] > 0.0 and aimed.possible.tolist() == [False, True]


def test_a_height_that_no_second_bounce_reaches_is_not_possible():
    aimed = solve_launches((0.0, 0.0, 0.3), (5.0, 0.0, 2.5), FOOTBALL, 0.6, bounces=2)
    assert not aimed.possible[0] and np.isfinite(aimed.velocity).all()
    assert "bounces" in str(build_reach_error((0.0, 0.0, 0.3), (5.0, 0.0, 2.5), aimed, 0, 38.0, "pass 1"))


@pytest.mark.parametrize("ball", [PAPER, FOOTBALL, TENNIS])
def test_along_the_ground_in_a_given_time(ball):
    target = np.array([[8.0, 6.0, 0.5]])
    aimed = solve_ground_launches((0.0, 0.0, 0.0), target, ball, 1.4)
    assert aimed.possible[0] and aimed.velocity[0, 2] == 0.0
    flight = simulate_flight(Launch(0.0, np.array([0.0, 0.0, ball.radius]), aimed.velocity[0]), ball, 1.4)
    assert np.linalg.norm(flight.at([1.4])[0] - [8.0, 6.0, ball.radius]) < 0.02
    assert len(flight.bounces) == 0


def test_along_the_ground_it_arrives_as_fast_as_asked():
    aimed = solve_ground_launches((0.0, 0.0, 0.0), (15.0, 0.0, 0.0), FOOTBALL, arrival_speed=3.0)
    flight = simulate_flight(Launch(0.0, np.array([0.0, 0.0, 0.11]), aimed.velocity[0]), FOOTBALL, 10.0)
    assert flight.at(aimed.seconds)[0, 0] == pytest.approx(15.0, abs=0.02)
    assert flight.velocity(aimed.seconds)[0, 0] == pytest.approx(3.0, abs=0.3)


def test_the_ground_may_lie_anywhere():
    low = solve_launches((0.0, 0.0, 0.3), (9.0, 0.0, 0.4), FOOTBALL, 1.8, bounces=1)
    high = solve_launches((0.0, 0.0, 5.3), (9.0, 0.0, 5.4), FOOTBALL, 1.8, bounces=1, ground=5.0)
    assert high.velocity == pytest.approx(low.velocity, abs=1e-3)


def test_a_target_below_where_a_ball_can_lie_is_on_the_ground():
    low = solve_launches((0.0, 0.0, 0.3), (9.0, 0.0, -0.5), FOOTBALL, bounces=1)
    lies = solve_launches((0.0, 0.0, 0.3), (9.0, 0.0, FOOTBALL.radius), FOOTBALL, bounces=1)
    assert low.possible.all() and np.array_equal(low.velocity, lies.velocity)


def test_one_launch_that_leads_nowhere_does_not_spoil_the_others():
    slopes = np.stack([np.eye(3), np.full((3, 3), 1e12), np.full((3, 3), np.inf)])
    assert _compute_step(slopes, np.ones((3, 3)))[0] == pytest.approx(np.ones(3))


def test_same_input_same_launch():
    start, target, seconds = aims(6)
    one, other = (solve_launches(start, target, FOOTBALL, seconds, 1) for _ in range(2))
    assert np.array_equal(one.velocity, other.velocity)


@pytest.mark.parametrize("change", [{"seconds": 0.0}, {"seconds": -1.0}, {"seconds": np.nan}, {"bounces": -1},
                                    {"bounces": 1.5}, {"target": (np.nan, 0.0, 0.0)}])
def test_what_cannot_be_meant_is_told(change):
    given_ = {"start": (0.0, 0.0, 0.5), "target": (5.0, 0.0, 0.5), "ball": PAPER, "seconds": 1.0, **change}
    with pytest.raises(InputError):
        solve_launches(**given_)
