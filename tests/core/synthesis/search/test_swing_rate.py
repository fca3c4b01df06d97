"""A swing is played faster or slower around its touch only, as its ball needs."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.synthesis.search.edit_list import find_transitions
from beyond_mocap.synthesis.search.key_fit import (
    SPEED_RATIO,
    SWING_RATES,
    BallMeasurement,
    StrikeMeasurements,
    compute_swing_rates,
)
from beyond_mocap.synthesis.search.swing_rate import retime_swing


@pytest.mark.parametrize("rate", [0.65, 0.9, 1.4])
@pytest.mark.parametrize("touch", [20.0, 14.6])
def test_only_the_swing_is_played_at_another_rate(rate, touch):
    frame = 100.0 + 0.9 * np.arange(41)
    played = retime_swing(frame, touch, 30.0, rate)
    places = np.arange(41)
    assert np.interp(touch, places, played) == pytest.approx(np.interp(touch, places, frame), abs=0.02)
    assert np.array_equal(played[[0, 1, -2, -1]], frame[[0, 1, -2, -1]])
    steps = np.diff(played)
    assert steps[int(touch)] == pytest.approx(0.9 * rate, rel=0.05)
    assert steps.min() > 0.9 * min(rate, 0.8) - 0.01 and steps.max() < 0.9 * max(rate, 1.2) + 0.01
    assert not len(find_transitions(np.zeros(41, int), played))


def test_a_piece_without_room_stays_as_it_is():
    frame = np.arange(30.0)
    assert retime_swing(frame, 1.0, 30.0, 1.3) is frame and retime_swing(frame, 15.0, 30.0, 1.0) is frame


def build_shots(sends=True):
    """Feet at 4, 12 and 20 m/s, straight ahead."""
    velocity = np.array([[4.0, 0.0, 0.0], [12.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    return StrikeMeasurements(np.tile([0.5, 0.0], (3, 1)), np.full(3, 0.1), velocity, np.full(3, sends))


@pytest.mark.parametrize("player", [0.0, 4.0])
def test_the_foot_gets_as_fast_as_the_ball_needs_within_limits(player):
    ball = BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array([18.0, 0.0, 0.0]), player)
    rates = compute_swing_rates(build_shots(), ball)
    foot = rates * [4.0, 12.0, 20.0] + player
    assert rates[0] == SWING_RATES[1] and SPEED_RATIO[0] < 18.0 / foot[1] < SPEED_RATIO[1]
    assert SWING_RATES[0] <= rates[2] < 0.85
    faster = compute_swing_rates(build_shots().play(np.arange(3), np.full(3, 1.25)), ball)
    assert 1.25 * faster[0] == pytest.approx(SWING_RATES[1])


def test_a_reception_and_an_unknown_ball_leave_the_swing_alone():
    ball = BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array([18.0, 0.0, 0.0]))
    unknown = BallMeasurement(np.full(2, np.nan), np.nan, np.full(3, np.nan))
    assert np.all(compute_swing_rates(build_shots(sends=False), ball) == 1.0)
    assert np.all(compute_swing_rates(build_shots(), unknown) == 1.0)


def test_a_swing_that_keeps_its_rate_is_left_alone():
    ball = BallMeasurement(np.array([0.5, 0.0]), 0.11, np.array([18.0, 0.0, 0.0]))
    shots = replace(build_shots(), keeps_rate=np.array([False, True, False]))
    played = shots.play(np.array([1, 0, 2]), np.ones(3))
    assert list(compute_swing_rates(played, ball) == 1.0) == [True, False, False]
