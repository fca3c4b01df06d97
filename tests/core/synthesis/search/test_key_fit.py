"""Of several clips the one that strikes where the ball is, and sends it where it went."""

import numpy as np
import pytest

from beyond_mocap.motion.track import Track, sample_track
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
    return StrikeMeasurements(place, np.array([0.1, 0.9, 0.1]), np.array([[8.0, 0.0], [8.0, 0.0], [0.0, 8.0]]))


@pytest.mark.parametrize("ball, best", [
    (BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array([15.0, 0.0])), 0),
    (BallMeasurement(np.array([0.5, 0.0]), 1.0, np.array([15.0, 0.0])), 1),
    (BallMeasurement(np.array([0.1, 0.6]), 0.11, np.array([0.0, 15.0])), 2),
])
def test_the_clip_that_fits_costs_least(three, ball, best):
    assert int(np.argmin(compute_key_misfit(three, ball))) == best


def test_what_is_unknown_costs_nothing(three):
    unknown = BallMeasurement(np.full(2, np.nan), np.nan, np.full(2, np.nan))
    assert not np.any(compute_key_misfit(three, unknown))


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
