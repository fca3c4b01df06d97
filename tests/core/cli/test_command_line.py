"""The command: exit statuses, one line for what is wrong, nothing half-written, and tables that can be read back."""

import io
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.annotation import read_timeline
from beyond_mocap.cli.main import _InterruptHandler, main
from beyond_mocap.cli.outputs import ProgressReporter
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.bvh.bvh_write import BvhForm, JointAboveHips
from beyond_mocap.files.tables import read_ball, write_ball
from beyond_mocap.library.clip import KICK_PREFIX, SYNTHETIC_FOLDER
from beyond_mocap.library.missing_actions import ACTION_PREFIX
from beyond_mocap.motion.humanoid import estimate_stature
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.provenance import read_provenance
from tests.core.report_contract import assert_contract

TOP = Path(__file__).resolve().parents[3]
DATA = TOP.parent / "shared" / "data"


@pytest.fixture(scope="module")
def match(tmp_path_factory, track_of):
    """A folder with a track that has a ball, and annotations with a kick that the library has."""
    folder = tmp_path_factory.mktemp("match")
    track = track_of(lambda t: 1.6 + 0.2 * t, 6.0, turn=0.1, ball=True)
    rows = np.column_stack([track.times, track.positions, track.ball])
    header = "time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m\n"
    (folder / "track.csv").write_text(header + "\n".join(",".join(f"{v:.4f}" for v in row) for row in rows) + "\n")
    (folder / "track_only.csv").write_text(
        "time_s,x_m,y_m\n" + "\n".join(",".join(f"{v:.4f}" for v in r[:3]) for r in rows) + "\n"
    )
    (folder / "words.txt").write_text("0 6\n3 kick right\n")
    (folder / "empty.txt").write_text("")
    (folder / "header.txt").write_text("3 header subtle\n")  # no synthetic action shows it either
    return folder


@pytest.fixture
def synthesize(run, clips_folder, library, match, tmp_path):
    """synthesize(*more, **options) -> as run; by default the match's track and words, out to tmp_path/out.bvh."""

    def call(*more, **options):
        options = {"library": clips_folder, "track": match / "track.csv", "annotations": match / "words.txt",
                   "out": tmp_path / "out.bvh", **options}  # fmt: skip
        pairs = [part for name, value in options.items() if value is not None for part in (f"--{name}", value)]
        return run("synthesize", *pairs, *more)

    return call


def assert_told(result, status, *parts):
    """The status, and one line on stderr that says all of `parts`."""
    code, out, error = result
    assert code == status, (code, error)
    assert len(error) == 1 and error[0].startswith("beyond-mocap"), error
    assert "Traceback" not in error[0]
    for part in parts:
        assert str(part) in error[0], error[0]
    assert out == ""


def files_in(folder) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_the_library_is_told(run, clips_folder, library, tmp_path):
    status, out, error = run("library", clips_folder, "--report", tmp_path / "r.json")
    assert (status, error) == (0, [])
    lines = out.splitlines()
    assert "6 clips" in lines[0] and "0.5 minutes" in lines[0]
    assert "standing 0.0 m/s, walking 1.4 m/s, jogging 2.8 m/s, running 5.0 m/s" in out
    assert "kick left inside low" in out and "kick right inside low" in out
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["clips"] == 6 and len(report["gaits"]) == 4 and "kick" in report["words"]


def test_a_library_without_labels_is_described_and_used_with_proposed_ones(run, match, clip_file, tmp_path):
    clips = tmp_path / "clips"
    clip_file(clips / "walk.bvh", 1.4, 4.0, words="")
    clip_file(clips / "run.bvh", 4.5, 4.0, words="")
    status, out, error = run("library", clips, "--report", tmp_path / "r.json")
    assert (status, error) == (0, []) and "labels proposed for 2 clips" in out
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["proposed_clips"] == 2 and {"walking", "running"} <= set(report["words"])
    status, _, error = run("synthesize", "--library", clips, "--track", match / "track_only.csv", "--no-made",
                           "--annotations", match / "empty.txt", "--out", tmp_path / "out.bvh")
    assert status == 0 and any("labels proposed for 2 clips" in line for line in error)


def test_the_report_says_what_is_left_out_and_what_lacks(run, clips_folder, library, tmp_path):
    status, out, _ = run("library", clips_folder, "--report", tmp_path / "r.json")
    report = json.loads((tmp_path / "r.json").read_text())
    assert status == 0 and report["proposed_clips"] == 0
    lacking = {one["kind"] for one in report["lacks"]}
    assert "turns" in lacking and "hardly any turns in place: add some" in out
    assert sum(one["seconds"] for one in report["locomotion"]) > 15.0 and report["locomotion"][-1]["to_m_s"] is None
    assert all(one["start_s"] <= one["end_s"] and one["why"] for one in report["left_out"])


def test_the_cache_can_be_put_elsewhere_and_made_anew(run, tmp_path, clip_file):
    clip_file(tmp_path / "clips" / "walk.bvh", 1.4, 1.5)
    for more in ((), ("--rebuild",)):
        assert run("library", tmp_path / "clips", "--cache", tmp_path / "kept", *more)[0] == 0
    assert (tmp_path / "kept" / "library.json").is_file() and not (tmp_path / "clips" / ".beyond_mocap").exists()


@pytest.mark.parametrize("method", ["path", "distance", "blocks"])
def test_everything_asked_for_is_written_and_can_be_read(synthesize, run, match, clips_folder, tmp_path, method):
    status, out, _ = synthesize(
        method=method, provenance=tmp_path / "p.csv", ball=tmp_path / "b.csv", report=tmp_path / "r.json", fps=25
    )
    assert status == 0 and "out.bvh: 151 frames, 6.0 s" in out
    assert sorted(files_in(tmp_path)) == ["b.csv", "out.bvh", "p.csv", "r.json"]
    motion = bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion
    provenance, ball = read_provenance(tmp_path / "p.csv"), read_ball(tmp_path / "b.csv")
    assert len(motion) == len(provenance) == len(ball.times) == 151 and motion.fps == pytest.approx(25.0)
    assert "kick.bvh" in provenance.clip
    assert all((clips_folder / clip).is_file() for clip in set(provenance.clip))
    assert provenance.times[75] == pytest.approx(3.0)
    report = json.loads((tmp_path / "r.json").read_text())
    assert_contract(report)
    key = report["keys"][0]
    assert (key["clip"], key["time_s"], key["used_instead"]) == ("kick.bvh", 3.0, None)
    assert abs(key["time_error_s"]) <= 0.5 / 25
    if method == "path":
        assert report["root_error_m"]["mean"] < 0.01


def test_what_was_written_can_be_evaluated(synthesize, run, match, clips_folder, tmp_path):
    assert synthesize(provenance=tmp_path / "p.csv", ball=tmp_path / "b.csv", report=tmp_path / "r.json")[0] == 0
    status, out, error = run(
        "evaluate", tmp_path / "out.bvh", "--track", match / "track.csv", "--annotations", match / "words.txt",
        "--provenance", tmp_path / "p.csv", "--ball", tmp_path / "b.csv", "--library", clips_folder,
        "--report", tmp_path / "e.json",
    )  # fmt: skip
    mine, again = (json.loads((tmp_path / name).read_text()) for name in ("r.json", "e.json"))
    assert (status, error) == (0, [f"note: {line}" for line in (*again["warnings"], *again["notes"])])
    lines = out if isinstance(out, list) else out.splitlines()
    assert re.fullmatch(r"\d+ of \d+ targets met", lines[0]) and lines[-1] == str(tmp_path / "e.json")
    assert any(line.startswith("not known: naturalness.") for line in lines)
    assert_contract(again)
    assert again["root_error_m"]["mean"] == pytest.approx(mine["root_error_m"]["mean"], abs=1e-3)
    assert again["keys"][0]["clip"] == mine["keys"][0]["clip"]
    assert again["frames"] == mine["frames"]
    # what only the synthesis knows is left out with its reason, and not computed in another way
    assert again["foot_correction_m"]["p95"] is None and mine["foot_correction_m"]["p95"] is not None
    assert "not known: foot_correction_m.p95, known only while the take is made" in lines
    head = "head_off_ball_deg_median"
    assert again["naturalness"][head] == pytest.approx(mine["naturalness"][head], abs=0.1)
    without = run("evaluate", tmp_path / "out.bvh", "--track", match / "track.csv", "--provenance", tmp_path / "p.csv",
                  "--library", clips_folder, "--report", tmp_path / "n.json")
    assert sum("no angle between head and ball; name it with --ball" in line for line in without[2]) == 1
    assert head not in json.loads((tmp_path / "n.json").read_text())["naturalness"]


def test_what_does_not_belong_together_is_told_by_evaluate(synthesize, run, match, clips_folder, tmp_path):
    assert synthesize(provenance=tmp_path / "p.csv")[0] == 0
    (tmp_path / "late.txt").write_text("99 kick right\n")
    (tmp_path / "other.csv").write_text((tmp_path / "p.csv").read_text().replace(".bvh", "_x.bvh"))
    both = ("evaluate", tmp_path / "out.bvh", "--library", clips_folder, "--report", tmp_path / "e.json")
    late = run(*both, "--track", match / "track.csv", "--annotations", tmp_path / "late.txt")
    assert_told(late, 2, "late.txt:1", "99 s")
    assert not (tmp_path / "e.json").exists()
    status, _, error = run(*both, "--provenance", tmp_path / "other.csv")
    assert status == 0 and "_x.bvh" in error[-1] and "not in" in error[-1]
    assert not any("not in" in line for line in run(*both, "--provenance", tmp_path / "p.csv")[2])


def test_evaluate_says_what_it_cannot_know_and_what_it_replaces(synthesize, run, match, tmp_path):
    pytest.importorskip("matplotlib")
    assert synthesize(report=tmp_path / "r.json")[0] == 0
    (tmp_path / "far.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{t / 10},{t / 5 + 50},0\n" for t in range(200)))
    command = ("evaluate", tmp_path / "out.bvh", "--unit", 0.01, "--annotations", match / "words.txt",
               "--report", tmp_path / "r.json")
    status, _, error = run(*command, "--track", tmp_path / "far.csv", "--html", tmp_path / "r.html")
    assert status == 0 and "played: unknown" in (tmp_path / "r.html").read_text()
    for part in ("far.csv 19.9 s; check", "m from .*far.csv on average", "clips that played are unknown",
                 "r.json: replaces the report of synthesize"):
        assert any(re.search(part, line) for line in error), part
    assert not any("replaces" in line for line in run(*command)[2])


@pytest.mark.parametrize(("name", "text"), [("player", "player"), ("one_track", "one_annotations")])
def test_labels_are_those_beside_the_track_or_automatic(synthesize, match, tmp_path, name, text):
    track, labels = tmp_path / f"{name}.csv", tmp_path / f"{text}.txt"
    track.write_bytes((match / "track.csv").read_bytes())
    for expected in (0, 1):
        status, _, error = synthesize(annotations=None, track=track, report=tmp_path / "r.json")
        assert status == 0 and len(json.loads((tmp_path / "r.json").read_text())["keys"]) == expected
        assert any(f"{track.name}: with the labels of {labels}" in line for line in error) == bool(expected)
        labels.write_text("3 kick right\n")


def test_same_seed_same_file(synthesize, tmp_path):
    contents = []
    for name in ("a.bvh", "b.bvh"):
        assert synthesize(out=tmp_path / name)[0] == 0
        contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]


def test_an_empty_annotation_file_is_all_automatic(synthesize, match, tmp_path):
    assert synthesize(annotations=match / "empty.txt", report=tmp_path / "r.json")[0] == 0
    assert json.loads((tmp_path / "r.json").read_text())["keys"] == []


def test_a_track_without_a_ball_writes_none_and_tells(synthesize, match, tmp_path):
    status, _, error = synthesize(track=match / "track_only.csv", ball=tmp_path / "b.csv")
    assert status == 0 and not (tmp_path / "b.csv").exists()
    assert any("has no ball" in line for line in error)


def test_a_root_above_the_hips_and_a_ball_come_back_where_they_are_asked_for(run, synthesize, match, clips_folder,
                                                                             tmp_path):
    folder = tmp_path / "rooted"
    folder.mkdir()
    still = JointAboveHips(name="World", channels=(), is_moving=False, position=np.array([0.0, 0.5, 0.0]),
                           rotation=np.array([1.0, 0.0, 0.0, 0.0]))
    for name in ("walk", "jog"):
        motion = bvh.read_bvh(clips_folder / f"{name}.bvh").motion
        bvh.write_bvh(folder / f"{name}.bvh", motion, BvhForm(above=(still,)))
        (folder / f"{name}.txt").write_text(f"0 4 {name}ing front\n".replace("jog", "jogg"))
        ball = motion.root_positions * [1, 1, 0] + [0.4, 0.0, 0.11]
        write_ball(folder / f"{name}.ball.csv", BallPath(np.arange(len(ball)) / 30.0, ball, np.ones(len(ball), bool)))
    order = ["synthesize", "--library", folder, "--track", match / "track_only.csv", "--annotations",
             match / "empty.txt", "--ball", tmp_path / "ball.csv", "--no-made"]
    status, _, error = run(*order, "--out", tmp_path / "plain.bvh")
    assert status == 0 and any("--recorded-ball takes that of the recordings" in line for line in error)
    assert not (tmp_path / "ball.csv").exists()
    for more in ((), ("--window", "25")):
        status, _, error = run(*order, *more, "--recorded-ball", "--keep-root", "--out", tmp_path / "rooted.bvh")
        assert status == 0, error
        plain, rooted = (bvh.read_bvh(tmp_path / f"{name}.bvh") for name in ("plain", "rooted"))
        assert [joint.name for joint in rooted.form.above] == ["World"] and plain.form.above == ()
        assert np.allclose(rooted.form.above[0].position, still.position, atol=1e-6)
        assert np.isfinite(read_ball(tmp_path / "ball.csv").positions).sum() > 60
        (tmp_path / "ball.csv").unlink()
    told = synthesize("--keep-root")
    assert told[0] == 0 and any("--keep-root adds none" in line for line in told[2])


def test_windows_line_ends_and_a_byte_order_mark(synthesize, match, tmp_path):
    for name in ("track.csv", "words.txt"):
        text = (match / name).read_text().replace("\n", "\r\n")
        (tmp_path / name).write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert synthesize(track=tmp_path / "track.csv", annotations=tmp_path / "words.txt")[0] == 0


def test_mirror(run, clips_folder, tmp_path):
    once, twice = tmp_path / "once.bvh", tmp_path / "twice.bvh"
    assert run("mirror", clips_folder / "walk.bvh", once)[0] == 0
    assert run("mirror", once, twice)[0] == 0
    motions = [bvh.read_bvh(path, 0.01).motion for path in (clips_folder / "walk.bvh", once, twice)]
    assert np.allclose(motions[0].root_positions, motions[2].root_positions, atol=1e-4)
    assert np.allclose(motions[0].root_positions * [1, -1, 1], motions[1].root_positions, atol=1e-4)


def test_mirror_does_not_overwrite_its_input(run, clips_folder, tmp_path):
    clip = tmp_path / "walk.bvh"
    clip.write_bytes(before := (clips_folder / "walk.bvh").read_bytes())
    assert_told(run("mirror", clip, tmp_path / "." / "walk.bvh"), 2, "walk.bvh", "different files")
    assert clip.read_bytes() == before


def test_a_console_of_another_script_is_written_to_all_the_same(clips_folder, tmp_path, monkeypatch):
    console = io.TextIOWrapper(io.BytesIO(), encoding="cp1252", errors="strict")
    monkeypatch.setattr(sys, "stdout", console)
    assert main(["mirror", str(clips_folder / "walk.bvh"), str(tmp_path / "\u0110or\u0111e.bvh")]) == 0
    console.flush()
    assert b"\\u0110or\\u0111e.bvh: " in console.buffer.getvalue()


def test_help_and_version(run):
    status, out, _ = run("--help")
    assert status == 0 and "synthesize" in out
    status, out, _ = run("--version")
    assert status == 0 and out.startswith("beyond-mocap 0.")
    assert run("synthesize", "--help")[0] == 0


@pytest.mark.parametrize(
    "arguments",
    [(), ("fly",), ("library",), ("synthesize", "--out", "x.bvh"), ("mirror", "a.bvh"), ("library", "x", "--what")],
)
def test_a_wrong_command_line_is_status_2(run, arguments):
    assert_told(run(*arguments), 2)


@pytest.mark.parametrize("command, arguments", [("library", ["L"]), ("throw examples", ["--out", "o"])])
def test_an_unknown_option_points_to_the_help_of_its_command(run, command, arguments):
    result = run(*command.split(), *arguments, "--what")
    assert_told(result, 2, f"beyond-mocap {command}: ", "--what", f"see 'beyond-mocap {command} --help'")


@pytest.mark.parametrize(
    "options, parts",
    [
        ({"fps": "0"}, ["--fps", "0"]),
        ({"fps": "-5"}, ["--fps"]),
        ({"fps": "many"}, ["--fps", "many"]),
        ({"fps": "nan"}, ["--fps"]),
        ({"fps": "5000"}, ["fps", "5000"]),
        ({"alpha": "2"}, ["--alpha", "2"]),
        ({"omega": "0.5"}, ["omega", "0.5", "1 or more"]),
        ({"seam-window": "wide"}, ["--seam-window", "wide"]),
        ({"track-window": "-1"}, ["--track-window", "-1"]),
        ({"gait": "walking"}, ["gait", "LABEL=CLIP"]),
        ({"gait": "walking=missing.bvh"}, ["gaits", "missing.bvh"]),
        ({"seed": "x"}, ["--seed"]),
        ({"method": "magic"}, ["magic", "path"]),
        ({"unit": "0"}, ["--unit"]),
        ({"out": "nowhere/deep/out.bvh"}, ["nowhere/deep/out.bvh", "folder"]),
        ({"out": "out.xyz"}, ["out.xyz", ".bvh"]),
        ({"out": "out"}, ["out", ".bvh"]),
        ({"report": "nowhere/r.json"}, ["nowhere/r.json", "folder"]),
        ({"provenance": "nowhere/p.csv"}, ["nowhere/p.csv", "folder"]),
        ({"ball": "."}, ["folder"]),
        ({"track": "missing.csv"}, ["missing.csv"]),
        ({"annotations": "missing.txt"}, ["missing.txt"]),
        ({"library": "missing"}, ["missing", "folder"]),
        ({"skeleton": "missing.bvh"}, ["missing.bvh"]),
    ],
)
def test_wrong_options_and_missing_files_are_status_2(synthesize, tmp_path, monkeypatch, options, parts):
    monkeypatch.chdir(tmp_path)
    assert_told(synthesize(**options), 2, *parts)
    assert files_in(tmp_path) == {}


ROW = "0,0,0\n0.1,0.1,0\n0.2,0.2,0\n"


@pytest.mark.parametrize(
    "content, parts",
    [
        (b"time_s,x_m\n0,0\n", ["y_m"]),
        (b"", []),
        (b"\x00\x01\x02\x00", []),
        (("time_s,x_m,y_m\n" + ROW + "0.3,far,0\n").encode(), [":5", "x_m"]),
        (("time_s,x_m,y_m\n" + ROW + "0.3,1\n").encode(), [":5"]),
        (b"time_s,x_m,y_m\n0,0,0\n", ["two"]),
        (b"time_s,x_m,y_m\n0,0,0\n0,1,0\n", []),
        (b"time_s,x_m,y_m\n0,0,0\n1000,1,0\n2000,2,0\n", ["5 to 100"]),
        (("time_s,x_m,y_m\n" + ROW + "0.3,1e30,0\n").encode(), [":5"]),
        (("time_s,x_m,y_m\n" + ROW + "0.3,inf,0\n").encode(), [":5"]),
        (b"time_s,x_m,y_m\n\xff\xfe,0,0\n", []),
    ],
    ids=["column", "empty", "binary", "word", "cells", "one row", "one time", "rate", "huge", "infinite", "not UTF-8"],
)
def test_a_broken_track_is_told_with_its_line(synthesize, tmp_path, content, parts):
    (tmp_path / "bad.csv").write_bytes(content)
    assert_told(synthesize(track=tmp_path / "bad.csv"), 2, "bad.csv", *parts)
    assert sorted(files_in(tmp_path)) == ["bad.csv"]


@pytest.mark.parametrize(
    "text, parts",
    [
        ("0 6\n3 kikc right\n", [":2", "kikc", "kick"]),
        ("0 3 walkin\n", [":1", "walkin", "walking"]),
        ("3 kick\n4 5 walking\n4.5 6 jogging\n", ["overlap"]),
        ("99 kick right\n", [":1", "99", "track"]),
        ("-4 2 walking\n", [":1", "track"]),
        ("walking\n", [":1"]),
        ("5 3 walking\n", [":1"]),
        ("3\n", [":1"]),
        ("3 transition\n", [":1", "transition"]),
        ("1e99 kick\n", [":1"]),
    ],
)
def test_a_broken_annotation_is_told_with_its_line(synthesize, tmp_path, text, parts):
    (tmp_path / "bad.txt").write_text(text)
    assert_told(synthesize(annotations=tmp_path / "bad.txt"), 2, "bad.txt", *parts)
    assert sorted(files_in(tmp_path)) == ["bad.txt"]


BROKEN = {
    "cut off": lambda c: c[: len(c) * 2 // 3 + 7],
    "empty": lambda c: b"",
    "binary": lambda c: bytes(range(256)) * 20,
    "only a hierarchy": lambda c: c[: c.index(b"MOTION")],
    "a word among numbers": lambda c: c[:-400] + b" what " + c[-400:],
    "not a number": lambda c: c[: c.rindex(b"\n", 0, -1)] + b"\n" + b"nan " * 69 + b"\n",
    "no time": lambda c: c.replace(b"Frame Time: 0.0333", b"Frame Time: -0.333"),
    "zero time": lambda c: (
        c[: c.index(b"Frame Time:")] + b"Frame Time: 0\n" + c[c.index(b"\n", c.index(b"Frame Time:")) + 1 :]
    ),
    "channels": lambda c: c.replace(b"CHANNELS 3", b"CHANNELS 4", 1),
}


@pytest.mark.parametrize("damage", BROKEN.values(), ids=BROKEN)
def test_a_broken_recording_is_told(run, synthesize, clip_file, tmp_path, damage):
    clip_file(tmp_path / "clips" / "a.bvh", 1.4, 1.0)
    bad = clip_file(tmp_path / "clips" / "bad.bvh", 1.4, 1.0)
    bad.write_bytes(damage(bad.read_bytes()))
    before = files_in(tmp_path)
    assert_told(run("library", tmp_path / "clips"), 2, "bad.bvh")
    assert_told(synthesize(library=tmp_path / "clips"), 2, "bad.bvh")
    assert_told(run("mirror", bad, tmp_path / "out.bvh"), 2, "bad.bvh")
    assert_told(run("evaluate", bad, "--report", tmp_path / "r.json"), 2, "bad.bvh")
    assert files_in(tmp_path) == before


STICK = """HIERARCHY
ROOT a { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
JOINT b { OFFSET 0 50 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 50 0 } } }
MOTION
Frames: 2
Frame Time: 0.033333
0 90 0 0 0 0 0 0 0
0 90 0 0 0 0 0 0 0
"""


def test_libraries_that_are_none(run, synthesize, match, clip_file, tmp_path):
    folders = {name: tmp_path / name for name in ("empty", "stand", "two")}
    folders["empty"].mkdir()
    clip_file(folders["stand"] / "stand.bvh", 0.0, 1.5, "standing")
    clip_file(folders["two"] / "walk.bvh", 1.4, 2.0)
    other = clip_file(folders["two"] / "child.bvh", 1.4, 1.0)
    other.write_text(STICK)
    parts = {"empty": ["BVH"], "stand": ["locomotion"], "two": ["child.bvh", "legs"]}
    for name, folder in folders.items():
        assert_told(run("library", folder), 2, name, *parts[name])
        assert_told(synthesize(library=folder, annotations=match / "empty.txt"), 2, name, *parts[name])
    assert not (tmp_path / "out.bvh").exists()


def test_what_the_library_lacks_is_status_3_and_the_nearest_0(synthesize, match, tmp_path):
    assert_told(synthesize(annotations=match / "header.txt"), 3, "header.txt:1: 3 s: ", "kick", "or add --nearest")
    assert files_in(tmp_path) == {}
    status, _, error = synthesize("--nearest", annotations=match / "header.txt", report=tmp_path / "r.json")
    assert status == 0 and any("used instead" in line for line in error)
    key = json.loads((tmp_path / "r.json").read_text())["keys"][0]
    assert key["labels"] == ["header", "subtle"] and key["used_instead"]


def test_touches_are_solved_unless_that_is_refused(synthesize, match, tmp_path, track_of):
    track = track_of(2.8, 8.0)
    since = track.times - 4.03
    ball = track.times * 0.0 + np.where(since < 0, -3.0, 12.0) * since + 4.03 * 2.8 + 0.45
    rows = zip(track.times, *track.positions.T, ball, np.full(len(ball), 0.11))
    text = "time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m\n"
    text += "".join(f"{t:.3f},{x:.4f},{y:.4f},{b:.4f},0.0,{z}\n" for t, x, y, b, z in rows)
    (tmp_path / "kicked.csv").write_text(text)
    (tmp_path / "words.txt").write_text("0 8\n4.3 kick right\n")
    asked = {"track": tmp_path / "kicked.csv", "annotations": tmp_path / "words.txt", "report": tmp_path / "r.json"}
    keys = []
    for more in (("--no-solve-touches",), ("--solve-touches",), ()):
        assert synthesize(*more, **asked)[0] == 0
        keys += json.loads((tmp_path / "r.json").read_text())["keys"]
    assert [key["time_s"] for key in keys] == [4.3] * 3 and keys[0]["solved_time_s"] is None
    assert keys[1]["solved_time_s"] == pytest.approx(4.03, abs=0.02) and keys[1]["contact_gap_m"] < 0.005
    assert keys[1] == keys[2]


def test_touches_of_a_track_in_centimetres_are_refused_as_the_track_is(run, match, tmp_path):
    head, *rows = (match / "track.csv").read_text().splitlines()
    cells = [row.split(",") for row in rows]
    text = "\n".join([head, *(",".join([row[0], *(f"{100.0 * float(v)}" for v in row[1:])]) for row in cells)])
    (tmp_path / "cm.csv").write_text(text)
    assert_told(run("touches", tmp_path / "cm.csv", "--out", tmp_path / "t.csv"), 2,
                "cm.csv: positions look like centimetres")


def test_mirrors_can_be_forbidden(synthesize, tmp_path):
    (tmp_path / "left.txt").write_text("3 kick left\n")
    assert_told(synthesize("--no-mirror", annotations=tmp_path / "left.txt"), 3, "kick")
    assert synthesize(annotations=tmp_path / "left.txt")[0] == 0


def test_outputs_that_stand_already_are_left_alone_on_failure(synthesize, match, tmp_path):
    names = {"out": "out.bvh", "provenance": "p.csv", "ball": "b.csv", "report": "r.json"}
    for name in names.values():
        (tmp_path / name).write_text("mine")
    paths = {option: tmp_path / name for option, name in names.items()}
    for failing in ({"annotations": match / "header.txt"}, {"track": match / "none.csv"}, {"library": match}):
        assert synthesize(**paths, **failing)[0] in (2, 3)
        assert set(files_in(tmp_path).values()) == {b"mine"}
    assert synthesize(**paths)[0] == 0
    assert b"mine" not in files_in(tmp_path).values() and len(files_in(tmp_path)) == 4


def test_a_cache_folder_that_is_a_file_is_told(run, clips_folder, tmp_path):
    (tmp_path / "file").write_text("mine")
    assert_told(run("library", clips_folder, "--cache", tmp_path / "file"), 2, "file", "folder")


def test_json_lines_can_be_read_by_machines(run, synthesize, tmp_path, clip_file):
    clip_file(tmp_path / "clips" / "walk.bvh", 1.4, 1.5)
    for status, _, error in (run("library", tmp_path / "clips", "--json"), synthesize("--json")):
        assert status == 0 and len(error) > 3
        told = [json.loads(line) for line in error if not line.startswith("note: ")]
        shares = [line["progress"] for line in told if "progress" in line]
        assert all(0.0 <= share <= 1.0 for share in shares) and all(line["text"] for line in told if "progress" in line)
    status, _, error = synthesize("--json", track=tmp_path / "none.csv")
    assert status == 2 and "none.csv" in error[-1]


def test_what_a_library_says_of_itself_is_one_line_to_who_synthesizes(run, synthesize, clips_folder):
    status, out, _ = run("library", clips_folder)
    own = [line for line in out.splitlines() if line.startswith("unit ")]
    status, _, error = synthesize()
    assert status == 0 and own and not any(note in line for note in own for line in error)
    assert sum("the command 'library' prints all" in line for line in error) == 1


def test_no_progress_where_nobody_looks(run, clip_file, tmp_path):
    clip_file(tmp_path / "walk.bvh", 1.4, 1.5)
    assert run("library", tmp_path)[2] == []


def started(*arguments):
    """The command in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(TOP), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "beyond_mocap", *map(str, arguments)]
    return subprocess.Popen(command, env=environment, stdout=-1, stderr=-1, text=True)


def test_python_m_runs_it(clips_folder, library, match, tmp_path):
    process = started("synthesize", "--library", clips_folder, "--track", match / "track.csv", "--annotations",
                      match / "header.txt", "--out", tmp_path / "out.bvh")  # fmt: skip
    out, error = process.communicate(timeout=120)
    assert (process.returncode, out) == (3, "") and len(error.splitlines()) == 1


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGPIPE")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_output_that_is_not_read_ends_it_quietly(clips_folder, library, monkeypatch, unbuffered):
    monkeypatch.setenv("PYTHONUNBUFFERED", unbuffered)
    process = started("library", clips_folder)
    process.stdout.close()
    assert process.stderr.read() == "" and process.wait(120) == 141
    process.stderr.close()


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to one process")
@pytest.mark.parametrize("moment, kind", [("Reading", signal.SIGINT), ("Searching", signal.SIGINT),
                                          ("Searching", signal.SIGTERM)])  # fmt: skip
def test_ctrl_c_or_an_end_asked_for_stops_and_leaves_nothing(clips_folder, library, match, tmp_path, moment, kind):
    times = np.arange(0.0, 240.0, 0.1)
    rows = np.column_stack([times, 30 * np.sin(times / 9), 20 * np.cos(times / 7)])
    (tmp_path / "long.csv").write_text(
        "time_s,x_m,y_m\n" + "\n".join(",".join(f"{v:.3f}" for v in row) for row in rows)
    )
    before = files_in(tmp_path)
    more = ("--cache", tmp_path / "cache") if moment == "Reading" else ()
    arguments = {"library": clips_folder, "track": tmp_path / "long.csv", "annotations": match / "empty.txt"}
    outputs = {"out": tmp_path / "out.bvh", "report": tmp_path / "r.json"}
    options = [part for name, value in {**arguments, **outputs}.items() for part in (f"--{name}", value)]
    process = started("synthesize", "--json", *options, *more)
    for line in process.stderr:
        if json.loads(line)["text"].startswith(moment):
            process.send_signal(kind)
            break
    out, error = process.communicate(timeout=120)
    assert process.returncode == 130 and out == ""
    assert "cancelled" in error.splitlines()[-1] and "Traceback" not in error
    assert files_in(tmp_path) == before


def test_the_second_ctrl_c_breaks_off_what_does_not_listen():
    told = ProgressReporter(False)
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with _InterruptHandler(told), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
        assert told.is_cancelled()
        signal.raise_signal(signal.SIGINT)
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_the_first_ctrl_c_breaks_off_a_block_that_never_asks():
    told = ProgressReporter(False)
    with _InterruptHandler(told), pytest.raises(KeyboardInterrupt), told.stop_at_once():
        signal.raise_signal(signal.SIGINT)
        pytest.fail("the block went on")
    with _InterruptHandler(told := ProgressReporter(False)):
        with told.stop_at_once():
            pass
        signal.raise_signal(signal.SIGINT)
        assert told.is_cancelled()


def test_signals_that_python_did_not_set_are_left_as_the_system_has_them(monkeypatch):
    """Blender sets handlers of its own before Python: `signal.signal` then returns None, which it does not take
    back."""
    before = {kind: signal.getsignal(kind) for kind in (signal.SIGINT, signal.SIGTERM)}
    put = signal.signal
    with monkeypatch.context() as patched:
        patched.setattr(signal, "signal", lambda kind, handler: put(kind, handler) and None)
        with _InterruptHandler(ProgressReporter(False)):
            assert signal.getsignal(signal.SIGTERM) not in before.values()
    after = [signal.getsignal(kind) for kind in before]
    for kind, handler in before.items():
        put(kind, handler)
    assert after == [signal.SIG_DFL, signal.SIG_DFL]


needs_data = pytest.mark.skipif(
    not (DATA / "mocap" / "cmu10").is_dir(), reason="needs the recordings in ../shared/data"
)


@needs_data
@pytest.mark.parametrize("scenario", [3, 4])
def test_real_recordings(run, tmp_path_factory, recordings_cache, scenario):
    """CMU's subject 10 as the library: all methods with the nearest words, key times exact; without, status 3."""
    folder = tmp_path_factory.mktemp("real")
    track, words = (
        DATA / "tracking" / "scenarios" / f"scenario{scenario}_{kind}" for kind in ("track.csv", "annotations.txt")
    )
    library = ("--library", DATA / "mocap" / "cmu10", "--unit", 0.05644, "--cache", recordings_cache)
    written = ("--out", folder / "out.bvh", "--report", folder / "r.json")
    common = ("synthesize", *library, "--track", track, "--annotations", words, *written)
    asked = read_timeline(words, 30.0).keys
    assert_told(run(*common, "--no-made"), 3, "--nearest")
    assert files_in(folder) == {}
    for method in ("path", "distance", "blocks"):
        status, _, error = run(*common, "--nearest", "--method", method)
        by_path = method == "path"  # which alone builds what no recording shows
        assert status == 0 and any("used instead" in line for line in error) != by_path
        report = json.loads((folder / "r.json").read_text())
        assert_contract(report)
        assert [(key["time_s"], key["labels"]) for key in report["keys"]] == [(k.time, list(k.words)) for k in asked]
        for key in report["keys"]:
            if by_path or "kick" in key["labels"]:
                name = key["clip"].removeprefix(SYNTHETIC_FOLDER)
                assert name.startswith((KICK_PREFIX, ACTION_PREFIX) if by_path else "10_0")
                assert abs(key["time_error_s"]) <= 0.5 / 30 + 1e-6
            else:  # nothing in the library is near a slide or a ball on the chest
                assert key["used_instead"] and key["time_error_s"] is None
        if by_path:
            assert report["root_error_m"]["mean"] <= 0.01


def test_pins_height_foot_and_style_are_a_players_own(synthesize, tmp_path):
    (tmp_path / "pins.csv").write_text("time_s,part,x_m,y_m,z_m,hold_s\n2,gaze,30,0,1.5,0.5\n99,left_hand,0,0,1,\n")
    status, _, error = synthesize(
        "--strong-foot", "left", "--style", "kick*", report=tmp_path / "r.json", pins=tmp_path / "pins.csv", height=2.0
    )
    assert status == 0 and any("99 s: the pin of left_hand is outside" in line for line in error)
    report = json.loads((tmp_path / "r.json").read_text())
    assert [pin["part"] for pin in report["pins"]] == ["gaze", "left_hand"] and report["pins"][0]["miss"] < 0.05
    assert estimate_stature(bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion.skeleton) == pytest.approx(2.0, abs=1e-3)
    assert_told(synthesize(height=0.1), 2, "--height", "0.5 to 3 metres")
    (tmp_path / "pins.csv").write_text("time_s,part,x_m,y_m,z_m\n2,nose,30,0,1.5\n")
    assert_told(synthesize(pins=tmp_path / "pins.csv"), 2, "pins.csv:2", "'nose'")


def test_headings_are_planned_and_written_with_the_provenance(synthesize, tmp_path):
    (tmp_path / "headings.csv").write_text("time_s,heading_deg,hold_s\n2,120,1\n")
    files = {"headings": tmp_path / "headings.csv", "provenance": tmp_path / "p.csv", "report": tmp_path / "r.json"}
    assert synthesize(**files)[0] == 0
    rows = [line.split(",") for line in (tmp_path / "p.csv").read_text().splitlines()]
    assert rows[0][-1] == "planned_heading_deg"
    held = [float(row[-1]) for row in rows[1:] if 2.3 < float(row[1]) < 2.7]
    assert held and all(abs(value - 120.0) < 12.0 for value in held)
    assert json.loads((tmp_path / "r.json").read_text())["naturalness"]["off_plan_deg_median"] is not None
    (tmp_path / "headings.csv").write_text("time_s,heading_deg\n2,\n")
    assert_told(synthesize(headings=tmp_path / "headings.csv"), 2, "headings.csv:2", "no heading")


@pytest.mark.parametrize("method, title", [("distance", "Distance"), ("blocks", "Blocks"), ("path", None)])
def test_headings_of_a_method_that_plans_none_are_told(synthesize, tmp_path, method, title):
    (tmp_path / "headings.csv").write_text("time_s,heading_deg\n2,120\n99,0\n")
    status, _, error = synthesize(headings=tmp_path / "headings.csv", method=method, delta=0.7)
    told = [line for line in error if "heading key" in line]
    assert status == 0 and len(told) == 1
    assert (f"2 heading keys: the method {title} plans no heading" in told[0]) == bool(title)
    assert "ignored" in told[0]
    assert any(line.startswith("note: --delta: the method") for line in error) == (method != "distance")


def test_a_missing_package_of_the_core_is_told_in_one_line():
    code = ("import sys, runpy; sys.modules['numpy'] = None; sys.argv[1:] = ['mirror', 'a.bvh', 'b.bvh']; "
            "runpy.run_module('beyond_mocap', run_name='__main__')")
    done = subprocess.run([sys.executable, "-c", code], cwd=TOP, capture_output=True, text=True)
    expected = "beyond-mocap: numpy is missing; install the core: pip install . in the project's folder"
    assert (done.returncode, done.stderr.strip()) == (2, expected)


def test_methods_are_compared_and_their_takes_are_a_study(run, clips_folder, library, match, tmp_path):
    scenarios = tmp_path / "scenarios"
    scenarios.mkdir()
    (scenarios / "one.csv").write_bytes((match / "track_only.csv").read_bytes())
    common = ("compare", "--library", clips_folder, "--scenarios", scenarios, "--methods", "fs,baseline")
    status, out, error = run(*common, "--out", tmp_path / "r.md", "--takes", tmp_path / "takes")
    assert status == 0 and "1 scenario, 2 methods" in out and any("no labels" in line for line in error)
    assert "| baseline |" in (tmp_path / "r.md").read_text()
    rows = (tmp_path / "takes" / "clips.csv").read_text().splitlines()
    assert rows[0] == "file,system,scenario" and all((tmp_path / "takes" / row.split(",")[0]).is_file()
                                                     for row in rows[1:])
    assert_told(run(*common, "--out", tmp_path / "r.txt"), 2, ".html, .md, .json")
    assert_told(run(*common, "--out", tmp_path / "r.md", "--takes", tmp_path / "takes"), 2, "a new or empty folder")
    (tmp_path / "none").mkdir()
    empty = (*common[:4], tmp_path / "none", "--out", tmp_path / "e.md")
    assert_told(run(*empty), 2, "no .csv file in it")
    assert_told(run(*empty[:4], scenarios, "--methods", "magic", *empty[5:]), 2, "'magic'")
    assert not (tmp_path / "e.md").exists()
