"""Tracking forms that kloppy does not know: planted players come back from each, and damaged files end in one line."""

import json
import pathlib
import re
from datetime import datetime, timedelta

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.tracking.providers import PROVIDERS
from beyond_mocap.files.tracking.tracking import read_match
from beyond_mocap.match.play import build_plays
from beyond_mocap.motion import quaternion

OTHER = pathlib.Path(__file__).resolve().parents[3] / ".." / "shared" / "data" / "tracking" / "other"
RATE, COUNT, SIZE = 10, 60, (100.0, 64.0)
TIME = np.arange(COUNT) / RATE
HOME = np.round(np.column_stack([10 + 4 * TIME, 5 * np.sin(TIME)]), 2)
AWAY = np.round(np.column_stack([-20 - 2 * TIME, -3 + TIME]), 2)
KICK_OFF = datetime(2024, 12, 21, 6, 0)
EARTH = 6_371_008.8


def write_lines(path, rows):
    path.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    return path


def write_cdf(folder):
    def describe(row, stamp, period):
        return {"frame_id": row, "timestamp": f"{stamp.isoformat()}Z", "period": period, "match": {"id": "1"},
                "teams": {"home": {"id": "h", "players": [{"id": "p7", "x": HOME[row, 0], "y": HOME[row, 1]}]},
                          "away": {"id": "a", "players": [{"id": "p9", "x": AWAY[row, 0], "y": AWAY[row, 1]}]}},
                "ball": {"x": HOME[row, 0] + 0.5, "y": HOME[row, 1], "z": 0.2}}

    rows = [describe(row, KICK_OFF + timedelta(seconds=row / RATE), "first_half") for row in range(COUNT)]
    team = {"home": ("p7", 7, "GK"), "away": ("p9", 9, "FW")}
    meta = {"stadium": {"pitch_length": SIZE[0], "pitch_width": SIZE[1]},
            "teams": {ground: {"name": ground.title(), "players": [
                {"id": name, "jersey_number": number, "position_group": group, "first_name": "A", "last_name": name}]}
                for ground, (name, number, group) in team.items()}}  # fmt: skip
    (folder / "game_meta.json").write_text(json.dumps(meta))
    return write_lines(folder / "game_tracking.jsonl", rows)


def write_respovision(folder):
    def describe(row):
        people = [{"person_id": number, "person_name": name, "team_name": team, "jersey_number": shirt,
                   "category_name": kind, "x": x + SIZE[0] / 2, "y": y + SIZE[1] / 2, "head_angle": float("nan")}
                  for number, (name, team, shirt, kind, (x, y)) in enumerate((
                      ("A p7", "Reds", 7.0, "goalkeeper", HOME[row]), ("A p9", "Blues", 9.0, "player", AWAY[row])))]
        return {"frame_id": row, "time": f"00:{row / RATE:09.6f}", "period": "half_1",
                "pitch_side": {"left": "Reds", "right": "Blues"}, "players": people,
                "ball": {"x": HOME[row, 0] + 0.5 + SIZE[0] / 2, "y": HOME[row, 1] + SIZE[1] / 2, "z": 0.2}}

    return write_lines(folder / "game.jsonl", map(describe, range(COUNT)))


def write_soccernet(folder):
    images = [{"image_id": f"2{row:06d}", "file_name": f"{row:06d}.jpg"} for row in range(COUNT)]
    items = []
    for row in range(COUNT):
        for track, role, jersey, team, (x, y) in ((1, "goalkeeper", "7", "left", HOME[row]),
                                                  (2, "player", "9", "right", AWAY[row]),
                                                  (3, "ball", None, None, HOME[row] + (0.5, 0.0))):
            items.append({"image_id": images[row]["image_id"], "track_id": track,
                          "attributes": {"role": role, "jersey": jersey, "team": team},
                          "bbox_pitch": {"x_bottom_middle": x, "y_bottom_middle": -y}})
    items.append({"image_id": images[0]["image_id"], "track_id": 9, "attributes": {"role": "player"},
                  "bbox_pitch": None})
    path = folder / "Labels-GameState.json"
    path.write_text(json.dumps({"info": {"version": "1.3", "frame_rate": RATE, "im_dir": "img1"}, "images": images,
                                "annotations": items}))
    return path


def to_degrees(places, heading=0.5, latitude=52.0, longitude=5.0):
    """Degrees of places on a pitch that is turned by `heading` against the east."""
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    east, north = (np.asarray(places) @ turn.T).T
    return np.column_stack([latitude + np.degrees(north / EARTH),
                            longitude + np.degrees(east / EARTH / np.cos(np.radians(latitude)))])


def write_corners(folder):
    corners = to_degrees([(50, 32), (-50, -32), (50, -32), (-50, 32)])
    rows = "".join(f"{longitude:.9f},{latitude:.9f}\n" for latitude, longitude in corners)
    (folder / "pitch_corners.csv").write_text("longitude,latitude\n" + rows)


def write_catapult(folder):
    """Days of a table program, longitude first; the second receiver starts later and has a gap."""
    write_corners(folder)
    for name, places, keep in (("p7", HOME, TIME >= 0), ("p9", AWAY, (TIME >= 1) & ~((TIME > 2) & (TIME < 4.5)))):
        rows = [f"{44519.7 + time / 86400:.12f}, {longitude:.9f}, {latitude:.9f}\n"
                for time, (latitude, longitude) in zip(TIME[keep], to_degrees(places)[keep])]
        (folder / f"{name}.csv").write_text("Timestamp, Longitude, Latitude\n" + "".join(rows))
    return folder / "p7.csv"


def write_statsports(folder):
    write_corners(folder)
    for name, places in (("p7", HOME), ("p9", AWAY)):
        rows = [f"7,{name},12:30:{time:05.2f},{time},{latitude:.9f},{longitude:.9f},4.0,1,0\n"
                for time, (latitude, longitude) in zip(TIME, to_degrees(places))]
        header = ("Player Id, Player Display Name, Time, Elapsed Time (s), Lat, Lon,  Speed km/h, "
                  "Instantaneous Acceleration Impulse, Heart Rate (bpm)\n")
        (folder / f"{name}.csv").write_text(header + "".join(rows))
    return folder / "p7.csv"


def write_gpx(folder):
    write_corners(folder)
    for name, places in (("p7", HOME), ("p9", AWAY)):
        points = "".join(
            f'<trkpt lat="{latitude:.9f}" lon="{longitude:.9f}"><ele>1</ele>'
            f"<time>{(KICK_OFF + timedelta(seconds=time)).isoformat()}Z</time></trkpt>"
            for time, (latitude, longitude) in zip(TIME.tolist(), to_degrees(places)))
        (folder / f"{name}.gpx").write_text('<?xml version="1.0"?>\n<gpx xmlns="http://www.topografix.com/GPX/1/1">'
                                            f"<time>2001-01-01T00:00:00Z</time><trk><trkseg>{points}</trkseg></trk></gpx>")
    return folder / "p7.gpx"


def write_table(folder, shift=(SIZE[0] / 2, SIZE[1] / 2), scale=1.0):
    """From a corner; the players' moments are those of the ball."""
    rows = [(time, key, *(place + shift) * scale, *more) for row, time in enumerate(TIME) for key, place, more in (
        ("p7", HOME[row], ("", "Reds", 7, "GK keeper")), ("p9", AWAY[row], ("", "Blues", 9, "")),
        ("ball", HOME[row] + (0.5, 0), (0.2, "", "", "")))]
    text = "".join(",".join(map(str, row)) + "\n" for row in rows)
    (folder / "game.csv").write_text("time_s,player,x_m,y_m,z_m,team,number,position\n" + text)
    return folder / "game.csv"


WRITERS = {"cdf": write_cdf, "respovision": write_respovision, "soccernet": write_soccernet, "catapult": write_catapult,
           "statsports": write_statsports, "gpx": write_gpx, "table": write_table}


@pytest.mark.parametrize("form", WRITERS)
def test_planted_players_come_back(form, tmp_path):
    path = WRITERS[form](tmp_path)
    pitch = None if form in ("catapult", "statsports", "gpx", "cdf") else SIZE
    match = read_match(path, cache_dir=tmp_path / "cache", pitch=pitch)
    assert match.provider == (form if form in PROVIDERS else "gps") and match.fps == RATE and len(match.players) == 2
    assert match.times == pytest.approx(TIME, abs=1e-6)
    known = np.isfinite(match.positions).all(axis=2)
    truth = np.array([HOME, AWAY])
    tolerance = 0.05 if match.provider == "gps" else 1e-6  # the earth is no plane
    assert np.abs(match.positions - truth)[known].max() < tolerance
    missing = {"catapult": ((TIME < 1) | ((TIME > 2) & (TIME < 4.5))).sum()}.get(form, 0)
    assert (~known[0]).sum() == 0 and (~known[1]).sum() == pytest.approx(missing, abs=2)
    if match.provider == "gps":
        assert (match.length, match.width) == pytest.approx((100.0, 64.0), abs=0.05)
        assert {player.team for player in match.players} == {"home"} and not np.isfinite(match.ball).any()
        return
    keeper, striker = match.players
    assert (keeper.team, keeper.number, keeper.position) == ("home", 7, "goalkeeper")
    assert (striker.team, striker.number) == ("away", 9)
    assert match.ball[:, 0] == pytest.approx(HOME[:, 0] + 0.5)
    assert (match.length, match.width) == (SIZE if form != "soccernet" else (105.0, 68.0))


def test_a_table_of_wearables_has_moments_of_each_player(tmp_path):
    """Ten times a second each, but never together, in metres from the centre."""
    players = (("a", HOME, 0.0), ("b", AWAY, 0.043))
    rows = [f"{time + late:.3f};{key};{place[0]};{place[1]}\n" for key, places, late in players
            for time, place in zip(TIME, places)]
    (tmp_path / "game.csv").write_text("Timestamp;Player;x;y\n" + "".join(rows))
    match = read_match(tmp_path / "game.csv", cache_dir=tmp_path / "cache")
    assert match.fps == RATE and len(match.times) in (COUNT - 1, COUNT, COUNT + 1)
    for found, (_, truth, late) in zip(match.positions, players):
        known = np.isfinite(found[:, 0])
        wanted = np.interp(match.times[known], TIME + late, truth[:, 0])
        assert known.sum() >= COUNT - 2 and np.abs(found[known, 0] - wanted).max() < 0.01


@pytest.mark.parametrize(("scale", "line"), [(100.0, "metres"), (0.01, "metres")])
def test_a_table_in_another_unit_is_refused(scale, line, tmp_path):
    with pytest.raises(InputError, match=line):
        read_match(write_table(tmp_path, scale=scale), cache_dir=tmp_path / "cache")


@pytest.mark.parametrize(("write_time", "line"), [(lambda time: f"{time * 1000:.0f}", "look like milliseconds"),
                                                  (lambda time: f"{time * RATE:.0f}", "look like frame numbers")])
def test_a_table_with_times_of_another_unit_is_refused(write_time, line, tmp_path):
    rows = [f"{write_time(time)},{key},{x},{y}\n" for row, time in enumerate(TIME)
            for key, (x, y) in (("p7", HOME[row] / 10), ("p9", AWAY[row] / 10))]
    (tmp_path / "game.csv").write_text("time_s,player,x_m,y_m\n" + "".join(rows))
    with pytest.raises(InputError, match=line):
        read_match(tmp_path / "game.csv", cache_dir=tmp_path / "cache")


@pytest.mark.parametrize(("place", "line"), [
    (lambda x, y: (x - 50, y + 32), ""), (lambda x, y: (x - 50, y - 32), ""),
    (lambda x, y: (y, x), "exchange x and y"), (lambda x, y: (y + 32, x + 50), "exchange x and y"),
    (lambda x, y: (x + 400, y), "move the origin"),
    (lambda x, y: (x / 0.3048, y / 0.3048), "convert x and y to metres"),
])  # fmt: skip
def test_origin_and_axes_of_a_table_are_found_or_told(place, line, tmp_path):
    """One player runs along the pitch, one across it."""
    known = {"p7": [(2.0 * x - 1.0 * row / COUNT, 3.0) for row, x in enumerate(np.linspace(-25, 25, COUNT))],
             "p9": [(10.0, y) for y in np.linspace(-30, 30, COUNT)]}
    rows = [f"{time:.1f},{key},{','.join(f'{value:.3f}' for value in place(*places[row]))}\n"
            for row, time in enumerate(TIME) for key, places in known.items()]
    (tmp_path / "game.csv").write_text("time_s,player,x_m,y_m\n" + "".join(rows))
    if line:
        with pytest.raises(InputError, match=line):
            read_match(tmp_path / "game.csv", cache_dir=tmp_path / "cache", pitch=SIZE)
        return
    match = read_match(tmp_path / "game.csv", cache_dir=tmp_path / "cache", pitch=SIZE)
    assert match.positions == pytest.approx(np.array(list(known.values())), abs=2e-3)


@pytest.mark.parametrize(("rows", "line"), [("0,ball,1,2\n1,ball,3,4\n", "no position of a player"),
                                            ("0,a,1,2\n", "rows of 1 moment"),
                                            ("0,a,1,2\n1,b,10,4\n2,c,20,6\n", "moments of their own")])
def test_a_table_without_motion_of_players_is_refused(rows, line, tmp_path):
    (tmp_path / "game.csv").write_text("time_s,player,x_m,y_m\n" + rows)
    with pytest.raises(InputError, match=line):
        read_match(tmp_path / "game.csv", cache_dir=tmp_path / "cache")


@pytest.mark.parametrize(("sign", "zero", "unit"), [(1.0, 0.0, 1.0), (1.0, np.pi, np.radians(1.0)),
                                                    (-1.0, 0.5 * np.pi, 1.0), (None, 0.0, 1.0)])
def test_angles_of_bodies_are_headings_whatever_they_are_measured_from(sign, zero, unit, tmp_path):
    """A player runs in a circle, then stands and looks along -y; random angles are not used, with a line."""
    moments = np.arange(400) / RATE
    running = moments < 30.0
    around = np.where(running, 0.4 * moments, 12.0)
    faces = np.where(running, around + 0.5 * np.pi, -0.5 * np.pi)
    random = np.random.default_rng(1)
    angles = random.uniform(-3, 3, len(faces)) if sign is None else sign * (
        faces - zero + 0.1 * random.normal(size=len(faces)))
    rows = [{"frame_id": row, "time": f"00:{time:09.6f}", "period": "half_1", "pitch_side": {"left": "A", "right": "B"},
             "players": [{"person_id": 1, "team_name": "A", "x": 50 + 10 * np.cos(place), "y": 32 + 10 * np.sin(place),
                          "head_angle": 0.0, "shoulders_angle": 0.0, "hips_angle": angle / unit}]}
            for row, (time, place, angle) in enumerate(zip(moments, around, quaternion.wrap_angle(angles)))]
    match = read_match(write_lines(tmp_path / "game.jsonl", rows), cache_dir=tmp_path / "cache", pitch=SIZE)
    told = " ".join(match.report)
    assert ("taken as degrees" in told) == (unit != 1.0)
    if sign is None:
        assert "angles of bodies are not used" in told and not np.isfinite(match.headings).any()
        return
    away = np.abs(np.angle(np.exp(1j * (match.headings[0] - faces))))
    assert "bodies face where their angles say" in told and away.mean() < 0.12
    again = read_match(tmp_path / "game.jsonl", cache_dir=tmp_path / "cache", pitch=SIZE)
    assert np.array_equal(again.headings, match.headings)
    (play,) = build_plays(match).values()
    assert len(play.keys) == 200 and play.keys[-1].heading == pytest.approx(-0.5 * np.pi, abs=0.1)


def test_rows_that_a_table_has_twice_and_metadata_that_it_has_not_are_told(tmp_path):
    path = write_table(tmp_path)
    path.write_text(path.read_text() + path.read_text().splitlines()[1] + "\n")
    (tmp_path / "other.json").write_text("{}")
    match = read_match(path, tmp_path / "other.json", cache_dir=tmp_path / "cache")
    told = " ".join(match.report)
    assert "1 row of a player and moment" in told and "other.json is not used" in told


@pytest.mark.parametrize("place", [(5_000_000, 500_000), (52, 1e9)])
def test_gps_on_a_map_or_beyond_the_earth_is_refused(place, tmp_path):
    rows = [f"{second},{place[0] + second},{place[1]}\n" for second in range(9)]
    (tmp_path / "run.csv").write_text("time,latitude,longitude\n" + "".join(rows))
    with pytest.raises(InputError, match=r"run.csv: latitude .* degrees, -90 to 90 and -180 to 180"):
        read_match(tmp_path / "run.csv", cache_dir=tmp_path / "cache")


def test_a_receiver_whose_clock_stood_still_says_so(tmp_path):
    rows = [f"{1.7e9 + 1e-4 * (second > 4)},{52 + 1e-5 * second},5\n" for second in range(9)]
    (tmp_path / "run.csv").write_text("time,latitude,longitude\n" + "".join(rows))
    with pytest.raises(InputError, match=r"run.csv: .* per second, 9 samples at 2 different times; .*the time of each"):
        read_match(tmp_path / "run.csv", cache_dir=tmp_path / "cache")


def test_two_halves_follow_each_other(tmp_path):
    path = write_cdf(tmp_path)
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    later = [{**row, "period": "second_half", "timestamp": f"{(KICK_OFF + timedelta(hours=1, seconds=n / RATE))}+00:00"}
             for n, row in enumerate(rows)]
    match = read_match(write_lines(path, [*later, *rows]), cache_dir=tmp_path / "cache")
    assert match.periods == pytest.approx([(0.0, 5.9), (15.9, 21.8)]) and len(match.times) == 2 * COUNT


def test_without_corners_the_pitch_lies_along_the_players(tmp_path):
    path = write_gpx(tmp_path)
    (tmp_path / "pitch_corners.csv").unlink()
    match = read_match(path, cache_dir=tmp_path / "cache")
    assert any("no corners of the pitch" in line for line in match.report)
    steps = np.linalg.norm(np.diff(match.positions, axis=1), axis=2)
    assert steps == pytest.approx(np.linalg.norm(np.diff([HOME, AWAY], axis=1), axis=2), abs=1e-3)


def test_receivers_of_another_time_or_pitch_are_left_out(tmp_path):
    path = write_gpx(tmp_path)
    other = tmp_path / "p9.gpx"
    other.write_text(other.read_text().replace("2024-12-21", "2023-01-01"))
    match = read_match(path, cache_dir=tmp_path / "cache")
    assert len(match.players) == 1
    told = " ".join(match.report)
    assert "1 of 2 files" in told and "of other times left out: p9" in told and "the one of pitch_corners.csv" in told
    corners = tmp_path / "pitch_corners.csv"
    corners.write_text(corners.read_text().replace(",52.", ",51."))
    assert any("km away from the players: not used" in line for line in read_match(path, cache_dir=tmp_path).report)
    with pytest.raises(InputError, match="pitch_corners.csv: corners of a pitch .* km away"):
        read_match(path, corners, cache_dir=tmp_path)


@pytest.mark.parametrize("change, found", [
    ({"teams": {"home": 5}}, "values in other places, or of another kind, than expected"),
    ({"teams": {"home": {"players": [5]}}}, "values in other places, or of another kind, than expected"),
    ({"stadium": {"pitch_length": [1], "pitch_width": 2}}, "values in other places, or of another kind, than expected"),
    ({"stadium": {"pitch_length": "wide", "pitch_width": 2}}, "'wide' in the place of a number"),
    ({"teams": {"home": {"players": [{"jersey_number": 7}]}}}, "no 'id'"),
])
def test_damaged_values_are_told_in_plain_words_with_the_metadata(change, found, tmp_path):
    path = write_cdf(tmp_path)
    meta = tmp_path / "game_meta.json"
    meta.write_text(json.dumps({**json.loads(meta.read_text()), **change}))
    with pytest.raises(InputError) as told:
        read_match(path, cache_dir=tmp_path / "cache", provider="cdf")
    assert str(told.value).startswith(f"{path}: {found}, in it or in game_meta.json; expected Common Data Format track")


@pytest.mark.parametrize("form", WRITERS)
@pytest.mark.parametrize("damage", ["truncated", "no players", "text"])
def test_damaged_files_end_in_one_line(form, damage, tmp_path):
    path = WRITERS[form](tmp_path)
    text = path.read_text()
    if damage == "truncated":
        path.write_text(text[: len(text) // 3])
    else:
        words = {"no players": {'"players"': '"x"', '"bbox_pitch"': '"x"', "<trkpt": "<x", "52.": "x.", "5.": "x."},
                 "text": {": 1": ': "a"', "2024": "year", "44519": "day", "12:30": "noon"}}[damage]
        for word, other in words.items():
            text = text.replace(word, other)
        path.write_text(text)
    try:
        match = read_match(path, cache_dir=tmp_path / "cache", provider=PROVIDERS.get(form, PROVIDERS["gps"]).name)
    except InputError as error:
        assert "\n" not in str(error) and str(tmp_path) in str(error)
        assert not re.search(r"Traceback|Error:|' object|indices|invalid literal", str(error))
    else:
        assert len(match.players) and len(match.times) >= 2


@pytest.mark.skipif(not OTHER.is_dir(), reason="the samples in ../shared/data/tracking/other are not here")
@pytest.mark.parametrize(("name", "people", "fastest"), [
    ("cdf_tracking.jsonl", 23, 12.0), ("respovision_tracking.jsonl", 22, np.inf),
    ("gnss_catapult_U18_ID1.csv", 6, 9.0), ("statsports_U16_ID66.csv", 4, 9.0),
])  # fmt: skip
def test_real_samples(name, people, fastest, tmp_path):
    match = read_match(OTHER / name, cache_dir=tmp_path)
    assert len(match.players) == people
    one_period = match.times <= match.periods[0][1]
    speed = np.linalg.norm(np.diff(match.positions[:, one_period], axis=1), axis=2) * match.fps
    assert np.nanmax(speed) < fastest
