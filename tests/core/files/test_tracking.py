"""Tracking in: the contract's CSV, and providers' files through kloppy and their cache."""

import gc
import os
import pathlib
import re
import sys
import types

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.event_providers import EVENT_PROVIDERS
from beyond_mocap.files.provider_texts import EVENTS, TRACKING
from beyond_mocap.files.tracking import feed, tracking
from beyond_mocap.files.tracking.feed import TrackingProvider
from beyond_mocap.files.tracking.providers import PROVIDERS
from beyond_mocap.files.tracking.tracking import read_match, read_track_csv
from pages import PROVIDERS_PAGE, replace_tables

DATA = pathlib.Path(__file__).resolve().parents[3] / ".." / "shared" / "data" / "tracking"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings in ../shared/data are not here")

TRACAB_META = (
    '<TracabMetaData sVersion="1.0"><match iId="1" dtDate="2020-01-01 12:00:00" iFrameRateFps="25" '
    'fPitchXSizeMeters="100.00" fPitchYSizeMeters="64.00" fTrackingAreaXSizeMeters="unknown" '
    'fTrackingAreaYSizeMeters="unknown"><period iId="1" iStartFrame="1" iEndFrame="{last}"/>'
    '<period iId="2" iStartFrame="0" iEndFrame="0"/></match></TracabMetaData>'
)


def made_players(frames):
    """(2, frames, 2) m: a home and an away player, whole centimetres."""
    time = np.arange(frames) / 25
    home = np.column_stack([10 + 4 * time, 5 * np.sin(time)])
    away = np.column_stack([-20 - 2 * time, -3 + time])
    return np.round([home, away], 2)


def made_tracab(folder, frames=60):
    """A TRACAB match of two players and a ball 1.5 m high, and its true positions."""
    players = made_players(frames)
    lines = []
    for index in range(frames):
        (hx, hy), (ax, ay) = np.round(players[:, index] * 100).astype(int)
        lines.append(f"{index + 1}:1,1,7,{hx},{hy},0.00;0,2,9,{ax},{ay},0.00;:{hx + 50},{hy},150,1.00,H,Alive;:")
    (folder / "game.dat").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "game_meta.xml").write_text(TRACAB_META.format(last=frames), encoding="utf-8")
    return folder / "game.dat", players


def made_metrica(folder, frames=60, size=(105.0, 68.0)):
    """The same two players in Metrica's layout: 0..1 from the top left corner, y downward."""
    players = made_players(frames)
    for team, name, shirt in ((0, "Home", 7), (1, "Away", 9)):
        rows = [f",,,{name},,,", f",,,{shirt},,,", f"Period,Frame,Time [s],Player{shirt},,Ball,"]
        for index, (x, y) in enumerate(players[team]):
            u, v = x / size[0] + 0.5, 0.5 - y / size[1]
            rows.append(f"1,{index + 1},{index / 25:.2f},{u:.6f},{v:.6f},0.6,0.25")
        (folder / f"game_{name}.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return folder / "game_Home.csv", players


# --- the contract's CSV


def write(folder, text):
    file = folder / "track.csv"
    file.write_text(text, encoding="utf-8", newline="")
    return file


def rows(rate=10.0, count=5, cells="{t:.3f},{t:.3f},2"):
    return "".join(cells.format(t=index / rate) + "\n" for index in range(count))


def test_the_form_of_the_contract_is_read(tmp_path):
    text = "\ufefftime_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m,mood\r\n"
    text += "0,1,2,3,4,,fine\r\n0.1,,2,nan,4,0.5,\r\n\r\n0.2,1.5,2,3,4,0.6,\r\n"
    track = read_track_csv(write(tmp_path, text))
    np.testing.assert_array_equal(track.times, [0, 0.1, 0.2])
    np.testing.assert_array_equal(track.positions, [[1, 2], [np.nan, 2], [1.5, 2]])
    np.testing.assert_array_equal(track.ball, [[3, 4, np.nan], [np.nan, 4, 0.5], [3, 4, 0.6]])
    assert track.ball_height_known.tolist() == [False, True, True] and track.name == "track.csv"


def test_a_track_needs_no_ball(tmp_path):
    track = read_track_csv(write(tmp_path, "time_s,x_m,y_m\n" + rows()))
    assert len(track) == 5 and np.isnan(track.ball).all()
    flat = read_track_csv(write(tmp_path, "time_s,x_m,y_m,ball_x_m,ball_y_m\n" + rows(cells="{t:.3f},{t:.3f},2,1,1")))
    assert np.isfinite(flat.ball[:, :2]).all() and not flat.ball_height_known.any()


@pytest.mark.parametrize(
    "text, part",
    [
        ("", "the file is empty"),
        ("\n \n", "the file is empty"),
        ("time,x,y\n0,1,2\n", "no column time_s, x_m, y_m"),
        ("time_s;x_m;y_m\n0;1;2\n", "no column time_s"),
        ("time_s;x_m;y_m\n0;1,5;2\n", "time_s,x_m,y_m; write commas between the cells, and points in numbers"),
        ("time;x;y\n0;1;2\n", "separated by semicolons; expected a header with time_s,x_m,y_m; rename the columns"),
        ("time_s,x_m,y_m,ball_x_m\n0,1,2,3\n", "no column 'ball_y_m'"),
        ("time_s,x_m,y_m\n", "0 samples"),
        ("time_s,x_m,y_m\n0,1,2\n", "1 sample "),
        ("time_s,x_m,y_m\n0,1,2\n0,1,2\n", "1 sample with a distinct time"),
        ("time_s,x_m,y_m\n0,1,2\n0.1,one,2\n", ":3: x_m 'one'"),
        ("time_s,x_m,y_m\n0,1,2\n0.1,1\n", ":3: 2 cells"),
        ("time_s,x_m,y_m\n0,1,2\n0.1\n", ":3: 1 cell;"),
        ("time_s,x_m,y_m\n0,1,2\n0.1,20000,2\n", ":3: x_m 20000"),
        ("time_s,x_m,y_m\n0,1,2\n0.1,1e999,2\n", ":3: x_m '1e999'"),
        ("time_s,x_m,y_m\n" + rows(rate=2), "2 samples per second"),
        ("time_s,x_m,y_m\n" + rows(rate=0.02), "check that time_s is in seconds"),
        ("time_s,x_m,y_m\n" + rows(rate=500), "500 samples per second"),
    ],
)
def test_mistakes_get_one_line(tmp_path, text, part):
    with pytest.raises(InputError) as caught:
        read_track_csv(write(tmp_path, text))
    assert part in str(caught.value) and "track.csv" in str(caught.value) and "\n" not in str(caught.value)


def test_files_that_are_no_table_are_refused(tmp_path):
    (tmp_path / "b.csv").write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="binary"):
        read_track_csv(tmp_path / "b.csv")
    with pytest.raises(InputError, match="no such file"):
        read_track_csv(tmp_path / "none.csv")
    with pytest.raises(InputError):
        read_track_csv(tmp_path)


NEARLY_NUMBERS = st.text("0123456789.,-en\r\n\"", max_size=150).map(str.encode)


@settings(deadline=None)
@given(st.booleans(), st.one_of(st.binary(max_size=150), NEARLY_NUMBERS))
def test_any_content_is_read_or_refused(tmp_path_factory, headed, content):
    file = tmp_path_factory.mktemp("fuzz") / "t.csv"
    file.write_bytes(b"time_s,x_m,y_m\n" * headed + content)
    try:
        read_track_csv(file)
    except InputError as error:
        assert "\n" not in str(error)


@needs_data
@pytest.mark.parametrize("number", range(1, 6))
def test_the_scenarios_are_read(number):
    track = read_track_csv(DATA / "scenarios" / f"scenario{number}_track.csv")
    assert len(track) > 280 and np.isfinite(track.positions).all() and 0.03 < track.interval < 0.06
    assert track.ball_height_known.any() == (number != 1)


# --- providers


def test_tracab_becomes_metres_and_is_kept(tmp_path, monkeypatch):
    pytest.importorskip("kloppy")
    file, players = made_tracab(tmp_path)
    match = read_match(file, cache_dir=tmp_path / "cache")
    assert (match.provider, match.fps, match.length, match.width) == ("tracab", 25.0, 100.0, 64.0)
    assert [(player.team, player.number) for player in match.players] == [("away", 9), ("home", 7)]
    np.testing.assert_allclose(match.positions, players[::-1], atol=1e-9)
    np.testing.assert_allclose(match.ball[:, 0], players[0, :, 0] + 0.5, atol=1e-9)
    np.testing.assert_allclose(match.ball[:, 2], 1.5)
    assert match.times[0] == 0.0 and np.allclose(np.diff(match.times), 0.04)

    monkeypatch.setattr(tracking, "load_tracking", None)  # the second time nothing is parsed
    again = read_match(file, cache_dir=tmp_path / "cache")
    assert again.players == match.players and again.periods == match.periods
    for name in ("times", "positions", "ball"):
        np.testing.assert_array_equal(getattr(again, name), getattr(match, name))


def test_a_period_that_is_listed_again_and_again_is_refused(tmp_path):
    """kloppy looks for each in every frame: 2000 rows of one period took more than a minute."""
    pytest.importorskip("kloppy")
    file, _ = made_tracab(tmp_path)
    meta = next(tmp_path.glob("*.xml"))
    meta.write_text(re.sub(r"<period [^>]*/>", lambda found: 30 * found[0], meta.read_text(), count=1))
    with pytest.raises(InputError, match=rf"{meta.name}: \d+ periods; expected those of one match"):
        read_match(file, cache_dir=tmp_path / "cache")


def test_frames_of_a_match_are_gone_once_it_is_read(tmp_path):
    """They refer to each other in circles: 1.3 GB of a whole match would stay until chance ends them."""
    pytest.importorskip("kloppy")
    file, _ = made_tracab(tmp_path)
    gc.disable()
    try:
        read_match(file, cache_dir=tmp_path / "cache")
        left = [one for one in gc.get_objects() if type(one).__module__ == "kloppy.domain.models.tracking"]
    finally:
        gc.enable()
    assert not [one for one in left if not isinstance(one, type)]


def test_metrica_agrees_with_tracab_of_the_same_match(tmp_path):
    pytest.importorskip("kloppy")
    file, players = made_metrica(tmp_path)
    match = read_match(file, cache_dir=tmp_path / "cache")
    np.testing.assert_allclose(match.positions, players[::-1], atol=1e-3)
    np.testing.assert_allclose(match.ball[:, :2], [[10.5, 17.0]] * 60)
    assert np.isnan(match.ball[:, 2]).all() and any("105 x 68" in note for note in match.notes)
    from_away = read_match(tmp_path / "game_Away.csv", cache_dir=tmp_path / "cache")
    np.testing.assert_array_equal(from_away.positions, match.positions)
    made_metrica(tmp_path, size=(100.0, 64.0))
    told = read_match(file, cache_dir=tmp_path / "cache", pitch=(100.0, 64.0))
    np.testing.assert_allclose(told.positions, players[::-1], atol=1e-3)
    assert not any("105" in note for note in told.notes)


def test_a_folder_in_the_place_of_a_file_is_named(tmp_path):
    (tmp_path / "a.ball").mkdir()
    one = feed.Feed(PROVIDERS["tracab"], (tmp_path / "a.ball",))
    with pytest.raises(InputError, match="a.ball: is a folder; expected a file of TRACAB"):
        tracking._compute_key(one, None)


def test_a_changed_file_or_a_damaged_cache_is_read_anew(tmp_path):
    pytest.importorskip("kloppy")
    file, players = made_tracab(tmp_path)
    cache = tmp_path / "cache"
    read_match(file, cache_dir=cache)
    (kept,) = cache.iterdir()
    whole = kept.read_bytes()
    packed = bytearray(whole)
    packed[whole.index(b"PK\x01\x02") + 10] = 99  # a way of packing that nobody knows
    for damage in (b"", b"PK\x03\x04 not a zip", whole[:-200], bytes(packed)):
        kept.write_bytes(damage)
        np.testing.assert_allclose(read_match(file, cache_dir=cache).positions, players[::-1], atol=1e-9)
        assert len(kept.read_bytes()) > 1000
    made_tracab(tmp_path, frames=40)
    assert len(read_match(file, cache_dir=cache).times) == 40


def test_a_cache_that_cannot_be_written_is_told(tmp_path):
    pytest.importorskip("kloppy")
    file, _ = made_tracab(tmp_path)
    (tmp_path / "cache").write_text("a file in the folder's place")
    match = read_match(file, cache_dir=tmp_path / "cache")
    assert any("is not writable" in note for note in match.notes)


def test_a_player_can_be_followed(tmp_path):
    pytest.importorskip("kloppy")
    file, players = made_tracab(tmp_path)
    match = read_match(file, cache_dir=tmp_path)
    home = next(player.id for player in match.players if player.team == "home")
    track = match.track(home, 1.0, 2.0)
    np.testing.assert_allclose(track.times, np.arange(25, 51) / 25)
    np.testing.assert_allclose(track.positions, players[0, 25:51], atol=1e-9)
    assert track.name == home and track.ball_height_known.all()
    with pytest.raises(InputError, match="one of"):
        match.track("nobody")
    with pytest.raises(InputError, match="0 samples"):
        match.track(home, 100.0, 200.0)


def test_wrong_files_get_one_line(tmp_path):
    pytest.importorskip("kloppy")
    file, _ = made_tracab(tmp_path)
    (tmp_path / "odd.txt").write_text("hello\n")
    (tmp_path / "joints.csv").write_text("time_s,player,joint,x,y,z\n0,a,nose,1,2,3\n")
    (tmp_path / "360.json").write_text('[\n {"event_uuid": "a", "freeze_frame": []}]')
    (tmp_path / "bad_meta.xml").write_text("<nonsense/>")
    (tmp_path / "lonely.dat").write_bytes(file.read_bytes())
    cases = [
        ((tmp_path / "none.dat",), "no such file"),
        ((tmp_path / "odd.txt",), "choose the provider, rename the columns, or write a Plain CSV"),
        ((tmp_path / "joints.csv",), "joints.csv: skeletal tracking; expected positions of players and ball"),
        ((tmp_path / "360.json",), "moments of StatsBomb 360; expected a match's tracking data from one of"),
        ((file, tmp_path / "bad_meta.xml"), "not readable as TRACAB"),
        ((file, tmp_path / "odd.txt"), "odd.txt: neither XML nor JSON; expected the metadata of TRACAB"),
        ((file, None, "metrica"), "not readable as Metrica tracking; expected"),
        ((file, None, "scisports"), "; write others as a Plain CSV (table)"),
        ((tmp_path / "lonely.dat",), "choose the metadata file"),
        ((file, tmp_path / "none.xml"), "no such file"),
    ]
    for arguments, part in cases:
        with pytest.raises(InputError) as caught:
            read_match(*arguments, cache_dir=tmp_path / "cache")
        assert part in str(caught.value) and "\n" not in str(caught.value)


def test_without_kloppy_the_way_to_it_is_named(tmp_path, monkeypatch):
    file, _ = made_tracab(tmp_path)
    monkeypatch.setitem(sys.modules, "kloppy", None)
    monkeypatch.delitem(sys.modules, "kloppy.tracab", raising=False)
    with pytest.raises(InputError, match="extra 'match'"):
        read_match(file, cache_dir=tmp_path / "cache")


@pytest.mark.parametrize(
    "raw, meta, provider, players",
    [
        ("tracab_raw.json", "tracab_meta.json", "tracab", 30),
        ("epts_metrica_tracking.txt", "epts_metrica_metadata.xml", "metrica", 22),
        ("skillcorner_v3_raw_data.jsonl", "skillcorner_meta_data.json", "skillcorner", 31),
        ("sportec_positional.xml", "sportec_meta.xml", "sportec", 3),
        ("second_spectrum_fake_data.jsonl", "second_spectrum_fake_metadata.xml", "secondspectrum", 29),
        ("statsperform_tracking_ma25.txt", "statsperform_tracking_ma1.xml", "statsperform", 23),
        ("pff_10517.jsonl", "pff_metadata_10517.json", "pff", 35),
        ("signality_p1_raw_data_subset.json", "signality_meta_data.json", "signality", 30),
    ],
)
def test_every_provider_is_known_by_its_form(tmp_path, raw, meta, provider, players):
    kloppy = pytest.importorskip("kloppy")
    files = pathlib.Path(kloppy.__file__).parent / "tests" / "files"
    if not (files / raw).is_file():
        pytest.skip("this kloppy comes without its own test files")
    match = read_match(files / raw, files / meta, cache_dir=tmp_path)
    assert match.provider == provider and len(match.players) == players
    assert np.nanmax(np.abs(match.positions[..., 0])) < 60 and np.nanmax(np.abs(match.positions[..., 1])) < 40
    assert np.all(np.diff(match.times) > 0) and match.times[0] == 0.0
    assert np.nanmin(match.positions) < -1.0 < 1.0 < np.nanmax(match.positions)


def test_texts_and_records_have_the_same_providers_in_the_same_order():
    assert [*TRACKING] == [*PROVIDERS] and [*EVENTS] == [*EVENT_PROVIDERS]
    for texts, record in zip((*TRACKING.values(), *EVENTS.values()), (*PROVIDERS.values(), *EVENT_PROVIDERS.values())):
        assert (record.name, record.title, record.files) == (texts["name"], texts["title"], texts["files"])


def test_a_provider_is_one_record(tmp_path, monkeypatch, capsys):
    """A made-up form, TRACAB's below a line of its own, is guessed, read, named and documented by its record alone."""
    kloppy = pytest.importorskip("kloppy.tracab")
    file, players = made_tracab(tmp_path)
    (tmp_path / "game.acme").write_text("ACME 1\n" + file.read_text())

    def load(meta, lines, coordinates):
        (tmp_path / "lines.dat").write_text(pathlib.Path(lines).read_text().partition("\n")[2])
        return kloppy.load(meta_data=meta, raw_data=str(tmp_path / "lines.dat"), coordinates="tracab")

    acme = TrackingProvider(
        name="acme", title="Acme Sports", files="`.acme` with TRACAB's metadata", patterns=(rb"ACME \d",),
        loader="load_lines", arguments={"meta": "meta", "lines": "raw"},
        read_referees=lambda feed: iter([(1, "referee_1", 0.0, 500.0)]),
    )
    monkeypatch.setitem(sys.modules, "kloppy.acme", types.SimpleNamespace(load_lines=load))
    monkeypatch.setitem(PROVIDERS, "acme", acme)
    match = read_match(tmp_path / "game.acme", cache_dir=tmp_path / "cache")
    assert match.provider == "acme" and "game.acme is read as Acme Sports" in match.notes
    np.testing.assert_allclose(match.positions[:2], players[::-1], atol=1e-9)
    assert (match.players[2].team, match.positions[2, 0].tolist()) == ("referee", [0.0, 5.0])
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    touches = ["touches", str(tmp_path / "game.acme"), "--provider", "acme", "--out", str(tmp_path / "t.csv")]
    assert main(touches) == 0 and main([*touches, "--provider", "acne"]) == 2
    assert "table, acme" in capsys.readouterr().err
    assert main(["match", "--help"]) == 0 and "table, acme" in " ".join(capsys.readouterr().out.split())
    assert "| Acme Sports | `.acme` with TRACAB's metadata |\n" in replace_tables(PROVIDERS_PAGE.read_text("utf-8"))


def test_the_tables_of_providers_come_from_their_records():
    page = PROVIDERS_PAGE.read_text("utf-8")
    assert replace_tables(page) == page, "make tables writes them"


@needs_data
def test_a_real_match_is_the_same_in_two_layouts(tmp_path):
    pytest.importorskip("kloppy")
    lines = 500  # of the six minutes; reading all takes seconds
    for name, extra in (("dutch_6min.dat", 0), ("dutch_6min_Home.csv", 3), ("dutch_6min_Away.csv", 3)):
        with open(DATA / "match" / name, encoding="utf-8") as file:
            (tmp_path / name).write_text("".join(file.readline() for _ in range(lines + extra)), encoding="utf-8")
    meta = DATA / "match" / "dutch_6min_meta.xml"
    tracab = read_match(tmp_path / "dutch_6min.dat", meta, cache_dir=tmp_path / "cache")
    size = (tracab.length, tracab.width)
    metrica = read_match(tmp_path / "dutch_6min_Home.csv", cache_dir=tmp_path / "cache", pitch=size)
    assert [p.id for p in tracab.players] == [p.id for p in metrica.players] and len(tracab.players) == 22
    np.testing.assert_allclose(tracab.positions, metrica.positions, atol=0.01)
    np.testing.assert_allclose(tracab.ball[:, :2], metrica.ball[:, :2], atol=0.01)
    np.testing.assert_allclose(tracab.times, metrica.times, atol=1e-6)


def test_the_cache_keeps_what_was_read_last(tmp_path, monkeypatch):
    monkeypatch.setattr(tracking, "_CACHE_BYTES", 250)
    for age, name in enumerate(("a", "b", "c")):
        (tmp_path / f"{name * 40}.npz").write_bytes(b"x" * 100)
        os.utime(tmp_path / f"{name * 40}.npz", (1000 - age, 1000 - age))
    (tmp_path / "mine.npz").write_bytes(b"x" * 1000)
    tracking._prune_cache(tmp_path / f"{'c' * 40}.npz")  # the newest stays, though its time is the oldest
    assert sorted(path.name[0] for path in tmp_path.iterdir()) == ["a", "c", "m"]


def test_a_damaged_xml_or_json_is_told_with_its_line(tmp_path):
    (tmp_path / "meta.xml").write_text("<match>\n<a></b>\n</match>")
    (tmp_path / "meta.json").write_text('{"a": 1,\n "b": }')
    assert "meta.xml:2: mismatched tag at column" in feed._find_syntax_error([str(tmp_path / "meta.xml")])
    assert "meta.json:2: expecting value at column 7" in feed._find_syntax_error([None, str(tmp_path / "meta.json")])
    (tmp_path / "meta.json").write_text("{}")
    assert feed._find_syntax_error([str(tmp_path / "meta.json"), "x", 3]) == ""
