"""The planned heading: ball, travel and given headings decide; it turns the short way, in time, and stays local."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.track import SampledTrack, Track, sample_track
from beyond_mocap.synthesis.heading_plan import HeadingKey, plan_heading, plan_track

FPS = 30.0


def going(velocity, ball, seconds=8.0, noise=0.0) -> SampledTrack:
    """A player with velocity(t) (T, 2) m/s and a ball at ball(t) (T, 2) m."""
    times = np.arange(0.0, seconds + 1e-9, 0.04)
    places = np.cumsum(velocity(times) * 0.04, axis=0)
    places += np.random.default_rng(1).normal(0.0, noise, places.shape)
    balls = np.column_stack([ball(times), np.full(len(times), 0.11)])
    return sample_track(Track(times, places, balls), FPS)


def constant(*value):
    return lambda times: np.tile(np.array(value, float), (len(times), 1))


def degrees_from(heading, wanted):
    return np.degrees(np.abs(np.angle(np.exp(1j * (heading - np.radians(wanted))))))


@pytest.mark.parametrize("speed, ball, most", [(0.0, (-20.0, 5.0), 25.0), (0.4, (0.0, -20.0), 25.0)])
def test_a_slow_player_faces_the_ball(speed, ball, most):
    track = going(constant(speed, 0.0), constant(*ball))
    assert degrees_from(plan_heading(track), np.degrees(np.arctan2(ball[1], ball[0]))).max() < most


def test_a_fast_player_faces_the_travel():
    track = going(constant(6.0, 0.0), constant(-40.0, 0.0))
    assert degrees_from(plan_heading(track), 0.0).max() < 30.0


def test_a_creeping_track_does_not_turn_the_body():
    """It circles at 0.3 m/s, and is noisy; the ball is still."""
    circle = lambda times: 0.3 * np.column_stack([np.cos(2.0 * times), np.sin(2.0 * times)])  # noqa: E731
    heading = plan_heading(going(circle, constant(25.0, 0.0), noise=0.02))
    assert np.ptp(heading) < np.radians(25.0)


def test_it_walks_backward_from_a_ball_that_lies_behind_its_path():
    heading = plan_heading(going(constant(1.0, 0.0), constant(-30.0, 0.0)))
    assert degrees_from(heading, 180.0).mean() < 30.0


def test_it_turns_the_short_way_at_a_speed_that_legs_have():
    """The ball passes by, from ahead to behind, on the left."""
    passing = lambda times: np.column_stack([15.0 - 5.0 * times, np.full(len(times), 6.0)])  # noqa: E731
    heading = plan_heading(going(constant(0.0, 0.0), passing))
    assert 0.0 < heading[-1] - heading[0] < np.pi
    assert np.abs(np.diff(heading)).max() * FPS < np.radians(250.0)


def test_without_a_ball_it_faces_the_travel():
    times = np.arange(0.0, 6.0, 0.04)
    track = sample_track(Track(times, np.column_stack([1.5 * times, 1.5 * times])), FPS)
    assert degrees_from(plan_heading(track), 45.0).max() < 15.0


def test_given_headings_hold():
    track = going(constant(1.0, 0.0), constant(30.0, 0.0))
    keys = HeadingKey(2.0, heading=np.radians(90.0), hold=1.0), HeadingKey(5.0, target=(-10.0, 0.0), hold=1.5)
    heading = plan_heading(track, keys)
    assert degrees_from(heading[int(2.3 * FPS) : int(2.7 * FPS)], 90.0).max() < 12.0
    assert degrees_from(heading[int(5.4 * FPS) : int(6.0 * FPS)], 180.0).max() < 12.0
    assert degrees_from(heading[: int(0.8 * FPS)], 0.0).max() < 12.0


@pytest.mark.parametrize("more", [{}, {"heading": 0.0, "target": (0.0, 0.0)}, {"heading": np.nan},
                                  {"heading": 0.0, "hold": -1.0}])
def test_a_key_is_one_finite_heading_or_target(more):
    with pytest.raises(InputError, match="heading key"):
        HeadingKey(1.0, **more)


def test_what_happens_later_changes_nothing_before():
    """An edit of the ball's path after 12 s leaves the headings until 8 s, bit for bit."""
    wave = lambda times: np.column_stack([np.sin(times), 0.5 * np.cos(0.7 * times)])  # noqa: E731
    around = lambda times: 20.0 * np.column_stack([np.cos(0.3 * times), np.sin(0.3 * times)])  # noqa: E731
    later = lambda times: np.where(times[:, None] < 12.0, around(times), -around(times))  # noqa: E731
    one, other = (plan_heading(going(wave, ball, seconds=20.0)) for ball in (around, later))
    assert np.array_equal(one[: int(8 * FPS)], other[: int(8 * FPS)]) and not np.array_equal(one, other)


@pytest.mark.parametrize("count", [2, 3, 5])
def test_very_short_tracks(count):
    times = np.arange(count) / 25.0
    planned = plan_track(sample_track(Track(times, np.zeros((count, 2))), FPS))
    assert len(planned.heading) == len(planned.leeway) == len(planned) and np.isfinite(planned.heading).all()
