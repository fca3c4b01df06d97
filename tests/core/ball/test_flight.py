"""Flights against closed forms, against an integrator written out here, and against what must hold of any: no energy
from nothing, nothing below the ground."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.ball.flight import Launch, simulate_flight
from beyond_mocap.ball.physics import BALLS, FOOTBALL, PAPER, TENNIS, Ball, compute_bounce, compute_slip
from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion

VACUUM = Ball("vacuum", 0.11, 0.43, gravity=9.8, restitution=0.7)
QUICK = settings(max_examples=15, deadline=None)


def launched(velocity, spin=(0.0, 0.0, 0.0), height=0.5, time=0.0):
    return Launch(time, np.array([1.0, -2.0, height]), np.array(velocity, float), np.array(spin, float))


def any_vector(most):
    return st.tuples(*[st.floats(-most, most) for _ in range(3)])


def test_without_drag_it_is_a_parabola():
    flight = simulate_flight(launched((8.0, 3.0, 6.0), time=2.0), VACUUM, 1.2)
    t = np.linspace(0.0, 1.2, 50)[:, None]
    wanted = [1.0, -2.0, 0.5] + t * [8.0, 3.0, 6.0] - 4.9 * t**2 * [0, 0, 1]
    assert np.abs(flight.at(t[:, 0] + 2.0) - wanted).max() < 1e-6
    assert len(flight.bounces) == 0 and flight.rolls_from is None and flight.end == pytest.approx(3.2)


def test_bounces_come_when_and_where_the_closed_form_says():
    flight = simulate_flight(launched((2.0, 0.0, 3.0), height=1.11), VACUUM, 30.0)
    first = (3.0 + np.sqrt(9.0 + 2 * 9.8)) / 9.8
    down = np.sqrt(9.0 + 2 * 9.8)
    hops = 2.0 * down * 0.7 ** np.arange(1, 5) / 9.8
    wanted = first + np.concatenate([[0.0], np.cumsum(hops)])
    assert flight.bounces[:5] == pytest.approx(wanted, abs=1e-7)
    tops = wanted[:4] + hops / 2.0
    assert flight.at(tops)[:, 2] == pytest.approx(0.11 + (down * 0.7 ** np.arange(1, 5)) ** 2 / 19.6, abs=1e-6)
    assert flight.at(tops)[:, 0] == pytest.approx(1.0 + 2.0 * tops, abs=1e-6)
    assert len(flight.bounces) < 15  # and then it stays on the ground: no endless row of ever lower hops


def test_a_flight_up_to_its_landing_is_the_first_piece_of_the_whole():
    launch = launched((8.0, 1.0, 4.0), spin=(0.0, 30.0, 5.0), height=1.3)
    whole, first = simulate_flight(launch, FOOTBALL, 6.0), simulate_flight(launch, FOOTBALL, 6.0, landing=True)
    assert first.end == whole.bounces[0] < whole.end and len(first.bounces) == 1
    t = np.linspace(0.0, first.end, 40)
    assert np.array_equal(first.at(t[:-1]), whole.at(t[:-1]))
    assert simulate_flight(launch, FOOTBALL, 0.2, landing=True).end == 0.2


def test_linear_drag_is_the_papers():
    t = np.linspace(0.0, 2.0, 30)
    fallen = 9.8 / 0.2 * (t - (1.0 - np.exp(-0.2 * t)) / 0.2)
    at = simulate_flight(launched((10.0, 0.0, 12.0)), PAPER, 2.0).at(t)
    assert at[:, 0] == pytest.approx(1.0 + 10.0 * (1.0 - np.exp(-0.2 * t)) / 0.2, abs=1e-6)
    assert at[:, 2] == pytest.approx(0.5 + 12.0 * (1.0 - np.exp(-0.2 * t)) / 0.2 - fallen, abs=1e-6)


def test_a_fall_with_quadratic_drag_is_the_closed_form():
    t = np.linspace(0.0, 4.0, 30)
    at = simulate_flight(launched((0.0, 0.0, 0.0), height=100.0), FOOTBALL, 4.0).at(t)
    fallen = np.log(np.cosh(t * np.sqrt(FOOTBALL.gravity * FOOTBALL.drag))) / FOOTBALL.drag
    assert at[:, 2] == pytest.approx(100.0 - fallen, abs=1e-6)


def by_small_steps(launch, ball, seconds, step=2e-3):
    """Position after `seconds` of a flight with bounces, by Runge-Kutta steps with the formulas written out anew."""
    x, v, w = (np.array(value, float) for value in (launch.position, launch.velocity, launch.spin))

    def pull(v, w):
        speed, rim = np.sqrt(v @ v), ball.radius * np.sqrt(w @ w)
        out = -ball.linear_drag * v - ball.drag * speed * v - np.array([0.0, 0.0, ball.gravity])
        if rim > 0.0:
            lift = 1.0 / (ball.lift[1] + ball.lift[2] * speed / rim)
            out = out + ball.lift[0] * lift * speed * np.cross(w / np.sqrt(w @ w), v)
        return out

    def stepped(x, v, w, h):
        half = w * np.exp(-ball.spin_decay * h / 2.0)
        k1 = pull(v, w)
        k2 = pull(v + h / 2 * k1, half)
        k3 = pull(v + h / 2 * k2, half)
        k4 = pull(v + h * k3, half**2 / np.where(w, w, 1.0))
        whole = half**2 / np.where(w, w, 1.0)
        return x + h * v + h * h / 6 * (k1 + k2 + k3), v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), whole

    left = seconds
    for _ in range(int(2 * seconds / step)):
        h = min(step, left)
        ahead = stepped(x, v, w, h)
        if ahead[0][2] < ball.radius and ahead[1][2] < 0.0:
            h *= (x[2] - ball.radius) / (x[2] - ahead[0][2])
            x, v, w = stepped(x, v, w, h)
            x[2], normal = ball.radius, -v[2]
            lowest = v[:2] + ball.radius * np.array([-w[1], w[0]])
            impulse = -lowest / (1.0 + 1.0 / ball.inertia)
            most = ball.friction * (1.0 + ball.restitution) * normal
            impulse *= min(1.0, most / max(np.linalg.norm(impulse), 1e-12))
            v = np.array([*(v[:2] + impulse), ball.restitution * normal])
            w = w + np.array([impulse[1], -impulse[0], 0.0]) / (ball.inertia * ball.radius)
        else:
            x, v, w = ahead
        left -= h
        if left <= 0.0:
            break
    return x


@pytest.mark.parametrize("name", ["football", "volleyball", "tennis"])
@pytest.mark.parametrize("spin", [(0.0, 0.0, 0.0), (10.0, -60.0, 45.0)])
def test_drag_lift_and_bounces_agree_with_an_integrator_of_their_own(name, spin):
    launch = launched((22.0, 5.0, 4.0), spin)
    flight = simulate_flight(launch, BALLS[name], 3.5)
    assert len(flight.bounces) >= 1
    for seconds in (0.5, flight.bounces[:3][-1] + 0.1):
        assert np.abs(flight.at([seconds])[0] - by_small_steps(launch, BALLS[name], seconds)).max() < 1e-3


def test_a_ball_without_spin_that_grips_keeps_three_fifths_of_its_way():
    ball = replace(FOOTBALL, friction=2.0)
    velocity, spin = compute_bounce(np.array([5.0, 0.0, -6.0]), np.zeros(3), ball)
    assert velocity == pytest.approx([3.0, 0.0, 6.0 * ball.restitution])
    assert spin == pytest.approx([0.0, 3.0 / ball.radius, 0.0])
    assert compute_slip(velocity, spin, ball) == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_ball_that_slides_at_the_bounce_loses_what_coulomb_says():
    velocity, _ = compute_bounce(np.array([30.0, 0.0, -2.0]), np.zeros(3), FOOTBALL)
    assert velocity[0] == pytest.approx(30.0 - FOOTBALL.friction * (1.0 + FOOTBALL.restitution) * 2.0)


def test_a_sliding_ball_comes_to_roll_and_then_to_rest_where_the_closed_form_says():
    ball = replace(FOOTBALL, drag=0.0, spin_decay=0.0)
    flight = simulate_flight(launched((5.0, 0.0, 0.0), height=0.11), ball, 20.0)
    rub = ball.friction * ball.gravity
    until, rolling = 0.4 * 5.0 / rub, 0.6 * 5.0
    slid = 5.0 * until - rub * until**2 / 2.0
    assert flight.rolls_from == pytest.approx(until, abs=1e-6)
    assert flight.rests_from == pytest.approx(until + rolling / ball.rolling, abs=1e-5)
    assert flight.at([19.0])[0, 0] == pytest.approx(1.0 + slid + rolling**2 / (2.0 * ball.rolling), abs=1e-5)


def test_fifas_roll_test_is_met():
    speed = np.sqrt(2.0 * 9.81 * 1.0 / (1.0 + FOOTBALL.inertia))  # off a ramp of 1 m
    launch = launched((speed, 0.0, 0.0), (0.0, speed / 0.11, 0.0), height=0.11)
    assert 4.0 < simulate_flight(launch, FOOTBALL, 30.0).at([30.0])[0, 0] - 1.0 < 8.0


def test_side_spin_bends_the_way_and_back_spin_carries_further():
    straight, bent, carried = (simulate_flight(launched((25.0, 0.0, 8.0), spin), FOOTBALL, 1.0).at([1.0])[0]
                               for spin in ((0, 0, 0), (0, 0, 50.0), (0, -50.0, 0)))
    assert straight[1] == pytest.approx(-2.0)
    assert bent[1] - straight[1] > 2.0  # turning left about Z: to the left
    assert carried[2] - straight[2] > 2.0


def compute_energy(position, velocity, spin, ball):
    """Translation, rotation, and height of the centre above z = 0: J."""
    translation = 0.5 * np.einsum("...i,...i->...", velocity, velocity)
    rotation = 0.5 * ball.inertia * ball.radius**2 * np.einsum("...i,...i->...", spin, spin)
    return ball.mass * (translation + rotation + ball.gravity * position[..., 2])


@QUICK
@given(st.sampled_from(sorted(BALLS)), any_vector(40.0), any_vector(80.0), st.floats(0.0, 30.0))
def test_energy_never_grows_and_the_ground_holds(name, velocity, spin, height):
    ball = BALLS[name]
    flight = simulate_flight(launched(velocity, spin, height), ball, 12.0)
    knots = np.concatenate([np.linspace(0.0, 12.0, 400), flight.bounces, flight.bounces - 1e-9])
    states = flight.states(np.sort(knots))
    joules = compute_energy(states[:, :3], states[:, 3:6], states[:, 6:], ball)
    assert np.diff(joules).max() <= 1e-7 * joules[0] + 1e-9
    assert states[:, 2].min() >= ball.radius - 1e-7


@QUICK
@given(any_vector(30.0), any_vector(60.0), st.floats(-3.0, 3.0))
def test_a_turned_launch_gives_the_turned_flight(velocity, spin, angle):
    about = quaternion.from_up_angle(np.array(angle))
    launch = Launch(0.0, np.array([0.0, 0.0, 1.0]), np.array(velocity), np.array(spin))
    velocity, spin = (quaternion.rotate(about, value) for value in (launch.velocity, launch.spin))
    turned = Launch(0.0, launch.position, velocity, spin)
    times = np.linspace(0.0, 3.0, 20)
    one, other = simulate_flight(launch, FOOTBALL, 3.0).at(times), simulate_flight(turned, FOOTBALL, 3.0).at(times)
    assert np.abs(quaternion.rotate(about, one) - other).max() < 1e-5


def test_rotations_are_the_spin_summed_up():
    flight = simulate_flight(launched((5.0, 0.0, 3.0), (0.0, 0.0, 7.0), height=20.0), replace(TENNIS, spin_decay=0.0),
                             1.0)
    angle = 2.0 * np.arctan2(*flight.rotations([0.4])[0][[3, 0]])
    assert angle == pytest.approx(2.8, abs=1e-9)


def test_a_rolling_ball_turns_by_its_way():
    flight = simulate_flight(launched((2.0, 0.0, 0.0), (0.0, 2.0 / 0.11, 0.0), height=0.11), FOOTBALL, 5.0)
    times = np.array([0.0, 0.1])
    rolled = np.diff(flight.at(times)[:, 0])[0] / 0.11
    assert 2.0 * np.arctan2(*flight.rotations(times)[1][[2, 0]]) == pytest.approx(rolled, rel=1e-3)


def test_before_its_launch_and_after_its_end_it_lies_still():
    flight = simulate_flight(launched((5.0, 0.0, 3.0), time=1.0), FOOTBALL, 1.0)
    assert flight.at([0.0])[0] == pytest.approx([1.0, -2.0, 0.5])
    assert flight.at([9.0]) == pytest.approx(flight.at([2.0]))


@pytest.mark.parametrize("seconds", [-1.0, np.nan, np.inf])
def test_a_flight_of_no_length_is_told(seconds):
    with pytest.raises(InputError, match="a duration of"):
        simulate_flight(launched((1.0, 0.0, 0.0)), FOOTBALL, seconds)
