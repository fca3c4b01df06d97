"""A long track in windows: the same frames whatever the parts are, no seam between them, and the files of the whole."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.base import memory
from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.features import compute_max_jerk
from beyond_mocap.match import long_player
from beyond_mocap.match.long_player import iter_parts, search_long_player
from beyond_mocap.motion.motion import concatenate_motions, forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan

SECONDS, WINDOW = 62.0, 24.0


@pytest.fixture(scope="module")
def edit(library):
    times = np.arange(0.0, SECONDS, 0.2)
    along = 1.4 * times + 0.3 * np.sin(0.4 * times)
    track = Track(times, np.stack([along, 2.0 * np.sin(0.1 * along)], axis=1), name="runner")
    return search_long_player(library, Plan(track=track, made=False), WINDOW, lambda *told: None, lambda: False)


def construct(library, edit):
    parts = list(iter_parts(library, edit, lambda *told: None, lambda: False))
    return parts, concatenate_motions([part.motion for part in parts])


def test_windows_join_without_a_seam_and_parts_change_no_frame(library, edit, monkeypatch):
    edit = replace(edit, window=10.0)
    monkeypatch.setattr(long_player, "PART_WINDOWS", 2)
    parts, motion = construct(library, edit)
    assert len(parts) == 4 and len(motion) == round((SECONDS - 0.2) * 30.0) + 1
    monkeypatch.setattr(long_player, "PART_WINDOWS", 100)
    (whole,), at_once = construct(library, edit)
    assert np.array_equal(motion.root_positions, at_once.root_positions)
    assert np.array_equal(np.abs(motion.rotations), np.abs(at_once.rotations))  # signs are continuous in a part
    jerk = compute_max_jerk(forward_kinematics(motion)[0], motion.fps)
    edges = [round(second * motion.fps) for second in np.arange(10.0, SECONDS - 1.0, 10.0)]
    for edge in edges:
        assert jerk[edge - 4 : edge + 5].max() <= np.percentile(jerk, 99.5), edge


def test_a_whole_motion_and_its_parts_are_the_same_file(library, tmp_path):
    motion = library.clips[0].motion
    bvh.write_bvh(tmp_path / "whole.bvh", motion)
    parts = [motion.frames(low, min(low + 13, len(motion))) for low in range(0, len(motion), 13)]
    bvh.write_bvh_parts(tmp_path / "parts.bvh", iter(parts), len(motion))
    assert (tmp_path / "parts.bvh").read_bytes() == (tmp_path / "whole.bvh").read_bytes()


def test_a_work_that_needs_more_memory_than_is_free_is_refused_in_one_line(monkeypatch):
    monkeypatch.setattr(memory, "read_free_bytes", lambda: 3e9)
    memory.check_memory("t.csv", 2.9e9, "use --window")
    with pytest.raises(InputError, match=r"^t.csv: this needs about 5.0 GB, 3.0 are free; use --window$"):
        memory.check_memory("t.csv", 5e9, "use --window")
    monkeypatch.setattr(memory, "read_free_bytes", lambda: None)
    memory.check_memory("t.csv", 1e15, "")


def test_free_memory_is_known_here():
    free = memory.read_free_bytes()
    assert free is None or 1e7 < free < 1e14


@pytest.mark.parametrize(("process", "files"), [
    ("0::/farm/job", {"farm/memory.max": "3000", "farm/memory.current": "2500", "farm/memory.stat": "inactive_file 100",
                      "farm/job/memory.max": "max"}),
    ("4:memory:/job", {"memory/job/memory.limit_in_bytes": "700", "memory/job/memory.usage_in_bytes": "200",
                       "memory/job/memory.stat": "inactive_file 5\ntotal_inactive_file 100"}),
])
def test_limits_of_control_groups_count(tmp_path, monkeypatch, process, files):
    monkeypatch.setattr(memory, "_GROUPS", tmp_path / "groups")
    monkeypatch.setattr(memory, "_PROCESS", tmp_path)
    (tmp_path / "cgroup").write_text(f"9:pids:/\n{process}\n")
    assert memory._read_groups() is None
    for name, text in files.items():
        path = tmp_path / "groups" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{text}\n")
    assert memory._read_groups() == memory.read_free_bytes() == 600.0


def test_the_limit_of_the_process_counts():
    resource = pytest.importorskip("resource")
    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not say how much address space a process has")
    code = "from beyond_mocap.base.memory import read_free_bytes; print(read_free_bytes())"
    limit = 1_000_000_000
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                         preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    assert 0.5 * limit < float(ran.stdout) < limit


def test_what_a_process_has_held_is_not_taken_over_from_the_one_that_started_it():
    held = np.ones(40_000_000)
    code = "from beyond_mocap.base.memory import read_peak_memory; print(read_peak_memory())"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    if not float(ran.stdout):
        pytest.skip("this system does not say how much memory a process has held")
    assert 2.0 < float(ran.stdout) < held.nbytes / 2**20 < memory.read_peak_memory()


def test_the_command_checks_memory_before_the_search(clips_folder, tmp_path, monkeypatch, capsys):
    (tmp_path / "t.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{0.2 * i},{0.3 * i},0\n" for i in range(100)))
    monkeypatch.setattr(memory, "read_free_bytes", lambda: 1e6)
    status = main(["synthesize", "--library", str(clips_folder), "--track", str(tmp_path / "t.csv"), "--out",
                   str(tmp_path / "o.bvh")])
    error = capsys.readouterr().err
    assert status == 2 and error.count("\n") == 1 and "use --window" in error
    assert not (tmp_path / "o.bvh").exists()


@pytest.mark.parametrize("window", ["20", "1", "-5", "nan", "4000"])
def test_windows_outside_their_limits_are_told_by_their_option(tmp_path, capsys, window):
    (tmp_path / "t.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{0.2 * i},{0.3 * i},0\n" for i in range(100)))
    assert main(["synthesize", "--library", str(tmp_path), "--track", str(tmp_path / "t.csv"), "--window", window,
                 "--out", str(tmp_path / "o.bvh")]) == 2
    assert capsys.readouterr().err == (f"beyond-mocap: --window: {window} s; expected 24 to 3600 s, or 0 "
                                       "for the whole track at once\n")


def test_the_command_in_windows_writes_all_files(clips_folder, tmp_path, capsys):
    rows = "".join(f"{0.2 * i:.1f},{0.28 * i + 1.32 * max(i - 120, 0):.3f},0\n" for i in range(160))
    (tmp_path / "t.csv").write_text("time_s,x_m,y_m\n" + rows)
    files = {name: tmp_path / name for name in ("o.bvh", "p.csv", "r.json")}
    status = main(["synthesize", "--library", str(clips_folder), "--track", str(tmp_path / "t.csv"), "--window", "24",
                   "--no-made", "--out", str(files["o.bvh"]), "--provenance", str(files["p.csv"]), "--report",
                   str(files["r.json"])])
    notes = capsys.readouterr().err
    assert status == 0, notes
    warnings = json.loads(files["r.json"].read_text())["warnings"]
    unmet = [line.removeprefix("note: ") for line in notes.splitlines() if " s: " in line]
    assert any("8.0 m/s" in line for line in unmet) and set(unmet) <= set(warnings)
    motion = bvh.read_bvh(files["o.bvh"]).motion
    assert len(motion) == 955 and files["p.csv"].read_text().count("\n") == 956
    assert '"frames": 955' in files["r.json"].read_text()
