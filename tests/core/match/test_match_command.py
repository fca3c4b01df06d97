"""The verb `match`: what it makes, and that everything wrong is one clear line and leaves nothing behind."""

import json
import shutil
from pathlib import Path

import pytest

from beyond_mocap.base import memory
from beyond_mocap.cli.matching import remove_option
from beyond_mocap.match.folder import read_state
from tests.core.match.small_match import LIBRARY, SMALL


@pytest.fixture
def match(run, sample_cache, tmp_path):
    """match(*more, **options) -> as run; by default a second of one player of the small match, to tmp_path/out."""

    def call(*more, **options):
        options = {"tracking": SMALL / "small.dat", "library": LIBRARY, "cache": sample_cache, "out": tmp_path / "out",
                   "from": 4, "to": 6, "players": "home_7", "workers": 1, **options}  # fmt: skip
        pairs = [part for name, value in options.items() if value is not None for part in (f"--{name}", value)]
        return run("match", *pairs, *more)

    return call


def test_a_player_and_the_ball(match, tmp_path):
    status, out, error = match("--json", "--no-figures")
    told = [json.loads(line) for line in error]
    shares = [line["progress"] for line in told if "progress" in line]
    assert status == 0 and "1 of 1 players, 2.0 s" in out and shares == sorted(shares) and shares[-1] > 0.9
    assert any("small_meta.xml is used" in line.get("note", "") for line in told)
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert files == [".work", "annotations", "ball.csv", "home_7.take.npz", "match.json"]
    assert read_state(tmp_path / "out")["status"] == "done"
    status, _, error = match("--no-figures", to=7)
    assert status == 2 and "holds the results of another request (its end time differs)" in error[0]


def test_a_match_that_needs_more_memory_than_is_free_is_refused_before_it_begins(match, tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "read_free_bytes", lambda: 1e9)
    status, _, error = match(workers=4)
    assert status == 2 and "small.dat: this needs about 1.6 GB, 1.0 are free; use fewer workers, or a" in error[-1]
    assert not (tmp_path / "out" / "match.json").exists()


def test_without_solved_touches_there_are_no_words(match, tmp_path):
    assert match("--no-solve-touches", "--no-figures", "--bvh")[0] == 0
    text = (tmp_path / "out" / "annotations" / "home_7.txt").read_text()
    assert not [line for line in text.splitlines() if line and not line.startswith("#")]
    assert (tmp_path / "out" / "home_7.bvh").is_file() and (tmp_path / "out" / "ball.csv").is_file()


def test_a_player_whose_words_the_library_lacks_fails_where_that_is_asked(match, tmp_path):
    (tmp_path / "words").mkdir()
    (tmp_path / "words" / "home_7.txt").write_text("5 header subtle\n")
    status, _, error = match("--exact", "--no-figures", annotations=tmp_path / "words")
    assert status == 3 and "no player could be synthesized" in error[-1]
    assert any("home_7" in line and "header subtle" in line and line.endswith("or leave out --exact") for line in error)
    assert any(row["reason"].endswith("or leave out --exact") for row in read_state(tmp_path / "out")["players"])
    assert read_state(tmp_path / "out")["status"] == "failed"


def test_a_label_that_nobody_knows_ends_the_run_before_it_begins(match, tmp_path):
    """Also in a text that was edited in the folder; corrected, the same command works."""
    (tmp_path / "words").mkdir()
    text = tmp_path / "words" / "home_7.txt"
    text.write_text("5 kikc right\n")
    command = ("--no-figures", "--players", "home_7", "home_10")
    status, out, error = match(*command, players=None, annotations=tmp_path / "words")
    assert status == 2 and error == [f"beyond-mocap: {text}:1: the label 'kikc' is not in the vocabulary; expected one "
                                     "like kick; correct it, or use it in an annotation of the library"]
    assert out == "" and not (tmp_path / "out").exists()
    text.write_text("5 kick right\n")
    assert match(*command, players=None, annotations=tmp_path / "words")[0] == 0
    edited = tmp_path / "out" / "annotations" / "home_10.txt"
    edited.write_text(edited.read_text() + "5 haeder\n")
    status, _, error = match(*command, players=None, annotations=tmp_path / "words")
    assert status == 2 and "home_10.txt:" in error[0] and "header" in error[0]


def test_joints_beside_tracking_that_is_skeletal_are_refused(match, tmp_path):
    (tmp_path / "joints.csv").write_text("time_s,player,joint,x,y,z\n")
    status, _, error = match(tracking=tmp_path / "joints.csv", joints=tmp_path / "joints.csv")
    assert status == 2 and "joints.csv: skeletal tracking, beside which no joints can be given" in error[0]
    status, _, error = match(tracking=tmp_path / "joints.csv", joints=SMALL / "small.dat")
    assert status == 2 and "for the joints in small.dat; exchange tracking and joints" in error[0]


def test_a_match_without_a_ball_on_the_pitch_of_another_sport_says_both(match, tmp_path):
    rows = "".join(f"{row / 10},home_7,{row / 10},3\n" for row in range(80))
    (tmp_path / "game.csv").write_text("time_s,player,x_m,y_m\n" + rows)
    status, _, error = match("--no-figures", "--sport", "basketball", "--pitch", "105x68",
                             tracking=tmp_path / "game.csv")
    told = " ".join(error)
    assert status == 0 and "without a ball in the tracking data" in told and "cannot be solved" not in told
    assert "105 x 68 m is not of the size of basketball, 28 x 15 m" in told


def test_who_is_not_there_and_texts_of_nobody_are_told(match, tmp_path):
    words = tmp_path / "words"
    words.mkdir()
    for name in ("home_7", "home_8"):
        (words / f"{name}.txt").write_text("13 kick right\n")
    span = {"from": 12, "to": 14}
    status, out, error = match("--players", "away_9", "home_7", "--no-figures", players=None, annotations=words, **span)
    assert status == 0 and "1 of 1 players" in out
    assert "note: player away_9 is left out: absent from 12 to 14 s" in error
    assert [line for line in error if "home_8.txt: ignored" in line]
    assert not [line for line in error if "home_7.txt" in line]


def test_words_for_a_time_at_which_nobody_is_there_are_told(match, tmp_path):
    words = tmp_path / "words"
    words.mkdir()
    (words / "home_7.txt").write_text("13 kick right\n75.25 kick right\n20 21 dribble\n13.5 15 dribble\n")
    span = {"from": 12, "to": 14, "players": None, "annotations": words}
    told = "home_7.txt: 2 of your lines are ignored (20 21 dribble ...), because home_7 is present from 12 to 14 s"
    status, _, error = match("--players", "home_7", "away_6", "--no-figures", **span)
    assert status == 0 and [line for line in error if ".txt" in line] == [f"note: {told}"]
    assert told in read_state(tmp_path / "out")["notes"]
    text = tmp_path / "out" / "annotations" / "away_6.txt"
    text.write_text(text.read_text() + "75.25 kick right\n")
    _, _, error = match("--players", "home_7", "away_6", "--no-figures", **span)
    told = "away_6.txt: 1 of your lines is ignored (75.25 kick right), because away_6 is present from 12 to 14 s"
    assert f"note: {told}" in error


def test_texts_of_players_who_are_away_are_told_where_everybody_is_asked_for(tmp_path):
    from beyond_mocap.match.player_plans import list_unused_labels
    from beyond_mocap.match.request import MatchRequest

    for name in ("home_7", "away_9"):
        (tmp_path / f"{name}.txt").write_text("13 kick right\n")
    files = {"home 7": "home_7", "away 9": "away_9", "away 8": "away_8"}
    order = dict(tracking=Path("t"), library=Path("l"), out=Path("o"), annotations=tmp_path)
    assert list_unused_labels([], MatchRequest(**order, players=("home 7",)), files) == []
    (line,) = list_unused_labels([], MatchRequest(**order), files)
    assert line.startswith("home_7.txt, away_9.txt: ignored")


def test_the_events_second_file_and_provider_may_be_named(match, tmp_path):
    """One that needs no second file says so; two files that lie apart are read, and are of another match."""
    named = {"events": SMALL / "small_events.csv", "events-meta": SMALL / "small_meta.xml", "events-provider": "csv"}
    status, _, error = match("--no-figures", **named)
    assert status == 0 and any("small_meta.xml: not used, because events of CSV are in one file" in one
                               for one in error)
    kloppy = pytest.importorskip("kloppy")
    folder = Path(kloppy.__file__).parent / "tests" / "files"
    if not (folder / "opta_f24.xml").is_file():
        pytest.skip("this kloppy comes without its own test files")
    (tmp_path / "events").mkdir()
    apart = shutil.copy(folder / "opta_f24.xml", tmp_path / "events" / "monday.xml")
    status, _, error = match(events=apart, out=tmp_path / "new")
    assert status == 2 and "the second file of Opta is missing" in error[-1]
    named = {"events-meta": folder / "opta_f7.xml", "events-provider": "OPTA"}
    status, _, error = match(events=apart, out=tmp_path / "new", **named)
    assert status == 2 and "players" in error[-1] and "are not in the tracking" in error[-1]
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("written", [["--scene", "x.blend"], ["--scene=x.blend"], ["--sce", "x.blend"], ["--scen=x"]])
def test_an_option_is_taken_out_however_it_is_written(written):
    assert remove_option(["match", "--seed", "3", *written, "--json"], "--scene") == ["match", "--seed", "3", "--json"]


@pytest.mark.parametrize("options, status, told", [
    ({"tracking": "no.dat"}, 2, "no.dat: no such file"),
    ({"tracking": str(SMALL.parent / "player1.csv")}, 2, "use synthesize for one player"),
    ({"library": "nowhere"}, 2, "nowhere"),
    ({"from": 6, "to": 5}, 2, "end time: 5 s; expected later than the start, 6 s; choose a later end"),
    ({"from": 100, "to": 200}, 2, "time range: 100 to 200 s; expected a second or more within 0 to 24 s"),
    ({"players": "home_99"}, 2, "players: 'home_99'; expected some of"),
    ({"players": "away_9", "from": 15, "to": 20}, 2, "small.dat: no player is seen for 1 s on end from 15 to 20 s"),
    ({"provider": "nobody"}, 2, "provider: 'nobody'"),
    ({"events": "no.csv"}, 2, "no.csv"),
    ({"meta": "no.xml"}, 2, "no.xml"),
    ({"events": str(SMALL / "small_events.csv"), "events-meta": "no.xml"}, 2, "no.xml"),
    ({"events": str(SMALL / "small_events.csv"), "events-provider": "x"}, 2, "events provider: 'x'; expected one of"),
    ({"events": str(SMALL / "small_events.csv"), "events-provider": "opta"}, 2, "the second file of Opta is missing"),
    ({"events-meta": "no.xml"}, 2, "events metadata: no.xml, without an events file"),
    ({"events-provider": "opta"}, 2, "events provider: opta, without an events file"),
    ({"workers": 0}, 2, "'0' is not 1 to 256"),
    ({"scheduler": "tcp://127.0.0.1:9"}, 2, "not allowed with argument --workers"),
    ({"scheduler": "tcp://127.0.0.1:9", "workers": None}, 2, "scheduler: tcp://127.0.0.1:9 does not answer"),
    ({"fps": 0}, 2, "1 to 480 frames per second"),
    ({"out": ""}, 2, "no file or folder is named"),
    ({"from": "nan"}, 2, "'nan' is not a number of seconds"),
    ({"seed": -5}, 2, "'-5' is not 0 to 2147483647"),
    ({"annotations": "nowhere"}, 2, "nowhere: no such folder"),
    ({"out": "no/such/place"}, 2, "the folder above it does not exist"),
    ({"out": str(SMALL)}, 2, "holds other files"),
])  # fmt: skip
def test_what_is_wrong_is_told_in_one_line(match, tmp_path, monkeypatch, options, status, told):
    from beyond_mocap.match.pieces import pool

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pool, "_ANSWER_TIMEOUT", "500ms")
    found, out, error = match(**options)
    assert found == status and len(error) == 1 and told in error[0] and error[0].startswith("beyond-mocap"), error
    assert out == "" and "Traceback" not in error[0]
    assert list(tmp_path.iterdir()) == []
