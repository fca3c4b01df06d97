"""Parts and words of touches, goal and out, the table of touches: small cases whose answers are plain."""

import csv

import numpy as np
import pytest

from beyond_mocap.ball.tracked.kinds import (
    choose_keeper_kind,
    choose_part,
    choose_touch_kind,
    find_ball_ends,
    find_keepers,
    is_from_touch_line,
)
from beyond_mocap.ball.tracked.solve import SolvedTouch, solve_samples
from beyond_mocap.ball.tracked.touches import choose_players
from beyond_mocap.files.tables import TOUCH_COLUMNS, write_touches


@pytest.mark.parametrize("height, part", [(0.11, "foot"), (0.8, "foot"), (1.2, "chest"), (1.9, "head"), (None, "foot")])
def test_parts_by_height(height, part):
    assert choose_part(height) == part


@pytest.mark.parametrize("before, after, next_, earlier, kind", [
    ((0.0, 1.0), (18.0, 2.0), False, True, "kick"),
    ((-15.0, 0.0), (1.0, 0.5), True, False, "receive"),
    ((1.0, 0.0), (4.0, 0.0), True, True, "dribble"),
    ((16.0, 0.0), (11.0, 5.0), False, False, "deflection"),
])  # fmt: skip
def test_words_by_what_the_ball_does(before, after, next_, earlier, kind):
    assert choose_touch_kind("foot", np.array([*before, 0.0]), np.array([*after, 0.0]), next_, earlier) == kind


@pytest.mark.parametrize("after, next_, kind", [((2.0, 0.5), True, "head"), ((2.0, 0.5), False, "header"),
                                                ((9.0, 0.0), True, "header")])
def test_a_header_that_keeps_the_ball_is_a_reception(after, next_, kind):
    assert choose_touch_kind("head", np.array([-9.0, 0.0, -3.0]), np.array([*after, 0.0]), next_, False) == kind


def test_goal_and_out_are_told_apart():
    times = np.arange(100) * 0.04
    def way(start, velocity):
        return np.array(start) + times[:, None] * np.array(velocity)

    goal = find_ball_ends(times, way([45.0, 1.0, 0.3], [12.0, 0.0, 0.0]), 105.0, 68.0)
    assert [end.kind for end in goal] == ["goal"]
    assert abs(goal[0].time - (52.5 + 0.11 - 45.0) / 12.0) < 1e-6
    assert [end.kind for end in find_ball_ends(times, way([45.0, 1.0, 3.0], [12.0, 0.0, 0.0]), 105.0,
                                               68.0)] == ["goal line"]
    assert [end.kind for end in find_ball_ends(times, way([0.0, 30.0, 0.3], [1.0, 3.0, 0.0]), 105.0,
                                               68.0)] == ["touch line"]
    assert find_ball_ends(times, way([0.0, 0.0, 0.3], [1.0, 3.0, 0.0]), 105.0, 68.0) == []


def test_a_keeper_saves_shots_and_holds_what_is_high():
    shot, lob = np.array([20.0, 0.5, 1.0]), np.array([3.0, 0.0, -2.0])
    assert choose_keeper_kind(np.array([50.0, 1.0, 0.8]), shot, 52.5, True) == ("hand", "save")
    assert choose_keeper_kind(np.array([50.0, 1.0, 0.12]), shot, 52.5, True) == ("foot", "save")
    assert choose_keeper_kind(np.array([45.0, 1.0, 1.6]), lob, 52.5, True) == ("hand", "hand")
    assert choose_keeper_kind(np.array([20.0, 1.0, 1.6]), lob, 52.5, True) is None
    assert choose_keeper_kind(np.array([45.0, 1.0, 0.12]), lob, 52.5, True) is None


def test_keepers_are_those_who_stand_deepest():
    home = np.array([[-48.0, 0.0], [-20.0, 5.0], [-10.0, -5.0], [5.0, 0.0]])
    positions = np.repeat(np.concatenate([home, -home])[:, None], 9, axis=1)
    assert find_keepers(positions, ["home"] * 4 + ["away"] * 4) == {"home": 0, "away": 4}


@pytest.mark.parametrize("place, after, is_thrown", [
    ((10.0, 33.8, 2.0), (5.0, -8.0, 2.0), True), ((10.0, 33.8, 2.0), (5.0, 8.0, 2.0), False),
    ((10.0, 20.0, 2.0), (5.0, -8.0, 2.0), False), ((52.0, 33.8, 0.11), (-2.0, -19.0, 9.0), False),
    ((52.0, 33.8, 2.0), (-2.0, -9.0, 4.0), True), ((10.0, 33.8, 0.11), (-2.0, -29.0, 9.0), False),
])  # fmt: skip
def test_a_throw_leaves_the_touch_line_inward_not_from_a_corner_and_no_faster_than_a_person_throws(place, after,
                                                                                                   is_thrown):
    assert is_from_touch_line(np.array(place), np.array(after), 1.0, (105.0, 68.0)) == is_thrown
    assert not is_from_touch_line(np.array(place), np.array(after), 5.0, (105.0, 68.0))  # kept in at a run


def test_the_ball_over_the_touch_line_comes_back_by_a_throw_in():
    times = np.arange(325) * 0.04
    knots = [(0.0, 0.0, 20.0), (1.0, 0.0, 20.0), (2.5, 5.0, 36.0), (5.0, 5.0, 35.0), (7.0, 5.0, 34.2), (8.2, 8.0, 24.0),
             (9.4, 8.2, 24.0), (11.0, -5.0, 14.0), (13.0, -5.0, 14.0)]  # fmt: skip
    at, x, y = np.array(knots).T
    height = np.interp(times, [0, 6.0, 6.8, 7.0, 7.6, 8.2, 13.0], [0.11, 0.11, 1.9, 2.1, 2.4, 0.2, 0.11])
    ball = np.column_stack([np.interp(times, at, x), np.interp(times, at, y), height])
    ball += np.random.default_rng(0).normal(0.0, 0.02, ball.shape)
    places = np.array([[0.2, 19.8], [5.0, 34.4], [8.3, 23.7], [-5.2, 14.2]])
    solved = solve_samples(times, ball, np.repeat(places[:, None], len(times), axis=1), [f"home_{n}" for n in range(4)])
    assert [(end.kind, end.player) for end in solved.ends] == [("touch line", "home_0")]
    thrown = [touch for touch in solved.touches if touch.kind == "throw-in"]
    assert [(touch.player, touch.part) for touch in thrown] == [("home_1", "hand")]
    assert abs(thrown[0].time - 7.0) < 0.15


def test_of_two_near_players_he_has_it_who_had_it():
    away = np.array([[0.3, 0.5, 0.3], [2.0, 0.45, 2.0]])
    between = np.array([[0.0, 0.6, 0.6], [3.0, 2.5, 2.5]])
    assert choose_players(away, np.array([0.0, 0.5, 1.0]), between).tolist() == [0, 0, 0]


def test_touches_as_a_table(tmp_path):
    touch = SolvedTouch(time=1.25, uncertainty=0.01, player="home_7", part="foot", kind="kick",
                        position=np.array([1.0, 2.0, 0.11]), before=np.zeros(3), after=np.array([9.0, 0.0, 3.0]),
                        confidence=0.9)
    write_touches(tmp_path / "t.csv", [touch])
    with open(tmp_path / "t.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == TOUCH_COLUMNS
    assert float(rows[0]["time_s"]) == 1.25 and rows[0]["player"] == "home_7" and float(rows[0]["after_x_m_s"]) == 9.0
