"""A foot along x, a ball beside it, and a standing leg in between: where ball and foot meet is worked out by hand."""

import numpy as np
import pytest

from beyond_mocap.annotation.striking import FOOT_RADIUS, measure_ball_gap
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.synthesis.construct.contact_geometry import (
    Aim,
    BallRange,
    choose_aim,
    place_between_hands,
    solve_contacts,
)

FOOT = np.array([[0.0, 0.0, 0.11], [0.16, 0.0, 0.11]])
ASIDE, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
APART = FOOT_RADIUS + BALL_RADIUS
ROOM = BallRange(0.3, 0.0)


def anything(need):
    return need


@pytest.mark.parametrize("along", [0.2, 0.5, 0.8])
def test_the_foot_is_struck_where_it_is_aimed(along):
    found = solve_contacts(FOOT, FOOT_RADIUS, [Aim(ASIDE, along)], 0.0, np.array([0.1, 0.2, 0.11]), ROOM)
    assert found.ball[0] == pytest.approx([0.16 * along, APART, 0.11], abs=1e-5)
    assert np.linalg.norm(found.need) < 1e-5


def test_the_ball_moves_first_and_the_foot_the_rest():
    found = solve_contacts(FOOT, FOOT_RADIUS, [Aim(ASIDE)], 0.0, np.array([0.08, 1.0, 0.11]), ROOM)
    assert found.ball[0] == pytest.approx([0.08, 0.7, 0.11])
    assert found.need[0] == pytest.approx([0.0, 0.7 - APART, 0.0], abs=1e-5)


def test_the_ball_leaves_the_standing_leg_within_its_room():
    leg = np.array([[0.08, 0.2, 0.08], [0.08, 0.2, 0.5]])
    ball = np.array([0.08, 0.25, 0.11])
    inside = solve_contacts(FOOT, FOOT_RADIUS, [Aim(ASIDE)], 0.0, ball, ROOM)
    assert measure_ball_gap(leg, FOOT_RADIUS, inside.ball)[0] < -0.1
    clear = solve_contacts(FOOT, FOOT_RADIUS, [Aim(ASIDE)], 0.0, ball, ROOM, [(leg, FOOT_RADIUS)])
    assert measure_ball_gap(leg, FOOT_RADIUS, clear.ball)[0] > -1e-3
    assert np.linalg.norm(clear.ball[0] - ball) <= 0.3 + 1e-9
    assert clear.ball[0] - clear.need[0] == pytest.approx([0.08, APART, 0.11], abs=1e-5)


def test_the_aim_is_one_that_the_body_can_make():
    ball = np.array([0.6, 0.5, 0.11])
    free = choose_aim(FOOT, FOOT_RADIUS, AHEAD, 0.0, ball, ROOM, (), anything)
    stiff = choose_aim(FOOT, FOOT_RADIUS, AHEAD, 0.0, ball, ROOM, (), lambda need: need * [1.0, 0.0, 1.0])
    lacks = [
        abs(solve_contacts(FOOT, FOOT_RADIUS, [aim], 0.0, ball, ROOM).need[0, 1]) for aim in (free, stiff)
    ]
    assert lacks[1] < lacks[0] - 0.02
    assert np.degrees(np.arccos(stiff.direction @ AHEAD)) <= 60.0 + 1e-6


@pytest.mark.parametrize("off, moved", [((0.0, 0.4, 0.3), 0.3), ((0.0, 0.1, 0.1), np.hypot(0.1, 0.1))])
def test_a_ball_comes_straight_towards_the_hands(off, moved):
    hands = np.array([[[-0.1, 0.0, 1.8]] * 2, [[0.1, 0.0, 1.8]] * 2])
    ball = hands.mean(axis=(0, 1)) + off
    place, needs = place_between_hands(hands, 0.05, ball, BallRange(0.3, 0.3))
    assert ball - place == pytest.approx(moved * np.array(off) / np.linalg.norm(off))
    touching = hands[:, 0] + needs
    assert np.linalg.norm(touching - place, axis=1) == pytest.approx([0.16, 0.16])
