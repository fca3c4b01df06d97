"""A match put right: who is there and when, sentinels, parked players, turned and mirrored halves, files that do not
belong together or end too early."""

import pathlib

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.tracking.feed import Feed
from beyond_mocap.files.tracking.match_repairs import check_side_names, repair_ball, repair_players, repair_sides
from beyond_mocap.files.tracking.providers import PROVIDERS
from beyond_mocap.files.tracking.referees import read_referee_samples, read_team_colours
from beyond_mocap.files.tracking.tracking import read_match
from beyond_mocap.motion.track.match_data import Match, MatchPlayer, describe_presence

PERIODS = ((0.0, 99.9), (109.9, 209.8))


def two_halves(seed=0):
    """Times (N,), positions (22, N, 2) in two halves between which the teams change ends, ball (N, 3), teams."""
    rng = np.random.default_rng(seed)
    times = np.concatenate([np.arange(0, 100, 0.1), np.arange(109.9, 209.85, 0.1)])
    first = times < 105.0
    x = np.concatenate([rng.uniform(-45, 5, 11), rng.uniform(-5, 45, 11)])
    places = np.column_stack([x, rng.uniform(-30, 30, 22)])
    positions = places[:, None] * np.where(first, 1.0, -1.0)[None, :, None] + rng.normal(0, 2.0, (22, len(times), 2))
    ball = np.column_stack([positions[3], np.full(len(times), 0.1)])
    return times, positions, ball, ["home"] * 11 + ["away"] * 11


def match_of(times, positions, ball, teams):
    players = tuple(MatchPlayer(f"{team}_{i}", team, "", i) for i, team in enumerate(teams))
    return Match(times=times, players=players, positions=positions, ball=ball, length=105.0, width=68.0, fps=10.0,
                 provider="made", periods=PERIODS)


# --- who is there


def test_a_player_s_stretches_end_where_he_leaves_and_with_the_half():
    times, positions, ball, teams = two_halves()
    positions[0, (times > 20) & (times < 22)] = np.nan  # hidden
    positions[0, (times > 50) & (times < 70)] = np.nan  # treated beside the pitch
    positions[1, times > 150] = np.nan  # replaced
    positions[2] = np.nan
    match = match_of(times, positions, ball, teams)
    whole = ((0.0, 99.9), (109.9, 209.8))
    assert np.allclose(match.list_stretches("home_0"), ((0.0, 50.0), (70.0, 99.9), (109.9, 209.8)))
    assert np.allclose(match.list_stretches("home_0", gap=1.0)[:2], ((0.0, 20.0), (22.0, 50.0)))
    assert np.allclose(match.list_stretches("home_1"), ((0.0, 99.9), (109.9, 150.0)))
    assert match.list_stretches("home_2") == () and np.allclose(match.list_stretches("away_12"), whole)
    with pytest.raises(InputError, match="one of home_0"):
        match.list_stretches("nobody")
    lines = describe_presence(match)
    assert [line.split(":")[0] for line in lines] == ["home_0", "home_1", "home_2"]
    assert "1 short gap" in lines[0] and "never" in lines[2]


# --- sentinels


def test_a_ball_that_is_not_there_is_unknown_and_told():
    ball = np.column_stack([np.linspace(-5, 5, 100), np.zeros(100), np.full(100, 0.1)])
    ball[10:15] = 0.0, 0.0, 0.0
    ball[20, 2] = -10.0
    ball[30, :2] = 90.0, 0.0
    ball[40, 2] = 99.0
    found, lines = repair_ball(ball, 105.0, 68.0)
    gone = np.isnan(found[:, 0])
    assert np.flatnonzero(gone).tolist() == [10, 11, 12, 13, 14, 20, 30]
    assert np.isnan(found[40, 2]) and np.isfinite(found[40, :2]).all()
    assert "7 samples" in lines[0] and "1 height " in lines[1] and "93%" in lines[2]


def test_a_ball_at_rest_on_the_spot_stays():
    ball = np.zeros((100, 3))
    ball[60:, 0] = np.linspace(0.0, 20.0, 40)
    ball[60:, 2] = 0.1
    assert np.isfinite(repair_ball(ball, 105.0, 68.0)[0]).all()


def test_parked_players_are_away():
    times, positions, *_ = two_halves()
    positions[0, times < 50] = 0.0, 60.0  # on a bench that is tracked
    positions[1, times > 160] = 3.0, 4.0  # the last place kept
    positions[2, 100:120] = positions[2, 100]  # two seconds of rest
    found, lines = repair_players(times, positions, 105.0, 68.0, [f"p{i}" for i in range(22)])
    assert np.isnan(found[0, times < 50]).all() and np.isnan(found[1, times > 160]).all()
    np.testing.assert_array_equal(found[2:], positions[2:])
    assert lines[0] == "p0: 50 s beside the pitch, set to absent"
    assert lines[1].startswith("p1: 50 s at exactly one position")


# --- ends


@pytest.mark.parametrize("signs, told", [
    ((1.0, 1.0), None), ((-1.0, -1.0), "rotated by 180"), ((-1.0, 1.0), "mirrored end to end"),
    ((1.0, -1.0), "mirrored side to side"),
])
def test_halves_are_turned_to_fit(signs, told):
    times, positions, ball, teams = two_halves()
    second = times > 105.0
    wrong, wrong_ball = positions.copy(), ball.copy()
    wrong[:, second] *= signs
    wrong_ball[second, :2] *= signs
    found, found_ball, lines = repair_sides(times, wrong, wrong_ball, PERIODS, teams)
    np.testing.assert_allclose(found, positions)
    np.testing.assert_allclose(found_ball, ball)
    assert [told in line and "period 2" in line for line in lines] == ([True] if told else [])


def test_one_half_and_few_players_are_left():
    times, positions, ball, teams = two_halves()
    first = times < 105.0
    part = times[first], positions[:, first], ball[first], PERIODS[:1], teams
    assert repair_sides(*part)[2] == []
    few = [3, 4, 15, 16]
    found, _, lines = repair_sides(times, positions[few] * [1.0, -1.0], ball, PERIODS, [teams[i] for i in few])
    assert lines == []  # too few to tell that a half is mirrored


def test_a_lineup_that_does_not_fit_the_sides_is_told():
    times, positions, _, teams = two_halves()
    middle = positions[:, times < 100, 1].mean(axis=1) * np.where(np.array(teams) == "home", 1.0, -1.0)
    called = ["left back" if y > 8 else "right back" if y < -8 else "striker" for y in middle]
    assert check_side_names(times, positions, PERIODS, teams, called) == []
    assert "left players are on the right" in check_side_names(times, positions * [1.0, -1.0], PERIODS, teams,
                                                               called)[0]
    assert check_side_names(times, positions * [1.0, -1.0], PERIODS, teams, [""] * 22) == []


# --- files

META = (
    '<TracabMetaData sVersion="1.0"><match iId="1" dtDate="2020-01-01 12:00:00" iFrameRateFps="25" '
    'fPitchXSizeMeters="100.00" fPitchYSizeMeters="64.00" fTrackingAreaXSizeMeters="unknown" '
    'fTrackingAreaYSizeMeters="unknown"><period iId="1" iStartFrame="{start}" iEndFrame="{end}"/>'
    '<period iId="2" iStartFrame="{second}" iEndFrame="{last}"/></match>{teams}</TracabMetaData>'
)


def roster(side, shirts):
    one = (
        "<Player><PlayerId>{side}{n}</PlayerId><FirstName>A</FirstName><LastName>B{n}</LastName>"
        "<JerseyNo>{n}</JerseyNo>"
        "<StartFrameCount>1</StartFrameCount><EndFrameCount>99</EndFrameCount></Player>"
    )
    players = "".join(one.format(side=side, n=n) for n in shirts)
    names = f"<LongName>{side}</LongName><ShortName>{side}</ShortName><TeamId>1</TeamId>"
    return f"<{side}Team>{names}<Players>{players}</Players></{side}Team>"


def tracab(folder, frames=60, shirts=range(1, 12), start=1, end=60, second=0, last=0, named=None):
    """A TRACAB match of a home and an away player for each shirt."""
    pytest.importorskip("kloppy")
    rows = []
    for frame in range(1, frames + 1):
        who = "".join(f"{team},{n},{n},{n * 100 + frame},{team * 500},0.00;" for team in (0, 1) for n in shirts)
        rows.append(f"{frame}:{who}:{frame},0,10,1.00,H,Alive;:")
    (folder / "g.dat").write_text("\n".join(rows) + "\n")
    teams = "" if named is None else roster("Home", named) + roster("Away", named)
    meta = META.format(start=start, end=end, second=second, last=last, teams=teams)
    (folder / "g_meta.xml").write_text(meta)
    return folder / "g.dat"


def test_a_file_that_ends_within_a_line_is_read_up_to_it(tmp_path):
    file = tracab(tmp_path)
    file.write_bytes(file.read_bytes()[:-40])
    match = read_match(file, cache_dir=tmp_path)
    assert len(match.times) == 59 and any("ends within a line" in line for line in match.report)


def test_a_damaged_line_in_the_middle_is_refused(tmp_path):
    file = tracab(tmp_path)
    text = file.read_bytes()
    file.write_bytes(text[:2000] + b"??,," + text[2100:])
    with pytest.raises(InputError, match="not readable as TRACAB"):
        read_match(file, cache_dir=tmp_path)


def test_a_half_that_is_missing_is_told(tmp_path):
    match = read_match(tracab(tmp_path, second=1000, last=90000), cache_dir=tmp_path)
    assert len(match.periods) == 1
    assert any(line.startswith("period 2 is in the metadata but has no frames") for line in match.report)
    match = read_match(tracab(tmp_path, end=5000), cache_dir=tmp_path)
    assert any(line.startswith("period 1 has 2 s of frames of its 200 s") for line in match.report)


def test_metadata_of_another_match_is_refused(tmp_path):
    with pytest.raises(InputError, match="within the periods in g_meta.xml"):
        read_match(tracab(tmp_path, start=100000, end=200000), cache_dir=tmp_path)
    with pytest.raises(InputError, match=r"16 of 22 tracked players .* are not in g_meta.xml; .* one match"):
        read_match(tracab(tmp_path, named=range(9, 20)), cache_dir=tmp_path)
    match = read_match(tracab(tmp_path, named=range(2, 15)), cache_dir=tmp_path)
    assert any("not in the metadata: 2 of 22 players (away 1, home 1)" in line for line in match.report)
    assert [team.name for team in match.teams] == ["Home", "Away"]


def test_too_many_players_are_refused(tmp_path):
    with pytest.raises(InputError, match="200 players; expected at most 60"):
        read_match(tracab(tmp_path, frames=3, shirts=range(1, 101)), cache_dir=tmp_path)


def test_two_teams_of_two_matches_are_refused(tmp_path):
    for team, ball in (("Home", 0.5), ("Away", 0.6)):
        rows = [f",,,{team},,,", ",,,7,,,", "Period,Frame,Time [s],Player7,,Ball,"]
        rows += [f"1,{n},{n / 25:.2f},0.5,0.5,{ball},0.25" for n in range(1, 30)]
        (tmp_path / f"g_{team}.csv").write_text("\n".join(rows) + "\n")
    with pytest.raises(InputError, match="the ball differs in 29 of 29 rows from g_Away.csv"):
        read_match(tmp_path / "g_Home.csv", cache_dir=tmp_path)


def test_a_team_s_file_that_ends_before_the_other_s_is_told(tmp_path):
    pytest.importorskip("kloppy")
    for team, last in (("Home", 60), ("Away", 40)):
        rows = [f",,,{team},,,", ",,,7,,,", "Period,Frame,Time [s],Player7,,Ball,"]
        rows += [f"1,{n},{n / 25:.2f},0.{500 + n},0.5,0.5,0.25" for n in range(1, last)]
        (tmp_path / f"g_{team}.csv").write_text("\n".join(rows) + "\n")
    match = read_match(tmp_path / "g_Home.csv", cache_dir=tmp_path)
    assert len(match.times) == 39
    told = "the teams' files differ in their number of rows (g_Home.csv 62 and g_Away.csv 42)"
    assert any(line.startswith(told) for line in match.report)


@pytest.mark.parametrize("said, expected", [
    ('{"homeTeamKit":{"name":"x","primaryColor":"#ff00aa"},"awayTeamKit":{"primaryColor":"#003366"}}',
     ("#FF00AA", "#003366")),
    ('{"home_team_kit":{"id":1,"jersey_color":"#ffffff"}}', ("#FFFFFF", "")),
    ('<Team Role="home" PlayerShirtMainColor="#DC0B21"/><Team PlayerShirtMainColor="8FBBF0" Role="guest"/>',
     ("#DC0B21", "#8FBBF0")),
    ('{"homeTeamKit":{"primaryColor":"red"}}', ("", "")),
    ("no colours", ("", "")),
])
def test_colours_of_shirts_are_found(tmp_path, said, expected):
    (tmp_path / "m").write_text(said)
    found = read_team_colours(Feed(PROVIDERS["pff"], (tmp_path / "m",), (tmp_path / "m",)))
    assert (found["home"], found["away"]) == expected


# --- referees


def test_a_damaged_sample_ends_the_referees_and_is_told(tmp_path):
    file = tracab(tmp_path)
    frame = ('{{"FrameCount":{0},"PlayerPositions":[{{"Team":3,"JerseyNumber":0,"X":{1},"Y":5}}]}}').format
    (tmp_path / "g.json").write_text('{"FrameData":[' + ",".join(map(frame, (1, 2, 3), (1, 2, '"?"'))) + "]}")
    feed = Feed(PROVIDERS["tracab"], (tmp_path / "g.json",), (file.with_name("g_meta.xml"),))
    names, places, lines = read_referee_samples(feed, np.arange(1, 5))
    assert names == ["referee_0"] and np.isfinite(places[0, :, 0]).tolist() == [True, True, False, False]
    assert "up to frame 2 only" in lines[0]


def test_tracab_s_referees_are_players_of_their_own_team(tmp_path):
    file = tracab(tmp_path)
    rows = file.read_text().replace(":0,1,1,", ":3,50,0,100,-200,1.00;0,1,1,").splitlines(keepends=True)
    file.write_text("".join(rows[:40]) + "".join(row.replace(":3,50,0,100,-200,1.00;", ":") for row in rows[40:]))
    match = read_match(file, cache_dir=tmp_path)
    referee = match.players[-1]
    assert (referee.id, referee.team) == ("referee_0", "referee") and match.teams[-1].ground == "referee"
    np.testing.assert_allclose(match.positions[-1, :40], [[1.0, -2.0]] * 40)
    assert np.isnan(match.positions[-1, 40:]).all() and len(match.players) == 23


@pytest.mark.parametrize("raw, meta, ids", [
    ("tracab_raw.dat", "tracab_meta.xml", ["referee_0", "referee_1", "referee_2"]),
    ("sportec_positional_w_referee.xml", "sportec_meta.xml", ["DFL-OBJ-000123"]),
    ("signality_p1_raw_data_subset.json", "signality_meta_data.json", ["referee_3", "referee_4", "referee_5"]),
])
def test_referees_of_other_providers(tmp_path, raw, meta, ids):
    kloppy = pytest.importorskip("kloppy")
    files = pathlib.Path(kloppy.__file__).parent / "tests" / "files"
    if not (files / raw).is_file():
        pytest.skip("this kloppy comes without its own test files")
    match = read_match(files / raw, files / meta, cache_dir=tmp_path)
    assert [player.id for player in match.players if player.team == "referee"][: len(ids)] == ids
    assert np.isfinite(match.positions[-1]).any() and np.nanmax(np.abs(match.positions[-1])) < 60.0
