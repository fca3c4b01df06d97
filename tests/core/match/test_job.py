"""A match from file to folder: what is in it, and that neither workers, kills, edits nor a bad player change others."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import UserCancelledError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.tables import read_ball, read_rows
from beyond_mocap.files.tracking.tracking import read_match
from beyond_mocap.library.build import build_library
from beyond_mocap.match.displayed_motion import construct_displayed_player
from beyond_mocap.match.folder import read_state
from beyond_mocap.match.pieces.constructed_motion import MOTION
from beyond_mocap.match.player_file import read_player
from beyond_mocap.match.synthesize_match import synthesize_match
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.provenance import read_provenance
from tests.core.cli.test_command_line import assert_contract
from tests.core.match.small_match import LIBRARY, PLAYERS, SECONDS, SMALL, TOP, read_reproducible_files

FRAMES = round((SECONDS[1] - SECONDS[0]) * 30.0) + 1


def touches():
    """(seconds, player, x, y) of the planted touches in the stretch, but for those of dribbles, which are no key
    moments."""
    rows = [row for _, row in read_rows(SMALL / "small_touches.csv", ("time_s", "player", "words", "x_m", "y_m"))]
    return [(float(row["time_s"]), row["player"], float(row["x_m"]), float(row["y_m"])) for row in rows
            if SECONDS[0] < float(row["time_s"]) < SECONDS[1] and row["words"] != "dribble"]  # fmt: skip


def test_everything_promised_is_in_the_folder(made):
    folder, result = made
    assert sorted(one.id for one in result.finished) == sorted(PLAYERS) and not result.failed and result.span == SECONDS
    state = read_state(folder)
    assert (state["status"], state["title"], state["from_s"], state["to_s"]) == ("done", "Reds - Blues", *SECONDS)
    assert [row["status"] for row in state["players"]] == ["done"] * 3
    for row in state["players"]:
        assert row["units"] == row["units_done"] == 2
        for kind in ("take", "report", "provenance", "bvh"):
            assert (folder / row[kind]).is_file()
        motion = bvh.read_bvh(folder / row["bvh"], 0.01).motion
        provenance = read_provenance(folder / row["provenance"])
        assert len(motion) == len(provenance) == FRAMES and provenance.times[0] == SECONDS[0]
        report = json.loads((folder / row["report"]).read_text())
        assert_contract(report)
        assert report["root_error_m"]["mean"] < 0.005 and (report["id"], report["team"]) == (row["id"], row["team"])
        assert report["per_second"]["start_s"] == 3 and len(report["per_second"]["root_error_m"]) == 9
    assert set(state["seconds"]) >= {"read", "library", "ball", "words", "search", "crowd", "figures", "total"}
    assert "Cora Wing" in (folder / "report.html").read_text()


def test_players_are_where_the_tracking_has_them_and_the_ball_where_it_is_touched(made):
    folder, _ = made
    match, ball = read_match(SMALL / "small.dat"), read_ball(folder / "ball.csv")
    assert len(ball.times) == FRAMES and np.isfinite(ball.positions).all()
    for player in PLAYERS:
        motion, track = bvh.read_bvh(folder / f"{player}.bvh", 0.01).motion, match.track(player, *SECONDS)
        times = SECONDS[0] + np.arange(FRAMES) / 30.0
        wanted = np.stack([np.interp(times, track.times, column) for column in track.positions.T], axis=1)
        assert np.linalg.norm(motion.root_positions[:, :2] - wanted, axis=1).mean() < 0.12
    for when, _, x, y in touches():
        at = [np.interp(when, ball.times, column) for column in ball.positions[:, :2].T]
        assert np.hypot(at[0] - x, at[1] - y) < 0.5
    for when, player, *_ in touches():
        if player in PLAYERS:
            keys = json.loads((folder / f"{player}.report.json").read_text())["keys"]
            assert min(abs(when - key["time_s"]) for key in keys) < 0.15


def test_a_player_is_shown_from_his_file_as_he_was_written(made, sample_cache):
    folder, _ = made
    edit, ball = read_player(folder / "home_7.take.npz"), read_ball(folder / "ball.csv")
    library = build_library(LIBRARY, cache_dir=sample_cache)
    (take,) = construct_displayed_player(library, edit, ball, *SECONDS)
    motion = bvh.read_bvh(folder / "home_7.bvh", 0.01).motion
    assert np.abs(take.motion.root_positions - motion.root_positions).max() < 1e-4
    assert len(read_provenance(folder / "home_7.provenance.csv").clip) == len(take.clip)


@pytest.mark.parametrize("span", [(SECONDS[0] + 1.0, SECONDS[0] + 3.5), (SECONDS[0], SECONDS[1] - 1.5)])
def test_a_frame_looks_the_same_whatever_span_is_shown(made, sample_cache, span):
    """The head too, whose turn to the ball is smoothed over time."""
    folder, _ = made
    edit, ball = read_player(folder / "home_7.take.npz"), read_ball(folder / "ball.csv")
    library = build_library(LIBRARY, cache_dir=sample_cache)
    (whole,), (part,) = construct_displayed_player(library, edit, ball, *SECONDS), construct_displayed_player(library,
            edit, ball, *span)
    at = slice(round(30.0 * (span[0] - SECONDS[0])), round(30.0 * (span[1] - SECONDS[0])) + 1)
    assert part.start_time == span[0] and part.clip_frame.tolist() == whole.clip_frame[at].tolist()
    assert np.array_equal(part.motion.root_positions, whole.motion.root_positions[at])
    assert np.allclose(np.abs(part.motion.rotations), np.abs(whole.motion.rotations[at]), rtol=0.0, atol=1e-12)


def test_a_ball_that_is_told_of_for_a_part_only_is_unknown_in_the_rest(made, sample_cache):
    folder, _ = made
    edit, ball = read_player(folder / "home_7.take.npz"), read_ball(folder / "ball.csv")
    part = BallPath(*(values[60:150] for values in (ball.times, ball.positions, ball.measured)))
    library = build_library(LIBRARY, cache_dir=sample_cache)
    (take,) = construct_displayed_player(library, edit, part, *SECONDS)
    known = np.isfinite(take.ball.positions).all(axis=1)
    assert np.flatnonzero(known).tolist() == list(range(60, 150)) and len(known) == len(take.motion) == FRAMES
    assert np.array_equal(take.ball.positions[60:150], part.positions) and np.allclose(take.ball.times, ball.times)


def command(order):
    """The order as the command has it, prepared by workers like a long one; windows are what no option tells."""
    return [sys.executable, "-c", f"""
import sys; sys.path.insert(0, {str(TOP)!r})
from pathlib import Path, PosixPath
from beyond_mocap.match.pieces import preparation
from beyond_mocap.match.synthesize_match import synthesize_match
from beyond_mocap.match.request import MatchRequest
preparation.LONG_SECONDS = 0.0
if __name__ == "__main__":
    synthesize_match({order!r})
"""]  # fmt: skip


@pytest.mark.parametrize("kind, workers", [("search", 1), (MOTION, 1), ("crowd", 2)])
def test_neither_a_kill_nor_the_number_of_workers_changes_a_bit(made, order_to, tmp_path, kind, workers):
    """Two workers before the kill, one or two after it, and none in `made`."""
    order = order_to(tmp_path / "killed", workers=2)
    process = subprocess.Popen(command(order), start_new_session=True)
    deadline = time.monotonic() + 600.0
    while not list((order.out / ".work" / kind).glob("*.npz")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    state = read_state(order.out)
    assert state["status"] == "running" and state["worker_cpu_s"]["words"] > 0.0
    kept = {path: path.stat().st_mtime_ns for path in (order.out / ".work").rglob("*.npz")
            if path.parent.name != MOTION}  # fmt: skip
    synthesize_match(replace(order, workers=workers))
    assert read_reproducible_files(order.out) == read_reproducible_files(made[0])
    assert kept and all(path.stat().st_mtime_ns == when for path, when in kept.items())
    assert not list((order.out / ".work" / MOTION).iterdir())  # it is stored only while it is needed


def test_what_is_cancelled_is_told_and_gone_on_with(made, order_to, tmp_path):
    order, told = order_to(tmp_path / "cancelled"), []

    def progress(fraction, text):
        told.append((fraction, text))

    with pytest.raises(UserCancelledError):
        synthesize_match(order, progress, lambda: any("windows" in text for _, text in told))
    state = read_state(order.out)
    assert state["status"] == "cancelled" and sum(row["units_done"] for row in state["players"]) == 1
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)
    synthesize_match(order)
    assert read_reproducible_files(order.out) == read_reproducible_files(made[0])


def test_figures_that_are_made_outlast_a_run_that_ends_before_them(made, order_to, tmp_path):
    order = order_to(tmp_path / "again")
    shutil.copytree(made[0], order.out)
    before = {path: path.stat().st_mtime_ns for path in order.out.glob("*.report.json")}
    text = order.out / "annotations" / "away_6.txt"
    words, told = text.read_text(), []
    text.write_text(words + "9.5 kick right\n")
    with pytest.raises(UserCancelledError):
        synthesize_match(order, lambda fraction, line: told.append(line),
                         lambda: any("windows" in line for line in told))
    assert read_state(order.out)["status"] == "cancelled"
    text.write_text(words)
    synthesize_match(order)
    assert len(before) == 3 and before == {path: path.stat().st_mtime_ns for path in before}
    assert read_reproducible_files(order.out) == read_reproducible_files(made[0])
    assert [row["status"] for row in read_state(order.out)["players"]] == ["done"] * 3


def test_a_cut_state_is_told_and_nothing_is_searched_again(made, order_to, tmp_path):
    order = order_to(tmp_path / "cut")
    shutil.copytree(made[0], order.out)
    state = order.out / "match.json"
    state.write_bytes(state.read_bytes()[:-2000])
    pieces = {path: path.stat().st_mtime_ns for path in order.out.glob(".work/*/*.npz")}
    result = synthesize_match(order)
    assert [line for line in result.notes if "not valid JSON" in line and "renamed to match.json.damaged" in line]
    assert pieces and pieces == {path: path.stat().st_mtime_ns for path in order.out.glob(".work/*/*.npz")}
    (order.out / "match.json.damaged").unlink()
    assert read_reproducible_files(order.out) == read_reproducible_files(made[0])


def test_edited_words_touch_their_player_and_nobody_else(made, order_to, tmp_path):
    order = order_to(tmp_path / "edited")
    shutil.copytree(made[0], order.out)
    before, pieces = read_reproducible_files(order.out), set((order.out / ".work" / "search").iterdir())
    text = order.out / "annotations" / "away_6.txt"
    text.write_text(text.read_text() + "9.5 kick right\n")
    synthesize_match(order)
    after = read_reproducible_files(order.out)
    assert {name for name in before if before[name] != after[name]} - {"ball.csv"} >= {"away_6.take.npz", "away_6.bvh"}
    others = [name for name in before if "away_6" not in name and name.endswith("take.npz")]
    assert len(others) == 2 and all(before[name] == after[name] for name in others)
    keys = json.loads(after["away_6.report.json"])["keys"]
    assert any(key["time_s"] == 9.5 and "kick" in key["labels"] for key in keys)
    assert len(set((order.out / ".work" / "search").iterdir()) - pieces) in (1, 2)  # windows with 9.5 s in them


def test_one_bad_player_stops_nobody(made, order_to, tmp_path):
    (tmp_path / "words").mkdir()
    (tmp_path / "words" / "home_7.txt").write_text("5 header subtle\n")
    result = synthesize_match(order_to(tmp_path / "bad", annotations=tmp_path / "words", nearest=False))
    assert {one.id for one in result.finished} == {"away_6", "home_10"}
    assert [one.id for one in result.failed] == ["home_7"] and "header subtle" in result.failed[0].reason
    state = read_state(tmp_path / "bad")
    assert state["status"] == "partial"
    assert {row["id"]: row["status"] for row in state["players"]}["home_7"] == "failed"
    good = read_reproducible_files(made[0])
    assert read_reproducible_files(tmp_path / "bad")["away_6.bvh"] == good["away_6.bvh"]


def test_a_cluster_that_loses_a_worker_gives_the_same_bits(made, order_to, tmp_path, cluster):
    address, processes = cluster
    killed = []

    def progress(fraction, text):
        if "windows" in text and not killed:
            killed.append(processes[1].pid)
            os.kill(processes[1].pid, signal.SIGKILL)

    synthesize_match(order_to(tmp_path / "spread", scheduler=address), progress)
    assert killed and read_reproducible_files(tmp_path / "spread") == read_reproducible_files(made[0])
