"""Two players, one ball: the nearest opponent who has it ahead reaches and misses, and nobody else."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.event_labels import read_event_labels
from beyond_mocap.ball.tracked.solve import SolvedTouch
from beyond_mocap.files.event_data import MatchEvent
from beyond_mocap.match.duels import APART_SECONDS, EVENT_REACH, REACH, find_blocks, find_duels, label_lost_duels
from beyond_mocap.match.event_clock import AlignedEvents
from beyond_mocap.match.labels import build_touch_moment
from beyond_mocap.match.moments import DUELS, build_timeline, read_labels, write_labels
from beyond_mocap.motion.track.match_data import Match, MatchPlayer

TIMES = np.arange(250) / 25.0


def match_of(**players) -> Match:
    """A match of 10 s; home_x or away_x = (place at 5 s, velocity)."""
    paths = [np.asarray(place, float) + (TIMES[:, None] - 5.0) * velocity for place, velocity in players.values()]
    listed = tuple(MatchPlayer(name, name.partition("_")[0], name, -1) for name in players)
    return Match(times=TIMES, players=listed, positions=np.array(paths), ball=np.zeros((250, 3)), length=105.0,
                 width=68.0, fps=25.0, provider="planted", periods=((0.0, 10.0),))


def touch(player="home_1", time=5.0, part="foot", kind="kick", height=0.11, confidence=0.9) -> SolvedTouch:
    return SolvedTouch(time=time, uncertainty=0.01, player=player, part=part, kind=kind, position=[0.0, 0.0, height],
                       before=[0.0, 0.0, 0.0], after=[9.0, 0.0, 0.0], confidence=confidence)


STILL = np.zeros(2)
WINNER = ((-0.4, 0.0), STILL)


def losers(match, *touches, **more):
    return [duel.loser for duel in find_duels(match, touches, **more)]


def test_the_nearest_opponent_in_reach_loses():
    match = match_of(home_1=WINNER, away_1=((0.9, 0.0), STILL), away_2=((0.0, 0.6), STILL), home_2=((0.2, 0.0), STILL))
    (duel,) = find_duels(match, [touch()])
    assert (duel.winner, duel.loser, duel.kind, duel.time) == ("home_1", "away_2", "tackle", 5.0)
    assert duel.distance == pytest.approx(0.6)


@pytest.mark.parametrize("place, velocity, expected", [
    ((REACH - 0.1, 0.0), STILL, True),
    ((REACH + 0.1, 0.0), STILL, False),
    ((0.8, 0.0), (-4.0, 0.0), True),  # they run at the ball
    ((0.8, 0.0), (4.0, 0.0), False),  # they have run past it
    ((0.8, 0.0), (1.0, 0.0), True),  # slow enough to turn
])
def test_who_reaches(place, velocity, expected):
    assert bool(losers(match_of(home_1=WINNER, away_1=(place, np.array(velocity))), touch())) == expected


def test_keepers_throw_ins_doubtful_touches_and_who_touch_it_themselves_are_left_out():
    match = match_of(home_1=WINNER, away_1=((0.7, 0.0), STILL))
    assert losers(match, touch()) == ["away_1"]
    assert not losers(match, touch(), keepers=["away_1"])
    assert not losers(match, touch(kind="throw-in", part="hand"))
    assert not losers(match, touch(confidence=0.2)) and not losers(match, touch(player=""))
    assert not losers(match, touch(), touch("away_1", time=5.3))
    assert losers(match, touch(), touch("away_1", time=5.8))[0] == "away_1"


def test_nobody_lunges_at_each_touch_of_a_dribble():
    match = match_of(home_1=WINNER, away_1=((0.7, 0.0), STILL))
    times = np.arange(1.0, 9.0, 0.7)
    found = find_duels(match, [touch(time=time, kind="dribble") for time in times])
    assert len(found) >= 3 and np.diff([duel.time for duel in found]).min() >= APART_SECONDS


def test_an_event_of_the_loser_reaches_farther():
    match = match_of(home_1=WINNER, away_1=((EVENT_REACH - 0.2, 0.0), STILL))
    event = MatchEvent(time=5.4, period=1, player="away_1", team="away", kind="tackle", details=("sliding", "lost"))
    aligned = AlignedEvents(events=(event,), times=np.array([5.4]), touches=np.array([-1]), clocks={})
    assert not losers(match, touch())
    (duel,) = find_duels(match, [touch()], aligned=aligned)
    (moment,) = label_lost_duels([duel], "away_1", read_event_labels(), {})
    assert duel.confidence == pytest.approx(0.9) and moment.labels[:2] == ("tackle", "slide")


@pytest.mark.parametrize("part, height, gait, expected", [
    ("foot", 0.11, "standing", ("tackle", "block")),
    ("foot", 0.11, "running", ("receive", "foot", "low")),
    ("head", 1.9, "standing", ("header", "standing", "jump")),
])
def test_the_loser_reaches_with_what_the_ball_asks_for_and_misses(part, height, gait, expected, tmp_path):
    match = match_of(home_1=WINNER, away_1=((0.7, 0.0), STILL))
    duels = find_duels(match, [touch(part=part, height=height)])
    assert not label_lost_duels(duels, "home_1", read_event_labels(), {})
    (moment,) = label_lost_duels(duels, "away_1", read_event_labels(), {5.0: {"gait": gait}})
    assert (moment.labels, moment.avoid, moment.source) == (expected, ("touch",), DUELS)
    (key,) = build_timeline([moment]).keys
    assert key.misses_ball
    write_labels(tmp_path / "a.txt", "away_1", [moment])
    assert read_labels(tmp_path / "a.txt", [moment]) == (moment,)
    assert read_labels(tmp_path / "a.txt")[0].avoid == ("touch",)


def test_the_side_is_that_of_a_ball_beside_the_way():
    for across, side in ((0.6, "left"), (-0.6, "right"), (0.0, "")):
        match = match_of(home_1=WINNER, away_1=((-0.7, -across), np.array([4.0, 0.0])))
        assert [duel.side for duel in find_duels(match, [touch()])] == [side]


@pytest.mark.parametrize("player, seconds, changes, expected", [
    ("away_1", 0.2, {}, True),
    ("away_1", 0.5, {}, False),  # time for a swing
    ("home_2", 0.2, {}, False),  # a pass
    ("away_1", 0.2, {"after": [22.0, 0.0, 0.0]}, False),  # struck
    ("away_1", 0.2, {"before": [8.0, 0.0, 0.0]}, False),
    ("away_1", 0.2, {"position": [3.0, 0.0, 0.9]}, False),
])
def test_a_foot_that_a_kick_hits_at_once_blocks_it(player, seconds, changes, expected):
    match = match_of(home_1=WINNER, home_2=((3.0, 0.0), STILL), away_1=((3.0, 0.0), STILL))
    values = {"before": [15.0, 0.0, 0.0], "after": [-6.0, 0.0, 0.0], **changes}
    hit = replace(touch(player, time=5.0 + seconds), **{name: np.array(value) for name, value in values.items()})
    assert find_blocks(match, [touch(), hit]) == ({1} if expected else set())


@pytest.mark.parametrize("speed, expected", [(0.0, ("tackle", "block")), (4.0, ("receive", "foot", "low"))])
def test_who_blocks_a_kick_stands_firm_or_takes_it_in_the_run(speed, expected):
    path = np.array([3.0, 0.0]) + (TIMES[:, None] - 5.0) * [speed, 0.0]
    moment = build_touch_moment(touch("away_1"), TIMES, path, True, read_event_labels(), is_block=True)
    assert moment.labels == expected
