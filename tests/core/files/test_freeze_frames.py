"""Moments of StatsBomb 360: people, ball and labels of the event as planted, read back as a match."""

import json
import pathlib

import numpy as np
import pytest

from beyond_mocap.cli.main import main
from beyond_mocap.files.freeze_frames import EVENT_TIME
from beyond_mocap.files.tracking.tracking import read_match

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
PASS = {"id": "aa-1", "minute": 3, "second": 7, "type": {"name": "Pass"}, "team": {"name": "Reds"},
        "player": {"name": "Ada Öst"}, "location": [60.0, 40.0], "duration": 1.0,
        "pass": {"end_location": [80.0, 20.0], "height": {"name": "Ground Pass"}, "body_part": {"name": "Left Foot"}}}
SHOT = {"id": "aa-2", "minute": 3, "second": 9, "type": {"name": "Shot"}, "team": {"name": "Reds"},
        "player": {"name": "Ada Öst"}, "location": [110.0, 40.0], "duration": 0.5,
        "shot": {"end_location": [120.0, 38.0, 2.0], "body_part": {"name": "Head"}}}
PEOPLE = [{"teammate": True, "actor": True, "keeper": False, "location": [60.0, 40.0]},
          {"teammate": True, "actor": False, "keeper": False, "location": [90.0, 10.0]},
          {"teammate": False, "actor": False, "keeper": True, "location": [118.0, 41.0]}]


@pytest.fixture
def write(tmp_path):
    def write(events=(PASS, SHOT), pictures=None):
        frames = pictures if pictures is not None else [{"event_uuid": event["id"], "freeze_frame": PEOPLE}
                                                        for event in events]
        for name, value in (("frames.json", frames), ("events.json", list(events))):
            (tmp_path / name).write_text(value if isinstance(value, str) else json.dumps(value))
        return ["freeze-frame", str(tmp_path / "frames.json"), "--events", str(tmp_path / "events.json")]

    return write


def test_a_pass_becomes_a_still_with_a_moving_ball(write, tmp_path, capsys):
    assert main([*write(), "--event", "03:07", "--out", str(tmp_path / "still")]) == 0
    assert "Pass of Ada Öst at 03:07, 3 people" in capsys.readouterr().out
    match = read_match(tmp_path / "still" / "moment.csv", cache_dir=tmp_path / "cache")
    people = {player.name: (player.team, player.position) for player in match.players}
    assert people == {"Ada Öst": ("home", ""), "home 2": ("home", ""), "away 1": ("away", "goalkeeper")}
    ids = [player.name for player in match.players]
    still = match.positions[[ids.index(name) for name in ("Ada Öst", "home 2", "away 1")]]
    assert np.ptp(still, axis=1).max() == 0.0
    # 120 x 80 units on 105 x 68 m, the origin in the middle, y to the left of the attack
    assert still[:, 0] == pytest.approx(np.array([(0.0, 0.0), (26.25, 25.5), (50.75, -0.85)]), abs=1e-3)
    at = np.searchsorted(match.times + 1e-6, [0.0, EVENT_TIME, EVENT_TIME + 0.4, EVENT_TIME + 1.0, 4.0])
    end = np.array([17.5, 17.0])
    start = 0.45 * end / np.linalg.norm(end)  # a step before the player
    assert match.ball[at, :2] == pytest.approx(start + np.outer([0, 0, 0.4, 1, 1], end - start), abs=1e-3)
    assert [path.read_text() for path in (tmp_path / "still" / "labels").iterdir()] == ["2 kick left standing low\n"]


def test_the_labels_make_the_player_kick(write, sample_cache, tmp_path):
    assert main([*write(), "--event", "aa-1", "--out", str(tmp_path / "still"), "--pitch", "100x64"]) == 0
    (labels,) = (tmp_path / "still" / "labels").iterdir()
    order = ["match", "--tracking", str(tmp_path / "still" / "moment.csv"), "--annotations", str(labels.parent),
             "--library", str(SAMPLE), "--cache", str(sample_cache), "--out", str(tmp_path / "match"),
             "--no-solve-touches", "--no-figures", "--players", "Ada Öst", "--workers", "1"]
    assert main(order) == 0
    state = json.loads((tmp_path / "match" / "match.json").read_text())
    assert [player["status"] for player in state["players"]] == ["done"] and state["notes"] == []


def test_a_frame_without_its_actor_is_told(write, tmp_path, capsys):
    pictures = [{"event_uuid": "aa-1", "freeze_frame": PEOPLE[1:]}]
    assert main([*write(pictures=pictures), "--event", "aa-1", "--out", str(tmp_path / "still")]) == 0
    assert "note: no one of the people is marked as the actor" in capsys.readouterr().err
    assert not list((tmp_path / "still" / "labels").iterdir())


def test_headers_fly_and_all_moments_are_listed(write, tmp_path, capsys):
    order = write()
    assert main(order) == 0
    listed = capsys.readouterr().out.splitlines()
    assert listed == ["aa-1  03:07  Pass, Ada Öst (Reds)", "aa-2  03:09  Shot, Ada Öst (Reds)"]
    assert main([*order, "--event", "3:09", "--out", str(tmp_path / "still")]) == 0
    match = read_match(tmp_path / "still" / "moment.csv", cache_dir=tmp_path / "cache")
    assert match.ball[-1] == pytest.approx((52.5, 1.7, 2 * 0.9144), abs=1e-3)
    assert [path.read_text() for path in (tmp_path / "still" / "labels").iterdir()] == ["2 header standing\n"]


def test_each_person_has_a_name_of_their_own(write, tmp_path):
    pictures = [{"event_uuid": "aa-1", "freeze_frame": [*PEOPLE, {**PEOPLE[0], "location": [70.0, 30.0]}]}]
    for number, player in enumerate(("Ada Öst", "Ball")):
        order = write(({**PASS, "player": {"name": player}},), pictures)
        assert main([*order, "--event", "aa-1", "--out", str(tmp_path / f"still{number}")]) == 0
        match = read_match(tmp_path / f"still{number}" / "moment.csv", cache_dir=tmp_path / "cache")
        assert len(match.players) == 4 and np.isfinite(match.ball).all()


@pytest.mark.parametrize(("change", "more", "line"), [
    ({}, ["--event", "aa"], "2 events whose ids begin with 'aa'"),
    ({}, ["--event", "99:99"], "no freeze frame of event"),
    ({}, ["--event", "aa-1", "--out", ""], "no file or folder"), ({}, ["--event", "aa-1"], "one without the other"),
    ({}, ["--pitch", "100x60"], "without --event"), ({"pictures": "{"}, [], "not JSON"),
    ({"pictures": [{"a": 1}]}, [], "no list of objects"), ({"pictures": [PASS]}, [], "exchange 360 data and events"),
    ({"pictures": [{"event_uuid": "zz", "freeze_frame": PEOPLE}]}, [], "the same match"),
    ({"pictures": [{"event_uuid": "aa-1", "freeze_frame": [{"location": [1e300, "x"]}]}]}, [],
     "event aa-1: location [1e+300, 'x']; expected 2 numbers"), ({"pictures": "[" * 100_000}, [], "nested too deeply"),
    ({"pictures": f"[{'1' * 5000}]"}, [], "a number of thousands of digits"), ({"pictures": ""}, [], "is empty"),
    ({"pictures": [{"event_uuid": "aa-1", "freeze_frame": [{**one, "location": [one["location"][0] - 100.0, 4.0]}
                                                           for one in PEOPLE]}]}, [], "from -40 to 18 along"),
    ({"pictures": [{"event_uuid": "aa-1", "freeze_frame": [{**one, "location": [100.0 * v for v in one["location"]]}
                                                           for one in PEOPLE]}]}, [],
     "places from 6000 to 1.18e+04 along and 1000 to 4100 across the pitch; expected StatsBomb's units, 0 to 120"),
    ({"events": ({**PASS, "location": [-50.0, -20.0]},)}, [], "events.json: places from -50"),
    ({"events": ({key: value for key, value in PASS.items() if key != "minute"},)}, [], "event aa-1: no 'minute'"),
    ({"events": ({**PASS, "type": 5},)}, [], "event aa-1: values in other places, or of another kind, than"),
    ({"pictures": [{"event_uuid": "aa-1", "freeze_frame": [{"location": [60.0, 40.0, 1.0]}]}]}, ["--event", "aa-1"],
     "event aa-1: location [60.0, 40.0, 1.0]; expected 2 numbers; export"),
    ({"pictures": [{"event_uuid": "aa-1", "freeze_frame": PEOPLE * 40}]}, ["--event", "aa-1"], "at most 60"),
])  # fmt: skip
def test_bad_input_ends_with_one_line(change, more, line, write, tmp_path, capsys):
    out = tmp_path / "still"
    order = [*write(**change), *more]
    if "--event" in more and "--out" not in more and "without" not in line:
        order += ["--out", str(out)]
    assert main(order) == 2
    told = capsys.readouterr().err
    assert line in told and told.count("\n") == 1 and not out.exists()
