"""Goalkeepers: saves follow the ball's way, who is beaten dives and misses, who is not measured stands right."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import check_timeline
from beyond_mocap.ball.tracked.solve import solve_ball
from beyond_mocap.base.errors import InputError
from beyond_mocap.match.goalkeeping.positions import build_keeper_track, fill_keepers, find_keeper_places
from beyond_mocap.match.goalkeeping.saves import MISSED_REACH, SHORT_DIVE, STANDING_REACH
from beyond_mocap.match.goalkeeping.shots import GOAL, OTHER, SAVED, find_shots
from beyond_mocap.match.labels import label_match
from beyond_mocap.match.moments import SHOTS, build_timeline
from beyond_mocap.match.play import find_kept_lines
from beyond_mocap.motion.track.match_data import Match, MatchPlayer

ROWS = (("home_1", -50.0, 0.0), ("home_2", -20.0, 10.0), ("home_3", 0.0, 20.0), ("home_4", 8.0, -9.0),
        ("home_9", 31.6, 0.0),
        ("away_1", 51.0, 0.0), ("away_2", 20.0, 12.0), ("away_3", 5.0, -20.0), ("away_4", 0.0, 8.0))
TIMES = np.arange(200) / 25.0
SHOT_TIME, SPEED = 3.0, 24.0
STRIKES = np.array([32.0, 0.0, 0.11])


def match_of(aside, height=0.5, after=None) -> Match:
    """home_9 shoots at SHOT_TIME past away_1's left hand, `aside` m away and `height` m high; the keeper's touch sends
    it `after` (3,) m/s, None: it goes in.
    """
    plane = np.array([51.0, aside, height])  # the keeper faces -x: their left is -y
    plane[1] = -aside
    way = plane - STRIKES
    arrival = SHOT_TIME + np.linalg.norm(way) / SPEED
    share = np.clip((TIMES - SHOT_TIME) / (arrival - SHOT_TIME), 0.0, None if after is None else 1.0)
    ball = STRIKES + share[:, None] * way
    if after is None:
        ball[:, 0] = np.minimum(ball[:, 0], 54.0)  # the net
    else:
        ball += np.clip(TIMES - arrival, 0.0, 1.5)[:, None] * np.asarray(after)
    players = tuple(MatchPlayer(name, name.partition("_")[0], name, -1) for name, _, _ in ROWS)
    paths = np.array([np.tile([x, y], (len(TIMES), 1)) for _, x, y in ROWS])
    dives = np.clip((TIMES - arrival + 0.4) / 0.4, 0.0, 1.0)
    paths[5, :, 1] = -0.8 * aside * dives if after is not None else 0.0
    ball += np.random.default_rng(1).normal(0.0, 0.02, ball.shape)
    ball[:, 2] = np.maximum(ball[:, 2], 0.11)
    return Match(times=TIMES, players=players, positions=paths, ball=ball, length=105.0, width=68.0, fps=25.0,
                 provider="planted", periods=((0.0, TIMES[-1]),))


def keeper_moments(match):
    return [one for one in label_match(match, solve_ball(match)).players["away_1"] if one.end is None]


@pytest.mark.parametrize("aside, height, after, expected", [
    (0.1, 0.3, (0.0, 0.0, 0.0), "catchb low"),
    (0.2, 1.1, (-0.5, 0.0, 0.0), "catchb middle"),
    (0.5 * (STANDING_REACH + SHORT_DIVE), 0.4, (0.0, 0.0, 0.0), "catchb dive short_duration low left"),
    (-0.5 * (STANDING_REACH + SHORT_DIVE), 1.6, (-6.0, -6.0, 0.0), "stomp dive short_duration high right"),
    (2.4, 1.5, (-5.0, 8.0, 0.0), "stomp dive long_duration high left"),
])
def test_a_save_goes_where_the_ball_goes(aside, height, after, expected):
    moments = keeper_moments(match_of(aside, height, after))
    assert [(" ".join(one.labels), one.avoid, one.source) for one in moments] == [(expected, (), SHOTS)]


def test_a_beaten_keeper_dives_and_misses():
    match = match_of(1.6, 0.5)
    (shot,) = find_shots(match, solve_ball(match), find_kept_lines(match))
    assert (shot.end, shot.shooter, shot.keeper) == (GOAL, "home_9", "away_1")
    assert shot.lateral == pytest.approx(1.6, abs=0.15) and shot.place[0] == pytest.approx(51.0, abs=0.3)
    (moment,) = keeper_moments(match)
    assert moment.labels == ("stomp", "dive", "short_duration", "low", "left") and moment.avoid == ("touch",)
    assert moment.time == pytest.approx(SHOT_TIME + 19.0 / SPEED, abs=0.06)
    assert not keeper_moments(match_of(MISSED_REACH + 0.6, 0.5))  # nobody dives for that one


@pytest.mark.parametrize("moved, dives", [(-0.8, 1), (0.2, 1), (0.8, 0)])
def test_a_keeper_whose_track_goes_the_other_way_dives_no_more(moved, dives):
    match = match_of(1.6, 0.5)  # to their left, -y
    positions = match.positions.copy()
    positions[5, :, 1] = moved * np.clip((TIMES - SHOT_TIME) / 0.6, 0.0, 1.0)
    assert len(keeper_moments(replace(match, positions=positions))) == dives


def test_a_keeper_is_set_before_a_shot_that_nobody_touches():
    match = match_of(4.4, 0.5)  # wide
    (shot,) = find_shots(match, solve_ball(match), find_kept_lines(match))
    labels = label_match(match, solve_ball(match))
    (ready,) = labels.players["away_1"]
    assert shot.end == OTHER and ready.labels == ("ready",) and ready.time < SHOT_TIME < ready.end
    assert not labels.players["home_1"]
    for player in match.players:
        check_timeline(build_timeline(labels.players[player.id]), start=0.0, end=8.0)


@pytest.mark.parametrize("pace, expected", [(0.2, ["ready"]), (1.0, ["shuffle"]), (3.0, [])])
def test_a_keeper_who_moves_is_set_in_steps_and_a_running_one_runs(pace, expected):
    match = match_of(4.4, 0.5)
    positions = match.positions.copy()
    positions[5, :, 1] += pace * (TIMES - SHOT_TIME)
    match = replace(match, positions=positions)
    assert [word for one in label_match(match, solve_ball(match)).players["away_1"] for word in one.labels] == expected


def test_passes_of_the_own_team_slow_balls_and_wide_ones_are_no_shots():
    match = match_of(0.1, 0.3, (0.0, 0.0, 0.0))
    solved, lines = solve_ball(match), find_kept_lines(match)
    assert [shot.end for shot in find_shots(match, solved, lines)] == [SAVED]
    others = {"player": "away_2"}, {"after": [8.0, 0.0, 0.0]}, {"after": [20.0, 14.0, 0.0]}, {"kind": "receive"}
    for changed in others:
        touches = tuple(replace(one, **changed) if one.player == "home_9" else one for one in solved.touches)
        assert not find_shots(match, replace(solved, touches=touches), lines)


def test_the_keeper_stands_between_ball_and_goal():
    ball = np.array([[40.0, 8.0], [35.0, -12.0], [0.0, 0.0], [-40.0, 20.0], [52.0, 10.0]])
    places = find_keeper_places(ball, 52.5)
    out = np.linalg.norm(places - [52.5, 0.0], axis=1)
    own, asked = (np.arctan2(near[:, 1], 52.5 - near[:, 0]) for near in (places[:2], ball[:2]))
    assert (own / asked > 0.9).all()  # on the line of a near ball
    assert (np.abs(places[:, 1]) <= np.abs(ball[:, 1])).all() and (places[:, 0] < 52.5).all()
    assert out[2] > out[0] and out[3] > out[2]  # farther out, the farther the ball
    assert np.allclose(find_keeper_places(ball * [-1.0, 1.0], -52.5), places * [-1.0, 1.0])


def test_a_keeper_who_is_missing_is_placed_and_a_measured_one_stays():
    match = match_of(0.1, 0.3, (0.0, 0.0, 0.0))
    long = replace(match, times=np.arange(200) / 10.0, periods=((0.0, 19.9),), fps=10.0)
    lines = find_kept_lines(long)
    assert fill_keepers(long, lines) == (long, ())
    paths = np.array(long.positions)
    paths[5, 60:140] = np.nan
    gap = replace(long, positions=paths)
    filled, notes = fill_keepers(gap, lines)
    known = np.isfinite(paths)
    assert np.array_equal(filled.positions[known], paths[known]) and np.isfinite(filled.positions).all()
    assert len(notes) == 1 and "away_1: 6 to 13.9 s" in notes[0]
    steps = np.linalg.norm(np.diff(filled.positions[5], axis=0), axis=1) * 10.0
    assert steps.max() < 7.0 and (filled.positions[5, 60:140, 0] > 40.0).all()
    paths[:, 60:140] = np.nan  # a short gap is the business of the track
    short = replace(long, positions=np.where(np.arange(200)[None, :, None] // 20 == 4, np.nan, long.positions))
    assert fill_keepers(short, lines)[0] is short


def test_a_keeper_without_a_match():
    ball = np.column_stack([np.linspace(10.0, 40.0, 200), np.full(200, 5.0), np.full(200, 0.11)])
    track = build_keeper_track(TIMES, ball, 52.5)
    assert track.name == "keeper" and np.allclose(track.ball, ball)
    assert np.linalg.norm(track.positions - find_keeper_places(ball[:, :2], 52.5), axis=1).max() < 0.6
    with pytest.raises(InputError, match="no known place"):
        build_keeper_track(TIMES, np.full((200, 3), np.nan), 52.5)
