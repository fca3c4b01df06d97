"""The verb `path`: what comes out keeps the recording's form and speed, and one line for what is wrong."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.cli.main import main
from beyond_mocap.cli.outputs import ProgressReporter
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.contacts import measure_floor_height
from beyond_mocap.synthesis.provenance import read_provenance
from beyond_mocap.synthetic.gait import build_gait

STICK = """HIERARCHY
ROOT a { OFFSET 0 0 0 CHANNELS 6 Yposition Xposition Zposition Yrotation Xrotation Zrotation
JOINT b { OFFSET 0 50 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site { OFFSET 0 50 0 } } }
MOTION
Frames: 40
Frame Time: 0.04
""" + "".join(f"90 {5 * i} 0 0 0 0 {i} 0 0\n" for i in range(40))


def arc(radius: float, degrees: float, rise: float = 0.0) -> str:
    """A curve's rows: an arc to the left that rises by `rise` a metre."""
    angle = np.radians(np.linspace(0.0, degrees, 80))
    rows = np.column_stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle)), rise * radius * angle])
    return "x_m,y_m,z_m\n" + "".join(f"{x:.5f},{y:.5f},{z:.5f}\n" for x, y, z in rows)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a walk, a jog, a stick, one frame, and a few curves."""
    folder = tmp_path_factory.mktemp("ride")
    bvh.write_bvh(folder / "walk.bvh", build_gait(1.4, 4.0, 60.0))
    bvh.write_bvh(folder / "stand.bvh", build_gait(0.0, 2.0, 30.0))
    bvh.write_bvh(folder / "shuffle.bvh", build_gait(0.1, 4.0, 30.0))
    bvh.write_bvh(folder / "one.bvh", build_gait(1.4, 1.0, 30.0).frames(0, 1))
    (folder / "stick.bvh").write_text(STICK)
    (folder / "bend.csv").write_text(arc(3.0, 180.0))
    (folder / "short.csv").write_text(arc(3.0, 40.0))
    (folder / "hill.csv").write_text(arc(8.0, 60.0, rise=0.15))
    (folder / "flat.obj").write_text("v -50 0.5 -50\nv 50 0.5 -50\nv 50 0.5 50\nv -50 0.5 50\nf 1 2 3 4\n")
    return folder


@pytest.fixture
def run(capfd, place, tmp_path):
    """run(*more, recording="walk", curve="bend") -> status, standard output, lines on standard error."""

    def call(*more, recording="walk", curve="bend", out="out.bvh"):
        capfd.readouterr()
        files = [place / f"{recording}.bvh", "--path", place / f"{curve}.csv", "--out", tmp_path / out]
        status = main([str(word) for word in ("path", *files, *more)])
        said, error = capfd.readouterr()
        return status, said, error.splitlines()

    return call


def rows(text: str) -> list[str]:
    return text[: text.index("MOTION")].split() + text[text.index("Frame Time") :].split("\n")[:1]


def test_rate_names_channels_and_form_stay(run, place, tmp_path):
    status, out, _ = run("--provenance", tmp_path / "p.csv", "--report", tmp_path / "r.json")
    assert status == 0 and "out.bvh: 241 frames, 4.0 s, 5." in out and len(out.splitlines()) == 1
    assert rows((tmp_path / "out.bvh").read_text()) == rows((place / "walk.bvh").read_text())
    ridden = bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion
    from_middle = np.linalg.norm(ridden.root_positions[:, :2] - [0.0, 3.0], axis=1)
    assert np.abs(from_middle - 3.0).max() < 0.06
    came_from = read_provenance(tmp_path / "p.csv")
    assert set(came_from.clip) == {"walk.bvh"} and came_from.contacts.any(axis=0).all()
    np.testing.assert_allclose(came_from.clip_frame, np.arange(241), atol=1e-3)
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["root_error_m"]["mean"] < 0.01 and report["path"]["kept_speed"]["path"]["max"] < 0.01
    assert report["skate"]["contact_cm_s"] <= report["skate"]["source_contact_cm_s"] + 0.2
    assert report["skate"]["before_contact_cm_s"] > 2.0 * report["skate"]["contact_cm_s"]
    assert report["seconds"]["total"] >= report["seconds"]["construct"] > 0.0
    assert run("--cycle", "--report", tmp_path / "r.json")[0] == 0
    cycled = json.loads((tmp_path / "r.json").read_text())
    assert cycled["seam_jerk_ratio"]["max"] == cycled["path"]["seam_jerk"]["max"] > 0.0


def test_the_result_can_be_evaluated(run, tmp_path, capfd):
    assert run("--provenance", tmp_path / "p.csv", "--report", tmp_path / "r.json")[0] == 0
    arguments = [tmp_path / "out.bvh", "--provenance", tmp_path / "p.csv", "--unit", 0.01, "--report",
                 tmp_path / "e.json"]
    assert main(["evaluate", *map(str, arguments)]) == 0
    mine, again = (json.loads((tmp_path / name).read_text()) for name in ("r.json", "e.json"))
    assert again["skate"]["contact_cm_s"] == pytest.approx(mine["skate"]["contact_cm_s"], abs=0.05)
    assert again["frames"] == mine["frames"] == 241


def test_a_skeleton_without_legs_rides_and_is_told(run, place, tmp_path):
    status, _, error = run("--report", tmp_path / "r.json", recording="stick")
    assert status == 0 and any("not planted" in line for line in error)
    channels = "CHANNELS 6 Yposition Xposition Zposition Yrotation Xrotation Zrotation"
    assert channels in (tmp_path / "out.bvh").read_text()
    assert json.loads((tmp_path / "r.json").read_text())["path"]["skate"] is None


def test_a_path_longer_than_the_motion_is_reported(run):
    assert any(re.search(r"the motion ends \d\.\d m before the end of the path: shorten", line) for line in run()[2])
    for more, curve in ((["--cycle"], "bend"), ([], "short"), (["--no-arc-length"], "bend")):
        assert not any("before the end of the path" in line for line in run(*more, curve=curve)[2]), more
    assert not any("Cycle" in line for line in run(recording="shuffle")[2])  # it would repeat nothing


def test_the_report_has_one_height_of_feet_over_the_ground_below_them(run, tmp_path):
    for curve in ("bend", "hill"):
        assert run("--report", tmp_path / "r.json", curve=curve)[0] == 0
        report = json.loads((tmp_path / "r.json").read_text())
        feet, path = report["ground_mm"], report["path"]["ground_mm"]
        assert (feet["min"], feet["support_max"]) == (path["deepest"], path["standing_max"])
        assert feet["source_min"] == path["source_deepest"] and feet["support_max"] < 5.0  # on a hill too
        assert not any(name.startswith("ground_mm") for name in report["unknown"])


def test_toes_above_the_ground_are_reported_with_the_way_down(run, place, tmp_path):
    walk = bvh.read_bvh(place / "walk.bvh", 0.01).motion
    bvh.write_bvh(place / "raised.bvh", replace(walk, root_positions=walk.root_positions + [0.0, 0.0, 0.025]))
    (line,) = (line for line in run(recording="raised")[2] if "toes" in line)
    assert "toes of flat feet are 4.4 cm above the ground" in line and "z_m -0.044" in line
    assert not any("toes" in line for line in run()[2])
    assert not any("toes" in line for line in run("--ground", place / "flat.obj", recording="raised")[2])
    rows = (place / "bend.csv").read_text().replace(",0.00000\n", ",-0.04400\n")
    (place / "low.csv").write_text(rows)
    status, _, lines = run(recording="raised", curve="low")
    assert status == 0 and not any("toes" in line for line in lines)
    assert abs(measure_floor_height(bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion)) < 0.003


def test_a_hairpin_is_reported_and_a_turn_of_the_recording_is_not(run, place, tmp_path):
    (place / "hairpin.csv").write_text("x_m,y_m\n0,0\n2,0\n0,0.1\n")
    assert run("--report", tmp_path / "r.json", curve="hairpin")[0] == 0
    report = json.loads((tmp_path / "r.json").read_text())
    line, spans = next(pair for pair in zip(report["warnings"], report["warning_seconds"]) if "75 degrees" in pair[0])
    assert line.endswith(" s: the body turns by more than 75 degrees within 0.3 s: smooth the path there")
    assert spans[0][0] == pytest.approx(2.0 / 1.4, abs=0.3)
    bvh.write_bvh(place / "turned.bvh", bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion)
    for recording in ("walk", "turned"):
        assert not any("75 degrees" in line for line in run(recording=recording)[2]), recording


def test_the_unit_is_told_where_it_is_not_the_inputs(run):
    assert "centimetres" not in run()[1]
    assert "centimetres (--unit 0.01)" in run("--unit", 0.0101)[1]


def test_a_motion_that_stands_still_is_placed_and_told(run, tmp_path):
    status, _, error = run(recording="stand")
    assert status == 0 and any("stays in place" in line for line in error)
    assert np.isfinite(bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion.root_positions).all()


@pytest.mark.parametrize("more, curve", [
    (("--degree", 4), "bend"), (("--no-arc-length",), "bend"), (("--no-plant",), "bend"), (("--speed", 1.5), "bend"),
    (("--frame", "tangent"), "hill"), (("--frame", "absolute"), "bend"), (("--no-lean", "--slow-in-bends"), "bend"),
    (("--no-slopes",), "hill"), (("--slow-on-slopes",), "hill"), (("--closed",), "bend"), (("--cycle",), "bend"),
    (("--end", "repeat"), "short"), (("--end", "stop"), "short"), (("--control-points", "--control-degree", 2), "bend"),
])  # fmt: skip
def test_every_option_gives_a_sound_motion(run, tmp_path, more, curve):
    status, _, error = run(*more, curve=curve)
    assert status == 0, error
    motion = bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion
    assert np.isfinite(motion.rotations).all() and len(motion) > 30


def test_the_ground_lifts_the_body(run, place, tmp_path):
    assert run()[0] == 0
    flat = bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion.root_positions[:, 2]
    assert run("--ground", place / "flat.obj")[0] == 0
    raised = bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion.root_positions[:, 2]
    assert np.abs(raised - flat - 0.5).max() < 0.03
    (place / "away.obj").write_text("v 90 0 90\nv 91 0 90\nv 90 0 91\nf 1 2 3\n")
    status, _, error = run("--ground", place / "away.obj")
    assert status == 0 and any("nowhere under the path" in line for line in error)


def test_a_path_that_ends_stops_the_motion_and_cycling_goes_on(run, tmp_path):
    counts = {}
    for name, more in (("stop", ()), ("cycle", ("--cycle",))):
        assert run(*more, curve="short" if name == "stop" else "bend")[0] == 0
        counts[name] = len(bvh.read_bvh(tmp_path / "out.bvh", 0.01).motion)
    assert counts["stop"] < 120 and counts["cycle"] > 380


def test_a_rider_goes_round_a_body_that_moves_already(run, place, tmp_path):
    (place / "along.csv").write_text("x_m,y_m\n0,0\n6,0\n")
    (place / "back.csv").write_text("x_m,y_m\n6,0.1\n0,0.1\n")
    assert run(curve="along", out="first.bvh")[0] == 0
    first = bvh.read_bvh(tmp_path / "first.bvh", 0.01).motion.root_positions
    gaps = {}
    for name, more in (("through", ()), ("round", ("--avoid", tmp_path / "first.bvh", "--distance", 0.8))):
        status, _, error = run(*more, curve="back", out="second.bvh")
        second = bvh.read_bvh(tmp_path / "second.bvh", 0.01).motion.root_positions
        count = min(len(first), len(second))
        gaps[name] = np.linalg.norm((first[:count] - second[:count])[:, :2], axis=1).min()
        assert status == 0 and any("walk.bvh moves" in line or "walk.bvh waits" in line for line in error) == bool(more)
    assert gaps["through"] < 0.3 and gaps["round"] > 0.75


@pytest.mark.parametrize("content, parts", [
    ("", ["bad.csv", "empty"]),
    ("\0\1\2", ["bad.csv", "binary"]),
    ("a,b\n0,0\n1,0\n", ["bad.csv:1", "x_m"]),
    ("0,0\n1,0\n", ["bad.csv:1"]),
    ("x_m|y_m\n0|0\n1|0\n", ["commas"]),
    ("x_m,y_m\n0,0\n", ["bad.csv", "two"]),
    ("x_m,y_m\n1,1\n1,1\n1,1\n", ["bad.csv", "one place"]),
    ("x_m,y_m\n0,0\n0.05,0\n", ["bad.csv", "m"]),
    ("x_m,y_m\n0,0\n1,nan\n", ["bad.csv:3", "nan"]),
    ("x_m,y_m\n0,0\n1,inf\n", ["bad.csv:3", "inf"]),
    ("x_m,y_m\n0,0\n1,here\n", ["bad.csv:3", "here"]),
    ("x_m,y_m\n0,0\n1e30,0\n", ["bad.csv:3", "unit"]),
])  # fmt: skip
def test_a_bad_path_is_one_line(capfd, place, tmp_path, content, parts):
    (tmp_path / "bad.csv").write_bytes(content.encode())
    assert_refused(capfd, tmp_path, [place / "walk.bvh", "--path", tmp_path / "bad.csv"], parts)


@pytest.mark.parametrize("content, parts", [
    ("", ["bad.obj"]), ("v 0 0 0\nv 1 0 0\n", ["bad.obj", "faces"]), ("v 0 0 0\nf 1 2 3\n", ["bad.obj:2"]),
])  # fmt: skip
def test_a_bad_ground_is_one_line(capfd, place, tmp_path, content, parts):
    (tmp_path / "bad.obj").write_text(content)
    words = [place / "walk.bvh", "--path", place / "bend.csv", "--ground", tmp_path / "bad.obj"]
    assert_refused(capfd, tmp_path, words, parts)


@pytest.mark.parametrize("more, parts", [
    (["--degree", "-1"], ["--degree", "-1"]),
    (["--degree", "1000"], ["--degree", "1000"]),
    (["--degree", "2.5"], ["--degree"]),
    (["--speed", "0"], ["--speed"]),
    (["--speed", "nan"], ["--speed"]),
    (["--end", "bounce"], ["--end"]),
    (["--frame", "moon"], ["--frame"]),
    (["--control-degree", "2"], ["--control-points"]),
    (["--control-points", "--control-degree", "20"], ["few.csv", "degree"]),
    (["--unit", "0"], ["--unit"]),
    (["--closed", "--control-points"], ["--closed"]),
    (["--delay", "-1"], ["--delay"]),
    (["--avoid", "missing.bvh"], ["missing.bvh"]),
    (["--distance", "0"], ["--distance"]),
    (["--distance", "1"], ["--distance", "--avoid"]),
    (["--ground", "missing.obj"], ["missing.obj"]),
    (["--report", "nowhere/r.json"], ["nowhere"]),
])  # fmt: skip
def test_wrong_options_are_one_line(capfd, place, tmp_path, more, parts):
    (tmp_path / "few.csv").write_text("x_m,y_m\n0,0\n1,0\n2,1\n3,0\n")
    assert_refused(capfd, tmp_path, [place / "walk.bvh", "--path", tmp_path / "few.csv", *more], parts)


def test_files_that_are_not_there_or_meant_twice_are_one_line(capfd, place, tmp_path):
    bend = place / "bend.csv"
    assert_refused(capfd, tmp_path, [place / "none.bvh", "--path", bend], ["none.bvh"])
    assert_refused(capfd, tmp_path, [place, "--path", bend], [str(place)])
    assert_refused(capfd, tmp_path, [place / "walk.bvh", "--path", tmp_path], [str(tmp_path)])
    assert_refused(capfd, tmp_path, [place / "one.bvh", "--path", bend], ["one.bvh", "frame"])
    many = ["--degree", "100"]
    assert_refused(capfd, tmp_path, [place / "stand.bvh", "--path", bend, *many], ["stand.bvh", "degree 100"])
    before = (place / "walk.bvh").read_bytes()
    for out in (place / "walk.bvh", bend, tmp_path, tmp_path / "a.xyz", tmp_path / "none" / "a.bvh"):
        assert main(["path", str(place / "walk.bvh"), "--path", str(bend), "--out", str(out)]) == 2
        assert len(capfd.readouterr().err.splitlines()) == 1
    assert (place / "walk.bvh").read_bytes() == before


def test_who_cannot_cycle_is_named_also_where_others_are_avoided(capfd, place, tmp_path):
    more = ["--path", place / "bend.csv", "--cycle", "--avoid", place / "walk.bvh"]
    assert_refused(capfd, tmp_path, [place / "stand.bvh", *more], ["stand.bvh", "bend.csv", "cycling"])


def test_ctrl_c_ends_it_without_a_file(run, tmp_path, monkeypatch):
    monkeypatch.setattr(ProgressReporter, "is_cancelled", lambda self: True)
    status, said, error = run()
    assert (status, said) == (130, "") and error == ["beyond-mocap: cancelled"]
    assert not list(tmp_path.iterdir())


def assert_refused(capfd, tmp_path, words, parts):
    """Status 2, one line that says all of `parts`, and nothing written."""
    capfd.readouterr()
    status = main(["path", *map(str, words), "--out", str(tmp_path / "out.bvh")])
    said, error = capfd.readouterr()
    assert status == 2 and said == "" and len(error.splitlines()) == 1, error
    for part in parts:
        assert part in error, error
    assert not (tmp_path / "out.bvh").exists() and not list(tmp_path.glob(".*"))
