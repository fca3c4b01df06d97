"""A made jog with the ball planted in the pelvis, as feeds have it: touched step by step, never in the body,
slowing."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces
from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.ball.physics import FOOTBALL, compute_deceleration
from beyond_mocap.ball.roll import compute_roll_speeds, simulate_rolls
from beyond_mocap.motion.contacts import detect_contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.synthesis.construct.ball_detour import lead_ball_around_body
from beyond_mocap.synthesis.construct.ball_touch.dribble import plan_dribbles
from beyond_mocap.synthesis.construct.contact_geometry import lead_ball_through, move_ball_at
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


@pytest.fixture(scope="module", params=[1.4, 2.8, 5.0])
def run(request):
    return build_gait(request.param, 4.0, FPS)


def pelvis(motion):
    return compute_pose(motion.skeleton, motion.root_positions, motion.rotations)[0][
        :, identify_joints(motion.skeleton).hips
    ]


def planted_ball(motion, ahead=0.0):
    """The ball in the pelvis, or ahead of it (they run along +x)."""
    ball = pelvis(motion) + [ahead, 0.0, 0.0]
    ball[:, 2] = BALL_RADIUS
    return ball


def dribbled(motion, ball, stretches=((15.0, 105.0),), held=(), **known):
    return plan_dribbles(
        motion.skeleton, motion.root_positions, motion.rotations, detect_contacts(motion), ball, stretches, held, FPS,
        **known
    )


def gaps(motion, ball):
    """(T, 2) m, left and right foot."""
    places, world = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)
    return np.stack(
        [measure_ball_gap(f.compute_line(places, world), f.radius, ball) for f in build_surfaces(motion.skeleton,
                                                                                                 {"dribble"})], 1
    )


def test_the_ball_is_touched_stride_by_stride_and_never_inside_a_foot(run):
    ball = planted_ball(run)
    before = run.root_positions.copy(), run.rotations.copy(), ball.copy()
    found = dribbled(run, ball)
    touched = [push.first for push in found.pushes]
    assert touched[0] <= 15 + 0.9 * FPS and touched[-1] >= 105 - 0.9 * FPS
    assert np.diff(touched).max() <= 1.3 * FPS and len(touched) >= 3
    near = gaps(run, found.ball)
    for push in found.pushes:
        side = ("left", "right").index(push.side)
        assert np.abs(near[push.first : push.last + 1, side]).max() < 0.005
    held = [(push.first, push.last) for push in found.pushes]
    round_body = lead_ball_around_body(run.skeleton, run.root_positions, run.rotations, found.ball, held, FPS)
    assert gaps(run, round_body)[touched[0] : touched[-1]].min() > -0.005
    assert all(np.array_equal(a, b) for a, b in zip(before, (run.root_positions, run.rotations, ball)))


def test_it_is_ahead_of_the_body_on_the_ground_and_slows_from_touch_to_touch(run):
    found = dribbled(run, planted_ball(run))
    first, last = found.pushes[0].first, found.pushes[-1].last
    assert (found.ball - pelvis(run))[first:last, 0].min() > 0.0
    assert np.allclose(found.ball[first:last, 2], BALL_RADIUS)
    for before, after in zip(found.pushes, found.pushes[1:]):
        speed = np.linalg.norm(np.diff(found.ball[before.last : after.first + 1], axis=0), axis=1) * FPS
        assert np.diff(speed).max(initial=-1.0) < 0.25  # led around a foot it may turn a little


def test_it_stays_near_samples_that_are_where_a_ball_can_be(run):
    found = dribbled(run, planted_ball(run, ahead=0.6))
    first, last = found.pushes[0].first, found.pushes[-1].last
    off = np.linalg.norm(found.ball - planted_ball(run, ahead=0.6), axis=1)[first : last + 1]
    assert np.mean(off) < 0.3


def test_key_moments_stay_where_the_ball_was_met():
    motion = build_gait(2.8, 4.0, FPS)
    ball = planted_ball(motion, ahead=0.5)
    found = dribbled(motion, ball, stretches=[(20.0, 90.0)], held=[(19, 20), (88, 89)])
    for frame in (19, 20, 88, 89):
        assert np.array_equal(found.ball[frame], ball[frame])
    assert np.array_equal(found.ball[:20], ball[:20]) and np.array_equal(found.ball[89:], ball[89:])
    assert found.pushes


def knocked_on_ball(motion, most=2.5, low=40, high=85):
    """The ball in reach of the feet, and up to `most` m ahead between two frames."""
    frames = np.arange(len(motion))
    knocked = np.clip(np.minimum(frames - low, high - frames) / 8.0, 0.0, 1.0)
    return planted_ball(motion, ahead=0.5) + np.outer((most - 0.5) * knocked, [1.0, 0.0, 0.0]), knocked >= 0.5


def test_a_ball_that_was_measured_far_ahead_runs_there():
    motion = build_gait(5.0, 4.0, FPS)
    ball, is_far = knocked_on_ball(motion)
    found = dribbled(motion, ball)
    assert np.allclose(found.ball[is_far], ball[is_far], atol=0.3)
    assert not any(is_far[push.first] for push in found.pushes) and found.pushes
    # where the feed has filled it in, the feet have it
    filled = dribbled(motion, ball, measured=~is_far)
    assert (filled.ball - pelvis(motion))[is_far, 0].max() < 1.5


def test_a_ball_that_would_leave_a_key_moment_through_the_legs_is_not_knocked_on():
    motion = build_gait(5.0, 4.0, FPS)
    ball, is_far = knocked_on_ball(motion)
    at = np.clip(np.arange(len(motion)) - 35, -1, 6)
    ball[at < 6] = planted_ball(motion, ahead=-0.5)[at < 6]  # met behind the body, it runs to the front
    ball[:, 0] += np.where((at >= 0) & (at < 6), 1.0 * at / 6, 0.0)
    is_met = dribbled(motion, ball, held=[(35, 36)])
    assert (is_met.ball - pelvis(motion))[is_far, 0].mean() < 1.5
    assert (dribbled(motion, ball).ball - pelvis(motion))[is_far, 0].mean() > 1.8


def test_without_a_sample_the_ball_stays_near_the_line_of_travel():
    motion = build_gait(5.0, 4.0, FPS, turn_rate=0.9)
    ball = planted_ball(motion)
    found = dribbled(motion, ball, measured=np.zeros(len(ball), bool))
    first, last = found.pushes[0].first, found.pushes[-1].last
    velocity = np.gradient(pelvis(motion)[:, :2], axis=0)[first:last]
    velocity /= np.linalg.norm(velocity, axis=1)[:, None]
    away = (found.ball - pelvis(motion))[first:last, :2]
    aside = np.abs(away[:, 1] * velocity[:, 0] - away[:, 0] * velocity[:, 1])
    assert aside.max() < 0.8


@pytest.mark.parametrize("held", [[(19, 20)], [(88, 89)], [(50, 51)], [(20, 20), (40, 41), (89, 89)]])
def test_wherever_the_ball_is_met_the_dribble_goes_on_around_it(held):
    motion = build_gait(2.8, 4.0, FPS)
    ball = planted_ball(motion, ahead=0.5)
    found = dribbled(motion, ball, stretches=[(20.0, 90.0)], held=held)
    assert all(np.array_equal(found.ball[list(pair)], ball[list(pair)]) for pair in held)
    touched = sorted([20, 90, *(push.first for push in found.pushes), *(frame for pair in held for frame in pair)])
    assert np.diff(touched).max() <= 1.3 * FPS and len(found.ball) == len(ball)


@pytest.mark.parametrize("held, moves", [([(19, 20), (60, 61)], True), ([], False), ([(19, 20)], False)])
def test_where_no_foot_comes_near_the_ball_only_rolls(held, moves):
    motion = build_gait(2.8, 4.0, FPS)
    motion = replace(motion, root_positions=motion.root_positions + [0.0, 0.0, 5.0])
    ball = planted_ball(motion, ahead=0.5) + np.sin(np.arange(len(motion)))[:, None] * [0.0, 0.1, 0.0]
    found = dribbled(motion, ball, stretches=[(20.0, 60.0)], held=held)
    assert not found.pushes and np.array_equal(found.ball, ball) != moves


def test_outside_of_the_stretches_the_ball_only_comes_and_goes():
    motion = build_gait(2.8, 4.0, FPS)
    ball = planted_ball(motion)
    found = dribbled(motion, ball, stretches=[(45.0, 90.0)], course_changes=[30.2, 110.0])
    assert np.array_equal(found.ball[:30], ball[:30]) and np.array_equal(found.ball[111:], ball[111:])
    assert not np.array_equal(found.ball[40:45], ball[40:45])


@pytest.mark.parametrize("stretches", [[], [(3.0, 4.0)], [(500.0, 600.0)], [(-50.0, -20.0)]])
def test_nothing_to_dribble_changes_nothing(run, stretches):
    ball = planted_ball(run)
    found = dribbled(run, ball, stretches=stretches)
    assert np.array_equal(found.ball, ball) and not found.pushes


def test_without_a_ball_nothing_happens(run):
    ball = np.full((len(run), 3), np.nan)
    assert np.isnan(dribbled(run, ball).ball).all()


def test_a_roll_slows_evenly_and_arrives():
    ends = np.array([[3.0, 1.0, BALL_RADIUS], [0.05, 0.0, BALL_RADIUS]])
    frames = np.array([30, 45])
    starts = np.tile([0.0, 0.0, BALL_RADIUS], (2, 1))
    found, speeds = simulate_rolls(starts, ends, frames, FPS), compute_roll_speeds(starts, ends, frames / FPS)
    for number, (end, frame) in enumerate(zip(ends, frames)):
        assert np.allclose(found.balls[number, frame - 1], end, atol=1e-9)
    lost = np.linalg.norm(speeds.start_velocity[0]) - np.linalg.norm(speeds.end_velocity[0])
    assert lost == pytest.approx(compute_deceleration(np.sqrt(10.0), FOOTBALL) * 1.0)
    assert np.linalg.norm(speeds.end_velocity[1]) == pytest.approx(0.0, abs=1e-9)  # it lies there and waits


def test_a_ball_from_the_chest_falls_and_hops():
    found = simulate_rolls(np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, BALL_RADIUS]]), np.array([60]), FPS)
    height = found.balls[0, :, 2]
    assert height.min() >= BALL_RADIUS and found.height_error[0] == 0.0
    assert np.flatnonzero(height <= BALL_RADIUS + 0.05)[0] / FPS == pytest.approx(np.sqrt(2 * 0.89 / 9.81), abs=0.05)


@pytest.mark.parametrize("end, frames, most", [(0.2, 18, 0.2), (0.15, 30, 0.15), (0.4, 18, 0.8), (0.2, 3, 0.2)])
def test_a_rolling_ball_bobbles_up_to_a_low_foot_and_is_lifted_to_a_high_one(end, frames, most):
    start = np.array([[0.0, 0.0, BALL_RADIUS]])
    found = simulate_rolls(start, np.array([[1.5, 0.0, end]]), np.array([frames]), FPS)
    height = np.append(BALL_RADIUS, found.balls[0, :, 2])
    assert height[-1] == pytest.approx(end) and height.max() <= most + 1e-9
    flies = height[:-2] > BALL_RADIUS + 1e-6
    assert np.abs(np.diff(height, 2)[flies] + 9.81 / FPS**2).max() < 1e-9
    assert found.height_error[0] == pytest.approx(height.max() - end)


def test_led_through_a_place_a_flight_stays_a_flight():
    times = np.arange(60) / FPS
    flight = np.stack([8.0 * times, 0.0 * times, 3.0 + 9.0 * times - 4.905 * times**2], axis=1)
    out = lead_ball_through(flight, (20, 20), flight[[20, 20]] + [0.2, -0.1, 0.15], (0, 59))
    bends = np.diff(out, 2, axis=0) - np.diff(flight, 2, axis=0)
    assert np.abs(np.delete(bends, 19, axis=0)).max() < 1e-9
    assert np.array_equal(out[[0, 59]], flight[[0, 59]])


def test_led_a_rolling_ball_stays_on_the_ground():
    roll = np.stack([np.linspace(0.0, 5.0, 40), np.zeros(40), np.full(40, BALL_RADIUS)], axis=1)
    out = move_ball_at(roll, 30, 10, np.array([0.3, 0.1, 0.2]))
    assert out[30, 2] == pytest.approx(BALL_RADIUS + 0.2)
    assert np.allclose(out[:30, 2], BALL_RADIUS) and np.allclose(out[:11], roll[:11])
