"""Joints beside dots: their clock, pitch and people are found by where they are, and what is not of the match is
refused."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.joints.joint_feed import JointFeed, PlayerJoints
from beyond_mocap.match.joint_clock import align_joints, find_pelvis, name_people
from beyond_mocap.motion.track.match_data import Match, MatchPlayer
from tests.core.joint_feeds import sample_joints, write_table
from tests.core.match.small_match import LIBRARY, SMALL

FPS, SECONDS = 25.0, 120.0
TIMES = np.arange(0.0, SECONDS, 1.0 / FPS)


def build_paths(count, seed=1):
    """Paths (count, N, 2) m of players who wander at up to some 3 m/s."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(0.05, 0.25, (count, 2, 3)), rng.uniform(0.0, 6.0, (count, 2, 3))
    waves = np.sin(turns[0][..., None] * TIMES + turns[1][..., None]).sum(axis=2) * 4.0
    return np.moveaxis(waves + rng.uniform(-25.0, 25.0, (count, 2, 1)), 1, 2)


def build_match(paths):
    players = tuple(MatchPlayer(f"home_{number}", "home", "", number) for number in range(len(paths)))
    return Match(times=TIMES, players=players, positions=paths, ball=np.full((len(TIMES), 3), np.nan), length=105.0,
                 width=68.0, fps=FPS, provider="test", periods=((0.0, float(TIMES[-1])),))


def build_feed(paths, spans, offset=0.0, side=1.0):
    """A person for each (player, start, end) s, with hips 10 cm from the middle, 15 cm beside the dot and noisy."""
    rng, people = np.random.default_rng(2), []
    for number, (player, start, end) in enumerate(spans):
        there = (TIMES >= start) & (TIMES <= end)
        middle = paths[player, there] * side + 0.15
        hips = np.stack([np.column_stack([middle + [0.0, y], np.full(there.sum(), 0.9)]) for y in (0.1, -0.1)], axis=1)
        people.append(PlayerJoints(id=f"X{number}", team="", landmarks=("left_hip", "right_hip"),
                                   times=TIMES[there] - offset, positions=hips + rng.normal(0.0, 0.03, hips.shape)))
    return JointFeed(tuple(people), FPS, ())


@pytest.mark.parametrize("offset", [0.0, 31.44, -250.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_clock_and_pitch_are_found(offset, side):
    paths = build_paths(5)
    found = align_joints(build_feed(paths, [(0, 40.0, 55.0), (3, 42.0, 60.0)], offset, side), build_match(paths))
    assert found.people[0].times[0] == pytest.approx(40.0, abs=0.021)
    there = (TIMES >= 42.0) & (TIMES <= 60.0)
    assert np.abs(found.people[1].positions.mean(axis=1)[:, :2] - paths[3, there]).max() < 0.4
    assert len(found.notes) == (offset != 0.0) + (side < 0.0)


def test_the_clock_behind_a_pause_is_its_own():
    paths = build_paths(4)
    first, second = (build_feed(paths, spans, offset) for spans, offset in (
        ([(1, 10.0, 30.0)], 0.0), ([(1, 60.0, 80.0)], -900.0)))
    both = PlayerJoints(id="X", team="", landmarks=first.people[0].landmarks,
                        times=np.concatenate([one.people[0].times for one in (first, second)]),
                        positions=np.concatenate([one.people[0].positions for one in (first, second)]))
    (person,) = align_joints(JointFeed((both,), FPS, ()), build_match(paths)).people
    assert person.times[[0, -1]] == pytest.approx([10.0, 80.0], abs=0.021)
    moved = replace(both, times=person.times - 7.0)
    (line,) = align_joints(JointFeed((moved,), FPS, ()), build_match(paths)).notes  # once, not for each part
    assert "7.00 s" in line


def test_pieces_of_a_player_are_one_player_and_strangers_none():
    paths = build_paths(5)
    feed = build_feed(paths, [(2, 10.0, 30.0), (2, 31.0, 50.0), (4, 10.0, 50.0), (0, 10.0, 50.0)])
    assert name_people(feed, build_match(paths[:4])) == {"X0": "home_2", "X1": "home_2", "X3": "home_0"}


@pytest.mark.parametrize("lost", ["every other", "30 %"])
def test_hips_that_flicker_are_a_pelvis(lost):
    paths = build_paths(3)
    (whole,) = build_feed(paths, [(1, 40.0, 55.0)], -250.0).people
    odd = np.arange(len(whole.times)) % 2 == 1
    is_lost = {"every other": np.stack([odd, ~odd], axis=1),
               "30 %": np.random.default_rng(4).random((len(odd), 2)) < 0.3}[lost]
    flickering = replace(whole, positions=np.where(is_lost[..., None], np.nan, whole.positions))
    feed = align_joints(JointFeed((flickering,), FPS, ()), build_match(paths))
    assert feed.people[0].times[0] == pytest.approx(40.0, abs=0.021)
    assert name_people(feed, build_match(paths)) == {"X0": "home_1"}
    apart = np.linalg.norm(find_pelvis(flickering) - find_pelvis(whole), axis=1)[1:-1]
    assert apart.max() < 0.15 and find_pelvis(whole).tobytes() == whole.positions.mean(axis=1).tobytes()
    flickering.positions[100:115] = np.nan
    assert np.isnan(find_pelvis(flickering)[102:113]).all()  # 0.6 s are no moment


def test_joints_of_another_match_and_of_several_times_are_refused():
    paths = build_paths(5)
    with pytest.raises(InputError, match="10 m or more from any player"):
        align_joints(build_feed(paths + 60.0, [(0, 10.0, 50.0)]), build_match(paths))
    paths[2, TIMES > 20.0] = paths[2, np.searchsorted(TIMES, 20.0)]
    with pytest.raises(InputError, match="several times"):
        align_joints(build_feed(paths, [(2, 60.0, 66.0)], 200.0), build_match(paths))


@pytest.mark.parametrize("rate", [50.0, 30.0])
def test_joints_with_a_wrong_frame_rate_are_refused(rate):
    paths = build_paths(5)
    feed = build_feed(paths, [(0, 10.0, 50.0), (3, 12.0, 50.0)])
    wrong = replace(feed, fps=rate, people=tuple(replace(one, times=one.times * FPS / rate) for one in feed.people))
    with pytest.raises(InputError, match=f"{rate:g} frames per second.*expected 25, at which they fit"):
        align_joints(wrong, build_match(paths))


def _run(capsys, folder, *options):
    status = main(["match", "--library", str(LIBRARY), "--out", str(folder / "out"), *map(str, options)])
    lines = capsys.readouterr().err.strip().splitlines()
    assert not (folder / "out").exists() and not any("Traceback" in line for line in lines)
    return status, lines[-1]


def test_bad_joints_end_with_one_line(tmp_path, capsys):
    joints = sample_joints("walking_1_2", 25.0)
    far = write_table(tmp_path / "far.csv", {"A": joints + [70.0, 60.0, 0.0]}, 25.0)
    np.savez(tmp_path / "objects.npz", poses=np.array([{"a": 1}], dtype=object))
    (tmp_path / "ball.csv").write_text("time_s,x_m,y_m\n0,1,2\n")
    dots = "--tracking", SMALL / "small.dat", "--to", 4
    for path, expected in ((far, "from any player"), (tmp_path / "objects.npz", "objects.npz"),
                           (tmp_path / "ball.csv", "unknown form"),
                           (SMALL / "small.dat", "without joints are for match"),
                           (tmp_path / "none.csv", "no such file")):
        status, line = _run(capsys, tmp_path, *dots, "--joints", path)
        assert status == 2 and expected in line, line
    times = write_table(tmp_path / "years.csv", {"A": joints}, 25.0)
    head, *rows = times.read_text().splitlines(keepends=True)
    times.write_text(head + "".join(rows) + "".join(f"1.7e9{row[row.index(','):]}" for row in rows[:20]))
    for path, expected in ((tmp_path / "objects.npz", "objects.npz"), (times, "the times of one match")):
        status, line = _run(capsys, tmp_path, "--tracking", path)
        assert status == 2 and expected in line, line
