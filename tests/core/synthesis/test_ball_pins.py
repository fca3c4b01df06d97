"""Pins of the ball: it goes through the place at the key moment, the body meets it there, and all else stays."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Timeline
from beyond_mocap.base.errors import InputError
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.motion.track import BALL_RADIUS, Track
from beyond_mocap.synthesis.ball_pins import FADE_SECONDS, KEY_REACH, assign_ball_pins, lead_ball_to_pins
from beyond_mocap.synthesis.plan import Pin, Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize

KICK = "kick low inside right"
FIRST, SECOND = 3.0, 6.5
FPS = 30.0


@pytest.fixture(scope="module")
def kicked_twice(track_of, timeline_of):
    """Plan of a walker who kicks a ball at FIRST and at SECOND: before each it comes, behind each it rolls away."""
    bare = track_of(1.5, seconds=10.0)
    x = np.array([np.interp(at, bare.times, bare.positions[:, 0]) for at in (FIRST, SECOND)]) + 0.45
    ahead = np.interp(bare.times, [0.0, FIRST, FIRST + 1.5, SECOND, 10.0], [x[0] + 4.0, x[0], x[0] + 9.0, x[1], 30.0])
    y = np.interp(bare.times, [0.0, 10.0], bare.positions[[0, -1], 1])
    ball = np.column_stack([ahead, y, np.full(len(bare), BALL_RADIUS)])
    return Plan(Track(bare.times, bare.positions, ball), timeline_of((FIRST, KICK), (SECOND, KICK)), fps=FPS)


@pytest.fixture(scope="module")
def kicked(library, kicked_twice):
    return synthesize(library, kicked_twice)


def find_ball(take, number):
    """Where the ball is on the frame of a key moment."""
    return take.ball.positions[round(take.keys[number].frame)]


def pin_beside(take, *offset):
    return Pin(FIRST, "ball", tuple(find_ball(take, 0) + offset))


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.1, 0.12, 0.0), (-0.15, -0.1, 0.0), (0.0, 0.05, 0.25)])
@pytest.mark.parametrize("height", [0.0, 1.6])
def test_the_ball_goes_through_its_pin_and_the_foot_meets_it_there(library, kicked_twice, offset, height):
    plan = replace(kicked_twice, height=height)
    before = synthesize(library, plan)
    pin = pin_beside(before, *offset)
    for take in (synthesize(library, replace(plan, pins=(pin,))),
                 resynthesize(library, replace(plan, pins=(pin,)), before)):
        np.testing.assert_allclose(find_ball(take, 0), pin.position, atol=1e-3)
        assert take.pins[0].pin == pin and take.pins[0].miss < 1e-3
        assert evaluate(take, plan.track, library)["keys"][0]["contact_gap_m"] < 0.005
        np.testing.assert_allclose(find_ball(take, 1), find_ball(before, 1), atol=1e-6)


def test_a_pin_without_the_solved_ball_fades_before_the_next_key_moment(library, kicked_twice):
    plan = replace(kicked_twice, solve_touches=False)
    before = synthesize(library, plan)
    take = synthesize(library, replace(plan, pins=(pin_beside(before, 0.1, 0.1, 0.0),)))
    np.testing.assert_allclose(find_ball(take, 0), take.pins[0].pin.position, atol=1e-3)
    far = np.abs(take.ball.times - FIRST) > FADE_SECONDS + 0.5 / FPS
    np.testing.assert_allclose(take.ball.positions[far], before.ball.positions[far], atol=1e-6)


def test_a_ball_out_of_reach_is_where_its_pin_is_and_a_line_says_so(library, kicked_twice, kicked):
    take = synthesize(library, replace(kicked_twice, pins=(pin_beside(kicked, 0.0, 2.5, 0.0),)))
    assert take.pins[0].miss < 1e-3
    assert any("does not reach the ball" in line for line in take.warnings)


def test_a_pin_has_priority_over_the_height_that_labels_say(library, track_of, timeline_of):
    bare = track_of(1.5, seconds=6.0)
    ball = np.column_stack([bare.positions + [0.3, 0.0], np.full(len(bare), np.nan)])
    plan = Plan(Track(bare.times, bare.positions, ball), timeline_of((FIRST, "header")), fps=FPS)
    before = synthesize(library, plan)
    pin = pin_beside(before, 0.05, 0.0, -0.08)
    take = synthesize(library, replace(plan, pins=(pin,)))
    np.testing.assert_allclose(find_ball(take, 0), pin.position, atol=1e-3)
    assert pin.position[2] > 1.0  # though the feed has it on the ground


@pytest.mark.parametrize("time, has_ball", [(FIRST + 2.0 * KEY_REACH, True), (FIRST, False)])
def test_a_pin_without_effect_changes_no_bit_and_a_line_says_so(library, kicked_twice, time, has_ball):
    track = kicked_twice.track
    plan = kicked_twice if has_ball else replace(kicked_twice, track=Track(track.times, track.positions))
    before = synthesize(library, plan)
    take = synthesize(library, replace(plan, pins=(Pin(time, "ball", (0.0, 0.0, 1.0)),)))
    line, = (line for line in take.warnings if "pin" in line)
    assert line == (f"{time:g} s: the pin of ball has no key moment with the ball within 0.2 s, or the track has no "
                    "ball; it is ignored")
    np.testing.assert_array_equal(take.motion.rotations, before.motion.rotations)
    np.testing.assert_array_equal(take.motion.root_positions, before.motion.root_positions)
    if has_ball:
        np.testing.assert_array_equal(take.ball.positions, before.ball.positions)


def test_the_shift_is_smooth_and_stays_between_the_touches_beside_it():
    times = np.arange(0.0, 4.0, 1.0 / 60.0)
    ball = np.column_stack([3.0 * times, np.zeros_like(times), np.full_like(times, 0.5)])
    pin = Pin(2.0, "ball", (6.0, 0.3, 0.5))
    led = lead_ball_to_pins(times, ball, [pin], [1.6, 2.0, 3.5])
    shift = (led - ball)[:, 1]
    np.testing.assert_allclose(led[np.argmin(np.abs(times - 2.0))], pin.position, atol=1e-12)
    assert np.all(shift[(times <= 1.6) | (times >= 2.0 + FADE_SECONDS)] == 0.0)
    assert np.all(np.diff(shift[times < 1.95]) >= 0.0) and np.all(np.diff(shift[times > 2.05]) <= 0.0)
    assert np.abs(np.diff(shift, 2)).max() * 60.0**2 < 0.3 * 5.8 / 0.35**2  # of the steepest ease, over 0.35 s
    assert lead_ball_to_pins(times, ball, [], [2.0]) is ball


def test_a_ball_pinned_lower_stays_above_the_ground():
    times = np.arange(0.0, 4.0, 1.0 / 60.0)
    height = BALL_RADIUS + np.maximum(2.0 - 5.0 * np.abs(times - 2.0), 0.0)  # it rises and falls within 0.8 s
    ball = np.column_stack([3.0 * times, np.zeros_like(times), height])
    led = lead_ball_to_pins(times, ball, [Pin(2.0, "ball", (6.0, 0.0, 0.3))], [2.0])
    assert led[:, 2].min() == BALL_RADIUS and led[:, 2].max() < ball[:, 2].max()


def test_a_pin_belongs_to_the_nearest_key_moment_that_has_the_ball():
    keys = (KeyMoment(2.0, ("kick", "right"), solved=2.1), KeyMoment(2.5, ("celebration",)),
            KeyMoment(5.0, ("header",)))
    pins = [Pin(time, "ball", (1.0, 2.0, -0.4)) for time in (1.9, 2.05, 2.5, 5.1)]
    played = assign_ball_pins([*pins, Pin(5.0, "gaze", (0.0, 0.0, 1.0))], Timeline((), keys))
    assert played == {pins[1]: Pin(2.1, "ball", (1.0, 2.0, BALL_RADIUS)),
                      pins[3]: Pin(5.0, "ball", (1.0, 2.0, BALL_RADIUS))}


def test_a_ball_holds_at_no_place():
    with pytest.raises(InputError, match="a hold of 0.5 s; expected 0 s for the ball"):
        Pin(2.0, "ball", (1.0, 2.0, 0.2), hold=0.5)
