"""Pitches of sports: lines within their pitch, the same at both ends, and as long as the rules have them."""

import numpy as np
import pytest

from beyond_mocap.appearance.pitch_markings import build_markings
from beyond_mocap.appearance.sports import load_sports
from beyond_mocap.base.settings import find_setting

SPORTS = load_sports()


def measure(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def test_the_settings_list_the_sports_that_there_are():
    choices = find_setting("pitch", "sport").choices
    assert [choice[0] for choice in choices] == list(SPORTS)
    for name, title, size in choices:
        length, width = SPORTS[name].size
        assert SPORTS[name].title == title and size.startswith(f"{length:g} x {width:g} m")


@pytest.mark.parametrize("sport", SPORTS.values(), ids=SPORTS)
def test_lines_lie_on_their_pitch_and_both_ends_are_alike(sport):
    length, width = sport.size
    markings = build_markings(sport, sport.size)
    points = np.concatenate([marking.points for marking in markings])
    assert np.abs(points[:, 0]).max() == pytest.approx(length / 2.0 + sport.behind)
    assert np.abs(points[:, 1]).max() == pytest.approx(width / 2.0)
    seen = [marking for marking in markings if np.ptp(marking.points, axis=0).max() > 1.5]  # not dashes
    places = np.array([(*(marking.points.min(axis=0) + marking.points.max(axis=0)) / 2, measure(marking.points))
                       for marking in seen])
    turned = places * (-1.0, -1.0, 1.0)
    assert all(np.abs(places - row).max(axis=1).min() < 1e-6 for row in turned)
    for marking in markings:
        assert marking.width >= 0.0 and (marking.width or measure(marking.points) < 2.0)
        assert np.all(np.linalg.norm(np.diff(marking.points, axis=0), axis=1) > 1e-4)  # a ribbon needs a direction


def test_lines_are_as_long_as_the_rules_have_them():
    def lengths(name):
        return np.array([measure(marking.points) for marking in build_markings(SPORTS[name], SPORTS[name].size)
                         if marking.width])

    football, handball, basketball = map(lengths, ("football", "handball", "basketball"))
    assert np.isclose(football, 2 * np.pi * 9.15, rtol=1e-3).sum() == 1
    assert np.isclose(football, 2 * 16.5 + 40.32).sum() == 2
    assert np.isclose(handball, np.pi * 6 / 2, rtol=1e-3).sum() == 4
    assert np.isclose(handball, 0.15, atol=1e-3).sum() > 80  # dashes
    assert np.isclose(basketball, 6.75 * np.radians(2 * 77.9), rtol=1e-3).sum() == 2


def test_a_rinks_goal_lines_end_at_its_round_corners():
    rink = SPORTS["ice_hockey"]
    lines = [marking.points for marking in build_markings(rink, rink.size) if len(marking.points) == 2]
    goal_line = next(line for line in lines if np.allclose(line[:, 0], -26.0))
    corner = np.array([-30.0 + rink.rounding, 15.0 - rink.rounding])
    assert np.linalg.norm(goal_line.max(axis=0) - corner) == pytest.approx(rink.rounding)
