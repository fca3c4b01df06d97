"""Of several clips the one that strikes where the ball is, and sends it where it went."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.library.features import build_frames
from beyond_mocap.library.keys import Key
from beyond_mocap.motion.track import Track, sample_track
from beyond_mocap.synthesis.search import key_fit
from beyond_mocap.synthesis.search.key_fit import (
    BallMeasurement,
    StrikeMeasurements,
    compute_key_misfit,
    measure_ball,
    measure_strikes,
)


@pytest.fixture(scope="module")
def three():
    """A low strike ahead, a high one ahead, a low one to the left."""
    place = np.array([[0.5, 0.0], [0.5, 0.0], [0.0, 0.5]])
    velocity = np.array([[8.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]])
    return StrikeMeasurements(place, np.array([0.1, 0.9, 0.1]), velocity, np.ones(3, bool))


@pytest.mark.parametrize("ball, best", [
    (BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array([9.5, 0.0, 0.0])), 0),
    (BallMeasurement(np.array([0.5, 0.0]), 1.0, np.array([9.5, 0.0, 0.0])), 1),
    (BallMeasurement(np.array([0.1, 0.6]), 0.11, np.array([0.0, 9.5, 0.0])), 2),
])
def test_the_clip_that_fits_costs_least(three, ball, best):
    assert int(np.argmin(compute_key_misfit(three, ball))) == best


def test_what_is_unknown_costs_nothing(three):
    unknown = BallMeasurement(np.full(2, np.nan), np.nan, np.full(3, np.nan))
    assert not np.any(compute_key_misfit(three, unknown))


@pytest.fixture(scope="module")
def strengths():
    """A side-foot pass, a shot, and a shot that rises, from one place."""
    velocity = np.array([[6.0, 0.0, 0.0], [17.0, 0.0, 0.0], [15.0, 0.0, 8.0]])
    return StrikeMeasurements(np.tile([0.5, 0.0], (3, 1)), np.full(3, 0.1), velocity, np.ones(3, bool))


@pytest.mark.parametrize("leaving, best", [([7.0, 0.0, 0.0], 0), ([33.0, 0.0, 0.0], 1), ([20.0, 0.0, 14.0], 2)])
def test_a_shot_is_no_side_foot_tap_and_a_pass_no_shot(strengths, leaving, best):
    ball = BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array(leaving))
    assert int(np.argmin(compute_key_misfit(strengths, ball))) == best


@pytest.mark.parametrize("leaving", [[33.0, 0.0, 0.0], [0.0, -6.0, 0.0], [4.0, 0.0, 8.0]])
def test_a_reception_is_not_judged_by_where_its_ball_goes_and_how_fast(strengths, leaving):
    ball = BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array(leaving))
    taken = compute_key_misfit(replace(strengths, sends=np.zeros(3, bool)), ball)
    assert np.ptp(taken) == 0.0 and taken[0] < compute_key_misfit(strengths, ball)[0]


def test_a_runner_can_turn_less_to_where_the_ball_goes(strengths):
    ball = BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array([12.0, 7.0, 0.0]))
    standing, running = (compute_key_misfit(strengths, replace(ball, speed=speed))[1] for speed in (0.0, 7.0))
    assert standing < running


def test_the_ball_is_seen_along_the_way():
    times = np.arange(101) / 25.0
    places = np.column_stack([np.zeros(101), 3.0 * times])
    ball = np.column_stack([places + [-1.0, 0.0], np.full(101, 0.5)])
    ball[50:] += np.outer(times[50:] - 2.0, [0.0, 10.0, 0.0])
    found = measure_ball(sample_track(Track(times, places, ball), 30.0), 60.0, True)
    assert np.allclose(found.place, [0.0, 1.0], atol=0.05) and found.height == pytest.approx(0.5)
    assert found.exit_velocity[0] > 8.0 and abs(found.exit_velocity[1]) < 0.5
    assert np.isnan(measure_ball(sample_track(Track(times, places, ball), 30.0), 60.0, False).height)


def test_a_made_kick_strikes_ahead_near_the_ground_and_its_twin_on_the_other_side(library):
    keys = library.keys
    found = measure_strikes(library, keys)
    assert np.all(found.height < 0.3) and np.all(found.velocity[:, 0] > 1.0)
    assert found.place[0, 0] == pytest.approx(found.place[1, 0], abs=0.03)
    assert found.place[0, 1] == pytest.approx(-found.place[1, 1], abs=0.03)


def test_a_strike_at_the_end_of_its_clip_is_the_same_whichever_clip_follows(library):
    """It is kept for every library that has the clip. The last frame of 60 per second lies half a frame behind the
    last one of the library."""
    kick = next(clip for clip in library.clips if library.clips[library.keys[0].clip] is clip)
    count = 4 * (len(kick.motion) // 4)
    short = replace(kick, motion=kick.motion.frames(0, count), heel_toe_contacts=kick.heel_toe_contacts[:count])
    strike, found = Key(0, count - 1.0, 0.0, count - 1.0, library.keys[0].labels), []
    for clips in ((short,), (short, *library.clips[:2])):
        key_fit._measured.pop(short, None)
        one = replace(library, clips=clips, frames=build_frames(clips))
        found.append(measure_strikes(one, [strike]))
    assert kick.motion.fps == 60.0
    assert np.array_equal(found[0].velocity, found[1].velocity) and np.array_equal(found[0].place, found[1].place)
