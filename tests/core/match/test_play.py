"""What players of a match face beside the ball, who keeps goal, and one plan of the heading for all windows."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.match.pieces.units import build_units
from beyond_mocap.match.play import NEAR_OPPONENT, build_plays
from beyond_mocap.motion.track.match_data import Match, MatchPlayer
from beyond_mocap.synthesis.resolve_plan import resolve_plan


def placed(rows, positions=None) -> Match:
    """A match of 20 s at 5 Hz, of players (id, team, (x, y)) who stand."""
    times = np.arange(100) / 5.0
    paths = np.array([np.tile(place, (100, 1)) for _, _, place in rows], float)
    players = tuple(MatchPlayer(name, team, name, -1, (positions or {}).get(name, "")) for name, team, _ in rows)
    return Match(times=times, players=players, positions=paths, ball=np.full((100, 3), np.nan), length=105.0,
                 width=68.0, fps=5.0, provider="made", periods=((0.0, 20.0),))


ROWS = (
    ("h1", "home", (-48.0, 0.0)), ("h2", "home", (-5.0, 9.0)), ("h3", "home", (0.0, 0.0)), ("h4", "home", (5.0, -20.0)),
    ("a1", "away", (47.0, 1.0)), ("a2", "away", (-8.0, 8.0)), ("a3", "away", (3.0, 2.0)), ("a4", "away", (9.0, 30.0)),
    ("ref", "referee", (2.0, 2.0)),
)


def test_the_nearest_opponent_or_the_goal_is_faced():
    plays = build_plays(placed(ROWS))
    assert {name for name, play in plays.items() if play.is_keeper} == {"h1", "a1"}
    for name, place in [("h3", (3.0, 2.0)), ("a2", (-5.0, 9.0)), ("h4", (52.5, 0.0)), ("a4", (-52.5, 0.0)),
                        ("ref", (3.0, 2.0))]:
        assert np.allclose(plays[name].places, place), name
    assert NEAR_OPPONENT < np.hypot(5.0 - 3.0, 22.0)


def test_a_goalkeeper_whom_the_feed_names_is_one():
    named = build_plays(placed(ROWS, {"h2": "Goalkeeper", "a1": "goalkeeper"}))
    assert {name for name, play in named.items() if play.is_keeper} == {"h2", "a1"}


def test_a_keeper_whom_the_feed_does_not_name_is_found_beside_one_whom_it_does():
    named = build_plays(placed(ROWS, {"h2": "Goalkeeper"}))
    assert {name for name, play in named.items() if play.is_keeper} == {"h2", "a1"}


def test_few_players_have_neither_keeper_nor_goal():
    """The nearest opponent is faced however far, and nothing where there is none: not the middle of the pitch."""
    plays = build_plays(placed((("h1", "home", (0.0, 9.0)), ("a1", "away", (40.0, 0.0)))))
    assert not any(play.is_keeper for play in plays.values()) and np.allclose(plays["h1"].places, (40.0, 0.0))
    assert np.isnan(build_plays(placed((("h1", "home", (0.0, 9.0)),)))["h1"].places).all()


def test_outside_the_periods_no_goal_is_known():
    plays = build_plays(replace(placed(ROWS), periods=((0.0, 10.0),)))
    assert np.allclose(plays["h4"].places[:50], (52.5, 0.0))
    assert np.allclose(plays["h4"].places[60:], (3.0, 2.0))


@pytest.mark.parametrize("fps", [30.0, 25.0])
def test_all_windows_follow_one_plan(library, weaving_plan, fps):
    weaving_plan = replace(weaving_plan, fps=fps)
    whole = resolve_plan(weaving_plan, library)
    plan = replace(weaving_plan, heading_path=whole.plan_heading())
    heading, units = whole.sample_track(fps), build_units(plan, window=8.0, overlap=3.0)
    assert len(units) > 2
    for unit in units:
        part = resolve_plan(unit.plan, library, are_touches_resolved=True).sample_track(fps)
        own = np.interp(part.times, heading.times, heading.heading)
        assert np.abs(np.angle(np.exp(1j * (part.heading - own)))).max() < 1e-3
