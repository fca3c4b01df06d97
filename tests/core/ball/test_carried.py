"""Feeds that have the ball at a player's own place are recognised, and measured dribbles are not."""

import numpy as np
import pytest

from beyond_mocap.ball.tracked.carried import find_carried_stretches

TIMES = np.arange(0.0, 8.0, 0.04)
RUN = np.column_stack([4.0 * TIMES, 0.5 * np.sin(TIMES)])
FAR = RUN + [6.0, 0.0]


def between(first, last, inside, outside):
    there = (TIMES >= first) & (TIMES <= last)
    return np.where(there[:, None], inside, outside)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.2, -0.1)])
def test_a_ball_at_the_player_s_place_is_found_with_both_ends(offset):
    found = find_carried_stretches(TIMES, between(2.0, 5.0, RUN + offset, FAR), RUN)
    assert found == [pytest.approx((2.0, 5.0), abs=0.05)]


def test_a_short_pause_does_not_part_it():
    ball = between(2.0, 5.0, RUN, FAR)
    ball[[80, 81]] = np.nan
    assert len(find_carried_stretches(TIMES, ball, RUN)) == 1


@pytest.mark.parametrize("ball", [
    RUN + np.column_stack([0.15 + 0.12 * np.sin(9.0 * TIMES), 0.0 * TIMES]),  # runs ahead and is caught up with
    FAR, np.full_like(RUN, np.nan), between(2.0, 2.3, RUN, FAR),
])  # fmt: skip
def test_a_measured_far_unknown_or_briefly_met_ball_is_not(ball):
    assert find_carried_stretches(TIMES, ball, RUN) == []


def test_a_ball_that_lies_before_a_waiting_player_is_measured_and_one_inside_them_is_not():
    waits = np.zeros_like(RUN)
    assert find_carried_stretches(TIMES, waits + [0.25, 0.0], waits) == []
    assert find_carried_stretches(TIMES, waits + [0.01, 0.0], waits) == [pytest.approx((0.0, TIMES[-1]))]
