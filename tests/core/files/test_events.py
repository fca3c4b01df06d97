"""Events in: every provider's form through kloppy, plain tables, and whose they are."""

import json
import pathlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.annotation.event_labels import KINDS
from beyond_mocap.annotation.striking import BODY_PARTS
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.event_data import EventPlayer, assign_players
from beyond_mocap.files.event_providers import detect_event_provider, find_second_file
from beyond_mocap.files.events import read_events
from beyond_mocap.motion.track.match_data import Match, MatchPlayer

PLAYERS = (
    MatchPlayer("h7", "home", "Ana Núñez", 7), MatchPlayer("h9", "home", "Bo Berg", 9),
    MatchPlayer("a7", "away", "Cy Dahl", 7), MatchPlayer("a3", "away", "Di Berg", 3),
    MatchPlayer("r", "referee", "R", -1),
)  # fmt: skip


def made_match():
    """Two halves of 100 s of four players and a referee; home keeps -x, then +x."""
    times = np.concatenate([np.arange(0, 100, 0.1), np.arange(110, 210, 0.1)])
    half = np.where(times < 105, 1.0, -1.0)
    x = np.array([-30.0, -20.0, 30.0, 20.0, 0.0])[:, None] * half
    positions = np.stack([x, np.zeros_like(x)], axis=2)
    ball = np.zeros((len(times), 3))
    return Match(times=times, players=PLAYERS, positions=positions, ball=ball, length=100.0, width=64.0, fps=10.0,
                 provider="made", periods=((0.0, 99.9), (110.0, 209.9)))


def files():
    """kloppy's own test files."""
    kloppy = pytest.importorskip("kloppy")
    folder = pathlib.Path(kloppy.__file__).parent / "tests" / "files"
    if not (folder / "opta_f24.xml").is_file():
        pytest.skip("this kloppy comes without its own test files")
    return folder


@pytest.mark.parametrize("name, meta, provider, count", [
    ("opta_f24.xml", None, "opta", 39),
    ("opta_f73.xml", "opta_f7.xml", "opta", 39),
    ("sportec_events.xml", None, "sportec", 29),
    ("wyscout_events_v2.json", None, "wyscout", 1835),
    ("datafactory_events.json", None, "datafactory", 1027),
    ("statsperform_event_ma3.xml", None, "statsperform", 1643),
    ("metrica_events.json", "epts_metrica_metadata.xml", "metrica", 3594),
])
def test_every_provider_is_known_by_its_form(name, meta, provider, count):
    folder = files()
    events = read_events(folder / name, meta and folder / meta)
    assert events.provider == provider and len(events.events) == count
    for event in events.events:
        assert event.kind in KINDS and event.part in ("", *BODY_PARTS) and event.side in ("", "left", "right")
        assert event.period >= 1 and np.isfinite(event.time) and event.team in ("home", "away", "")
    clock = [(event.period, event.time) for event in events.events]
    assert clock == sorted(clock) and any(event.kind == "pass" and event.player for event in events.events)


def test_a_provider_s_feet_hands_and_heads_are_kept():
    events = read_events(files() / "statsperform_event_ma3.xml").events
    kinds = {(event.kind, event.part, event.side) for event in events}
    assert {("pass", "foot", "right"), ("pass", "foot", "left"), ("pass", "head", ""), ("pass", "hand", "")} <= kinds
    throws = [event for event in events if "throw-in" in event.details]
    assert throws and all(event.part == "hand" for event in throws)


def test_a_value_of_another_kind_that_kloppy_takes_is_refused_in_one_line(tmp_path):
    names = "statsperform_event_ma3.json", "statsperform_event_ma1.json"
    events, meta = (tmp_path / name for name in names)
    events.write_bytes((files() / names[0]).read_bytes())
    content = json.loads((files() / names[1]).read_text("utf-8"))
    for player in content["liveData"]["lineUp"][0]["player"]:
        player["shirtNumber"] = [1]
    meta.write_text(json.dumps(content))
    with pytest.raises(InputError, match=rf"of another kind, than expected, in it or in {meta.name}; expected events"):
        read_events(events, meta)


def test_a_second_file_that_is_missing_is_asked_for(tmp_path):
    (tmp_path / "g_f24.xml").write_bytes((files() / "opta_f24.xml").read_bytes())
    with pytest.raises(InputError, match="the second file of Opta is missing; expected a file such as g_f7.xml"):
        read_events(tmp_path / "g_f24.xml")


@pytest.mark.parametrize("name, meta", [
    ("opta_f24.xml", "opta_f7.xml"), ("sportec_events.xml", "sportec_meta.xml"),
    ("metrica_events.json", "epts_metrica_metadata.xml"),
    ("statsperform_event_ma3.json", "statsperform_event_ma1.json"),
    ("statsbomb_event.json", "statsbomb_lineup.json"), ("impect_events.json", "impect_lineups.json"),
])
def test_a_second_file_is_known_by_its_form_too(tmp_path, name, meta):
    (tmp_path / f"one{name[-5:]}").write_bytes((files() / name).read_bytes()[:20000])
    (tmp_path / f"two{meta[-5:]}").write_bytes((files() / meta).read_bytes())
    found = find_second_file(tmp_path / f"one{name[-5:]}", detect_event_provider(tmp_path / f"one{name[-5:]}"), None)
    assert found == tmp_path / f"two{meta[-5:]}"


def test_events_of_another_match_are_refused():
    with pytest.raises(InputError, match="are not in the tracking; expected events of the same match"):
        read_events(files() / "opta_f24.xml", match=made_match())


def test_events_with_neither_numbers_nor_names_are_told_and_left_out():
    """Wyscout 2 has the provider's ids alone, so that nothing says whether they are of another match."""
    events = read_events(files() / "wyscout_events_v2.json", match=made_match())
    (note,) = events.notes
    assert "players cannot be assigned" in note and "neither shirt numbers nor names" in note
    assert len(events.events) > 100 and not any(event.player for event in events.events)


TABLE = """time_s,type,player,detail,success,x,y
1.5,pass,home_7,right_foot/chipped,True,-3,2
2.0,header,away 3,,,,
115.0,takeon,Bo Berg,,False,,
120.0,pass,h7,unspecified/throw_in,,,
121.0,out,,,,,
"""


def test_the_plain_table_gets_the_match_s_players_and_periods(tmp_path):
    (tmp_path / "e.csv").write_text(TABLE)
    events = read_events(tmp_path / "e.csv", match=made_match())
    first, head, taken, thrown, out = events.events
    assert (first.time, first.period, first.player, first.kind, first.part, first.side) == (
        1.5, 1, "h7", "pass", "foot", "right",
    )
    assert first.success is True and first.place == (-3.0, 2.0) and np.isnan(head.place).all()
    assert (head.player, head.team, head.part) == ("a3", "away", "head")
    assert (taken.player, taken.kind, taken.period, taken.time) == ("h9", "take-on", 2, 5.0)
    assert (thrown.part, thrown.details) == ("hand", ("throw-in",)) and (out.player, out.kind) == ("", "out")


@pytest.mark.parametrize("text, part", [
    ("", "the file is empty"),
    ("hello\n", "choose the provider, or write a CSV with time_s,type,player"),
    ("time_s,type\n1,pass\n", "no column player"),
    ("time_s,type,player\n", "no events"),
    ("time_s,type,player\nx,pass,home_7\n", ":2: time_s 'x'"),
    ("time_s,type,player,part\n1,pass,home_7,knee\n", ":2: part 'knee'"),
    ("time_s,type,player\n1,pass,home_20\n2,pass,home_21\n",
     "2 of 2 players (home_20, home_21) are not in the tracking"),
])
def test_mistakes_get_one_line(tmp_path, text, part):
    (tmp_path / "e.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_events(tmp_path / "e.csv", match=made_match())
    assert part in str(caught.value) and "\n" not in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        read_events(tmp_path / "none.csv")
    with pytest.raises(InputError, match="one of opta"):
        read_events(tmp_path / "e.csv", provider="fifa")


NEARLY = st.text("0123456789.,-pas home_\n\"", max_size=120).map(str.encode)


@settings(deadline=None, max_examples=60)
@given(st.one_of(st.binary(max_size=120), NEARLY))
def test_any_content_is_read_or_refused(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("fuzz") / "e.csv"
    file.write_bytes(b"time_s,type,player\n" + content)
    try:
        read_events(file, match=made_match())
    except InputError as error:
        assert "\n" not in str(error)


def test_metrica_s_table_of_events_is_read(tmp_path):
    head = (
        "Team,Type,Subtype,Period,Start Frame,Start Time [s],End Frame,End Time [s],From,To,Start X,Start Y,End X,End Y"
    )
    one = "Away,PASS,HEAD,1,1,2.5,2,2.6,Player7,Player3,0.6,0.25,0.7,0.2"
    other = "Home,BALL LOST,,2,9,2800,9,2800,Player9,,,,,"
    duel = "Away,CHALLENGE,AERIAL-LOST,1,3,3.5,3,3.5,Player3,,0.5,0.5,,"
    (tmp_path / "e.csv").write_text("\n".join([head, one, duel, other, ""]))
    first, aerial, second = read_events(tmp_path / "e.csv", match=made_match()).events
    assert (first.player, first.kind, first.part, first.time) == ("a7", "pass", "head", 2.5)
    np.testing.assert_allclose(first.place, (10.0, 16.0))
    assert (aerial.player, aerial.kind, aerial.details) == ("a3", "aerial", ("lost",))
    assert (second.player, second.period, second.time) == ("h9", 2, 0.0)


def test_players_are_found_by_id_number_or_name_and_teams_may_be_swapped():
    match = made_match()
    asked = [EventPlayer("h7"), EventPlayer("x", "away", 3), EventPlayer("y", "home", -1, "ana nunez"),
             EventPlayer("z", "home", 30, "Nobody")]
    found, notes = assign_players(asked, match)
    assert [found.get(who) for who in asked] == [("h7", "home"), ("a3", "away"), ("h7", "home"), None]
    assert "1 of 4 players" in notes[0]
    swapped = [EventPlayer("1", "home", 3), EventPlayer("2", "away", 9)]
    found, notes = assign_players(swapped, match)
    assert [found[who][0] for who in swapped] == ["a3", "h9"] and "exchanged" in notes[0]
    assert EventPlayer.from_text("away_11") == EventPlayer("away_11", "away", 11, "away_11")
