"""Players whose joints are seen: shown as they are, synthesized where they are not, without a jump in between."""

import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.joints.joint_readers import list_joint_files, read_joints
from beyond_mocap.files.tracking.tracking import read_match
from beyond_mocap.library.build import build_library
from beyond_mocap.match.known_bodies import read_joint_match
from beyond_mocap.match.player_file import read_player, write_player
from beyond_mocap.match.player_motion import construct_player
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.known_body import SOURCE
from beyond_mocap.synthesis.quality.movement import compute_jerk
from tests.core.joint_feeds import NAMES, sample_joints, write_hawkeye, write_table
from tests.core.match.small_match import LIBRARY, SMALL

GAP = (2.2, 3.8)
FPS = 50.0


@pytest.fixture(scope="module")
def seen_match(tmp_path_factory, sample_cache):
    """A walk with 5 cm of noise and a gap of 1.6 s in which no joint is seen but dots are; and a player never seen."""
    folder = tmp_path_factory.mktemp("seen")
    truth = sample_joints("walking_1_2", FPS)
    seen = truth + np.random.default_rng(3).normal(0.0, 0.05 / np.sqrt(3.0), truth.shape)
    seen[int(GAP[0] * FPS) : int(GAP[1] * FPS)] = np.nan
    joints = write_table(folder / "joints.csv", {"A": seen}, FPS)
    out = folder / "match"
    order = ["match", "--tracking", str(joints), "--library", str(LIBRARY), "--cache", str(sample_cache)]
    assert main([*order, "--out", str(out), "--bvh", "--workers", "1"]) == 0
    return folder, truth, out


def measure_places(out, start, end, sample_cache):
    edit = read_player(next(out.glob("*.take.npz")))
    library = build_library(LIBRARY, cache_dir=sample_cache)
    return edit, [take for take in construct_player(library, edit, start, end)]


def test_seen_joints_are_shown_and_gaps_are_synthesized(seen_match, sample_cache):
    _, truth, out = seen_match
    _, takes = measure_places(out, 0.0, len(truth) / FPS, sample_cache)
    (take,) = takes
    places, _ = forward_kinematics(take.motion)
    times = take.start_time + np.arange(len(places)) / take.motion.fps
    body = identify_joints(take.motion.skeleton)
    at = np.clip(np.rint(times * FPS).astype(int), 0, len(truth) - 1)
    is_seen = np.array([take.clips[clip] == SOURCE for clip in take.clip])
    gap = (times > GAP[0] + 0.1) & (times < GAP[1] - 0.1)
    assert is_seen[(times < GAP[0] - 0.1) | (times > GAP[1] + 0.1)].all() and not is_seen[gap].any()
    for name, joint in (("left_ankle", body.left.foot), ("right_wrist", body.right.hand), ("left_knee",
                        body.left.lower_leg)):
        error = np.linalg.norm(places[:, joint] - truth[at, NAMES.index(name)], axis=1)
        assert error[is_seen].mean() < 0.05
    feet = places[:, [[limb.foot, limb.toe] for limb in (body.left, body.right)]]
    moved = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1).min(axis=2) * take.motion.fps
    stands = take.contacts[1:] & take.contacts[:-1] & ~is_seen[1:, None]
    assert stands.sum() > 20 and moved[stands].mean() < 0.05 and moved[stands].max() < 0.3
    assert feet[~is_seen, ..., 2].min() > -0.02
    jerk = compute_jerk(places, take.motion.fps)
    inner = np.percentile(jerk[is_seen[:-3]], 99)
    assert jerk.max() < max(2.0 * inner, 4000.0)


def write_balls(path, ball, is_seen, day=22):
    """Two files of a half beside Hawk-Eye's joints, of a ball (T, 3) in their unit."""
    times = np.arange(len(ball)) / FPS
    for minute, begin, end in ((1, 0.0, 1.0), (2, 1.0, 3.0)):
        rows = [{"time": times[frame] - begin, "pos": ball[frame].tolist() if is_seen[frame] else None}
                for frame in np.flatnonzero((times >= begin) & (times < end))]  # fmt: skip
        content = {"time": {"startUTC": f"2024-09-{day}T21:00:{10 + minute:02d}.000Z"}, "samples": {"ball": rows}}
        path.with_name(f"match_1_{minute}.football.samples.ball").write_text(json.dumps(content))


def test_the_ball_beside_hawkeyes_joints_is_that_of_the_match(tmp_path):
    """In centimetres and in two files, as the joints are, with half a second in which it is not seen; and wild."""
    joints = sample_joints("walking_1_2", FPS)[:150]
    path = write_hawkeye(tmp_path, {"7": 100.0 * joints}, FPS)
    times = np.arange(150) / FPS
    ball = np.column_stack([5.0 + 3.0 * times, -times, 0.11 + 0.0 * times])
    is_seen = (times < 1.2) | (times > 1.7)
    tracked = ball.copy()
    tracked[20], tracked[30, 2] = (300.0, 300.0, 1.0), 90.0
    write_balls(path, 100.0 * tracked, is_seen)
    match, _ = read_joint_match(path)
    known = np.isfinite(match.ball[:, 0])
    assert known[is_seen].mean() > 0.95 and not known[~is_seen].any()
    assert not known[20] and known[30] and np.isnan(match.ball[30, 2])
    assert np.nanmax(np.abs(match.ball[known] - ball[known])) < 1e-3
    assert "the ball is read from 2 files" in " ".join(match.notes)
    assert "1 sample with an impossible" in match.report[0] and "1 height of the ball above 60 m" in match.report[1]
    both, alone = (list_joint_files(path, with_ball) for with_ball in (True, False))
    assert (len(both), len(alone)) == (4, 2)  # whose content makes a stored match out of date
    path.with_name("match_1_2.football.samples.ball").write_text("{}")
    with pytest.raises(InputError, match="match_1_2.football.samples.ball: no 'time'"):
        read_joint_match(path)
    assert "the ball" not in " ".join(read_joints(path).notes)  # not opened where only bodies are wanted
    write_balls(path, ball, is_seen, day=23)
    match, _ = read_joint_match(path)
    (line,) = [line for line in (*match.notes, *match.report) if "the ball" in line]
    assert "86400 to 86402.98 s, do not overlap the joints', 0 to 2.98 s" in line


def test_the_report_names_what_was_seen(seen_match):
    _, _, out = seen_match
    (row,) = json.loads((out / "match.json").read_text())["players"]
    assert row["status"] == "done" and len(row["bodies"]) == 2
    assert row["bodies"][0]["to_s"] == pytest.approx(GAP[0], abs=0.1)
    assert all(one["joint_error_m"]["mean"] < 0.06 for one in row["bodies"])
    assert SOURCE in next(out.glob("*.provenance.csv")).read_text()


def test_a_player_with_bodies_comes_back_from_a_file(seen_match, tmp_path):
    _, _, out = seen_match
    path = next(out.glob("*.take.npz"))
    edit = read_player(path)
    write_player(tmp_path / "again.npz", edit)
    (stretch,) = edit.stretches
    assert (tmp_path / "again.npz").read_bytes() == path.read_bytes() and stretch.plan.bodies
    stopped = replace(stretch.plan, bodies=tuple(replace(body, fps=0.0) for body in stretch.plan.bodies))
    write_player(tmp_path / "damaged.npz", replace(edit, stretches=(replace(stretch, plan=stopped),)))
    with pytest.raises(InputError, match="0 frames per second"):
        read_player(tmp_path / "damaged.npz")


def test_beside_dots_only_what_is_seen_comes_from_joints(sample_cache, tmp_path):
    """A walk on the spot that is carried along a player's dots from 4 to 7 s, on a clock of its own."""
    dots = read_match(SMALL / "small.dat")
    at = np.arange(4.0, 7.0, 1.0 / FPS)
    path = np.stack([np.interp(at, dots.times, values) for values in dots.positions[
        [player.id for player in dots.players].index("home_10")].T], axis=1)
    joints = sample_joints("walking_1_2", FPS)[: len(at)].copy()
    hips = joints[:, [NAMES.index("left_hip"), NAMES.index("right_hip")], :2].mean(axis=1)
    joints[..., :2] += (path[: len(joints)] - hips)[:, None]
    table = write_table(tmp_path / "joints.csv", {"7": joints}, FPS)
    (tmp_path / "home_10.txt").write_text("3.5 kick right low\n5 kick right low\n")
    status = main(["match", "--tracking", str(SMALL / "small.dat"), "--joints", str(table), "--library", str(LIBRARY),
                   "--cache", str(sample_cache), "--out", str(tmp_path / "out"), "--from", "3", "--to", "8",
                   "--players", "home_10", "home_7", "--no-figures", "--workers", "1",
                   "--annotations", str(tmp_path)])  # fmt: skip
    state = json.loads((tmp_path / "out" / "match.json").read_text())
    rows = {row["id"]: row for row in state["players"]}
    assert status == 0 and "bodies" not in rows["home_7"] and "joints" in state["identity"]
    (body,) = rows["home_10"]["bodies"]
    assert [body["from_s"], body["to_s"]] == pytest.approx([4.0, 4.0 + (len(joints) - 1) / FPS], abs=0.06)
    assert body["joint_error_m"]["mean"] < 0.03 and any("clock is 4.0" in note for note in state["notes"])
    (told,) = [note for note in state["notes"] if note.startswith("home_10.txt")]
    assert told.startswith("home_10.txt: 1 of your lines is shown as the joints have it, not as the label says, where "
                           "joints show the player: from 4 to 6.9")
