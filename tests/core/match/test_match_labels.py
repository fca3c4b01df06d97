"""Words of everybody: from touches of a made match, and their text form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.annotation import check_timeline
from beyond_mocap.annotation.event_labels import TABLE, read_event_labels
from beyond_mocap.ball.tracked.solve import SolvedTouch, solve_ball
from beyond_mocap.base.errors import InputError
from beyond_mocap.match.labels import MIN_CONFIDENCE, build_touch_moment, find_dribbles, label_match
from beyond_mocap.match.moments import (
    MIN_DISTANCE_SECONDS,
    TOUCHES,
    USER,
    Moment,
    build_timeline,
    is_edited,
    read_labels,
    select_separate_moments,
    write_labels,
)
from beyond_mocap.motion.track.match_data import Match, MatchPlayer, Team
from beyond_mocap.synthetic.ground_truth.synthetic_match import build_match, sample_feed


def match_of(feed):
    """A planted feed as `read_match` would give it."""
    players = tuple(MatchPlayer(id_, team, id_, i % 11 + 1) for i, (id_, team) in enumerate(zip(feed.ids, feed.teams)))
    return Match(
        times=feed.times, players=players, positions=feed.positions, ball=feed.ball, length=feed.length,
        width=feed.width, fps=feed.fps, provider="planted", periods=((float(feed.times[0]), float(feed.times[-1])),),
        teams=(Team("home"), Team("away")),
    )  # fmt: skip


@pytest.fixture(scope="module")
def planted():
    """A made match of 40 s, what was made of it, and the words."""
    truth = build_match(40.0, seed=3)
    match = match_of(sample_feed(truth, noise=0.03))
    solved = solve_ball(match)
    return truth, match, solved, label_match(match, solved)


def touch(kind="kick", part="foot", height=0.11, time=1.0, after=(10.0, 0.0, 0.0), sure=0.9):
    return SolvedTouch(time=time, uncertainty=0.01, player="a", part=part, kind=kind, position=[0.0, 0.0, height],
                       before=[0.0, 0.0, 0.0], after=after, confidence=sure)


def running(speed):
    times = np.arange(50) / 25
    return times, np.column_stack([times * speed, np.zeros(50)])


@pytest.mark.parametrize("kind, part, height, speed, known, expected", [
    ("kick", "foot", 0.11, 0.5, True, "kick standing low"),
    ("kick", "foot", 0.9, 5.0, True, "kick running high"),
    ("kick", "foot", 0.9, 5.0, False, "kick running"),
    ("receive", "foot", 0.2, 5.0, True, "receive foot low"),
    ("receive", "foot", 0.2, 5.0, False, "receive foot"),
    ("header", "head", 1.8, 0.0, True, "header standing"),
    ("header", "head", 2.3, 4.0, True, "header running jump"),
    ("head", "head", 1.8, 0.0, True, "receive head standing"),
    ("chest", "chest", 1.2, 0.0, True, "receive body"),
    ("throw-in", "hand", 2.0, 0.0, False, "throwb high"),
    ("hand", "hand", 1.0, 0.0, True, "catchb middle"),
    ("save", "hand", 1.8, 0.0, True, "stomp high"),
    ("dribble", "foot", 0.1, 3.0, True, None),
    ("deflection", "foot", 0.1, 3.0, True, None),
])
def test_a_touch_gets_the_words_of_the_table(kind, part, height, speed, known, expected):
    found = build_touch_moment(touch(kind, part, height), *running(speed), known, read_event_labels())
    assert (found and " ".join(found.labels)) == expected


def test_a_save_that_holds_the_ball_is_a_catch():
    found = build_touch_moment(touch("save", "hand", 0.3, after=(0.5, 0, 0)), *running(0.0), True, read_event_labels())
    assert found.labels == ("catchb", "low")


def test_most_planted_touches_come_back_as_words_of_their_player(planted):
    truth, match, solved, words = planted
    wanted = [one for one in truth.touches if one.label in ("kick", "receive", "header", "throw-in")]
    named = {"kick": "kick", "receive": "receive", "header": "header", "throw-in": "throwb"}
    found = sum(
        any(named[one.label] in m.labels and abs(m.time - one.time) < 0.15 for m in words.players[one.player])
        for one in wanted
    )
    assert len(wanted) >= 15 and found >= 0.6 * len(wanted)
    assert set(words.players) == set(truth.ids) and all(
        m.source == TOUCHES and MIN_CONFIDENCE <= m.confidence <= 1.0 for ms in words.players.values() for m in ms
    )
    for player in match.players:
        check_timeline(build_timeline(words.players[player.id]), start=0.0, end=40.0)


def test_without_a_ball_nobody_has_words(planted):
    assert not any(label_match(planted[1], None).players.values())


def test_key_moments_of_one_player_keep_apart_and_the_surer_one_stays():
    sure, unsure = Moment(
        time=1.0, labels=("kick",), source=TOUCHES, confidence=0.9,
    ), Moment(time=1.3, labels=("kick",), source=TOUCHES, confidence=0.5)
    other = Moment(time=1.0 + MIN_DISTANCE_SECONDS, labels=("receive", "foot"), source=TOUCHES, confidence=0.4)
    assert select_separate_moments([unsure, other, sure]) == [sure, other]


def test_touches_in_a_row_are_one_dribble():
    kinds = [(1.0, "receive"), (1.7, "dribble"), (2.5, "dribble"), (3.2, "kick"), (4.0, "receive"), (5.5, "kick")]
    (found,) = find_dribbles([touch(kind, time=time) for time, kind in kinds])
    assert (found.time, found.end, found.labels) == (1.0, 3.2, ("dribble",))
    assert find_dribbles([touch("receive", time=1.0), touch("kick", time=2.5)]) == []


def test_a_timeline_is_cut_to_its_span():
    moments = [Moment(
        time=1.0, labels=("kick",), source=TOUCHES, confidence=1.0,
    ), Moment(time=2.0, labels=("dribble",), source=TOUCHES, confidence=1.0, end=6.0)]
    timeline = build_timeline(moments, 1.5, 4.0)
    assert not timeline.keys and [(span.start, span.end) for span in timeline.spans] == [(2.0, 4.0)]


# --- the text form


def test_words_come_back_from_their_file(tmp_path, planted):
    words = planted[3]
    player = max(words.players, key=lambda one: len(words.players[one]))
    moments = words.players[player]
    write_labels(tmp_path / "p.txt", player, moments)
    assert not is_edited(tmp_path / "p.txt") and not is_edited(tmp_path / "none.txt")
    assert read_labels(tmp_path / "p.txt", moments) == moments
    assert {m.source for m in read_labels(tmp_path / "p.txt")} == {USER}


def test_edits_are_seen_and_kept(tmp_path):
    moments = (Moment(
        time=1.5, labels=("kick", "low"), source=TOUCHES, confidence=0.75,
    ), Moment(time=3.0, labels=("header",), source=TOUCHES, confidence=0.5))
    file = tmp_path / "p.txt"
    write_labels(file, "home_7", moments)
    text = file.read_text()
    assert "1.5 kick low  # touches 0.75" in text
    file.write_text(text.replace("3 header  # touches 0.50\n", "3.2 header jump\n"))
    assert is_edited(file)
    kept, changed = read_labels(file, moments)
    assert kept == moments[0] and changed == Moment(time=3.2, labels=("header", "jump"), source=USER, confidence=1.0)
    file.write_bytes(text.replace("\n", "\r\n").encode())  # another editor's line ends are no edit
    assert not is_edited(file)
    file.write_text("1.0 kcik\n")
    assert is_edited(file)
    with pytest.raises(InputError, match=r"p\.txt:1: the label 'kcik'.*kick"):
        read_labels(file)


@settings(deadline=None, max_examples=60)
@given(st.one_of(st.binary(max_size=80), st.text("0123456789. -#kick[]\n", max_size=80).map(str.encode)))
def test_any_file_of_words_is_read_or_refused(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("fuzz") / "p.txt"
    file.write_bytes(content)
    try:
        assert is_edited(file) in (True, False)
        read_labels(file)
    except InputError as error:
        assert "\n" not in str(error)


# --- the table


def test_the_most_telling_row_counts(tmp_path):
    file = tmp_path / "own.csv"
    file.write_text("# mine\nkind,part,detail,words\npass,,,kick\npass,head,,header {jump}\npass,,throw-in,throwb\n")
    table = read_event_labels(file)
    assert table.find_labels("pass") == table.find_labels("pass", "chest") == ("kick",)
    assert table.find_labels("pass", "head", placeholders={"jump": "jump"}) == ("header", "jump")
    assert table.find_labels("pass", "head") == ("header",)
    assert table.find_labels("pass", "head", ["throw-in"]) == ("throwb",)
    assert table.find_labels("shot") == ()


@pytest.mark.parametrize("text, part", [
    ("", "the table is empty"),
    ("kind,words\n", ":1: columns 'kind,words'"),
    ("kind,part,detail,words\n", "the table is empty"),
    ("kind,part,detail,words\npasses,,,kick\n", ":2: kind 'passes'"),
    ("kind,part,detail,words\npass,knee,,kick\n", ":2: part 'knee'"),
    ("kind,part,detail,words\n\n# x\npass,,,kcik\n", ":4: the label 'kcik'"),
    ("kind,part,detail,words\npass,,,kick {foot}\n", ":2: {foot}"),
    ("kind,part,detail,words\npass,,,kick\npass,,,header\n", ":3: pass, ,  is also in line 2"),
    ("kind,part,detail,words\npass,,kick\n", ":2: 3 cells"),
])
def test_mistakes_in_a_table_get_one_line(tmp_path, text, part):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_event_labels(tmp_path / "t.csv")
    assert " ".join(part.split()) in str(caught.value) and "\n" not in str(caught.value)


def test_our_own_table_is_read_and_own_words_may_be_added(tmp_path):
    assert len(read_event_labels().rows) > 20 and TABLE.is_file()
    (tmp_path / "t.csv").write_text("kind,part,detail,words\npass,,,rabona\n")
    assert read_event_labels(tmp_path / "t.csv", ["rabona"]).find_labels("pass") == ("rabona",)
