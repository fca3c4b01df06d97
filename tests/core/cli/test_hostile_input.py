"""Inputs, disks and machines that are not as they should be: one line, the contract's status, no traceback."""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from beyond_mocap.base import content, user_folders
from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import build_parser, main
from beyond_mocap.cli.outputs import check_outputs
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.file_names import avoid_reserved_name
from beyond_mocap.library.folder import recordings

TOP = Path(__file__).resolve().parents[3]
SAMPLE_LIBRARY = TOP / "sample_blend" / "library"
WALK = SAMPLE_LIBRARY / "walking_1_2.bvh"
POSIX = pytest.mark.skipif(os.name == "nt", reason="Windows has no such pipes, devices and signals")


@pytest.fixture
def run_line(capfd):
    """run_line(*arguments) -> status and the one line on standard error."""

    def call(*arguments):
        capfd.readouterr()
        status = main([str(argument) for argument in arguments])
        lines = capfd.readouterr().err.splitlines()
        assert len(lines) == 1 and "Traceback" not in lines[0], lines
        return status, lines[0]

    return call


def run_python(code: str, **more):
    return subprocess.run([sys.executable, "-c", code], cwd=TOP, capture_output=True, text=True, timeout=120, **more)


def swap_names(path: Path, one: str, other: str) -> Path:
    """A walk in which two joints have exchanged names."""
    text = WALK.read_text().replace(f"JOINT {one}\n", "JOINT -\n").replace(f"JOINT {other}\n", f"JOINT {one}\n")
    path.write_text(text.replace("JOINT -\n", f"JOINT {other}\n"))
    return path


@pytest.mark.parametrize("verb", ["evaluate", "mirror"])
def test_a_knee_that_is_not_below_its_thigh_is_reported_with_the_file(run_line, tmp_path, verb):
    bad = swap_names(tmp_path / "bad.bvh", "LeftLeg", "LeftArm")
    more = ["--report", tmp_path / "r.json"] if verb == "evaluate" else [tmp_path / "out.bvh"]
    status, line = run_line(verb, bad, *more)
    assert status == 2 and "bad.bvh" in line and "LeftLeg (left lower_leg) does not hang below LeftUpLeg" in line


def test_exchanged_names_of_legs_do_not_count_against_their_structure(tmp_path):
    crossed = bvh.read_bvh(swap_names(tmp_path / "crossed.bvh", "LeftLeg", "RightLeg")).motion
    assert estimate_legs(crossed) == estimate_legs(bvh.read_bvh(WALK).motion)


def estimate_legs(motion):
    from beyond_mocap.motion.humanoid import identify_joints

    body = identify_joints(motion.skeleton)
    return [(limb.upper_leg, limb.lower_leg, limb.foot) for limb in (body.left, body.right)]


@POSIX
@pytest.mark.parametrize("command", ["mirror {} {out}.bvh", "freeze-frame {} --events {}",
                                     "throw synthesize --model {} --target 8,1,1 --out {out}.bvh"])
def test_a_device_without_an_end_is_refused_soon(command, run_line, tmp_path):
    """Before it has filled the memory: after 16 MB, not the gigabyte that a pipe may have."""
    assert content.MAX_DEVICE_BYTES < 1 << 25
    status, line = run_line(*command.format("/dev/zero", "/dev/zero", out=tmp_path / "out").split())
    assert status == 2 and "/dev/zero: has no end within" in line


@POSIX
@pytest.mark.parametrize("command", ["match --tracking {clip} --library {clip} --out {pipe}",
                                     "library {pipe}", "bodies --joints {clip} --out {pipe}",
                                     "compare --library {clip} --scenarios {pipe} --out {out}.md"])
def test_what_is_no_folder_is_named(command, run_line, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    status, line = run_line(*command.format(clip=WALK, pipe=tmp_path / "pipe", out=tmp_path / "out").split())
    assert status == 2 and "pipe: is a device or a pipe; expected a " in line


def test_too_little_memory_is_one_line(run_line, tmp_path, monkeypatch):
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(bvh, "read_bvh", fail)
    status, line = run_line("mirror", WALK, tmp_path / "out.bvh")
    assert status == 2 and "not enough memory" in line


@POSIX
def test_a_program_that_opens_a_pipe_and_stays_silent_can_be_left(run_line, tmp_path):
    os.mkfifo(tmp_path / "pipe.bvh")
    writer = os.open(tmp_path / "pipe.bvh", os.O_RDWR)
    threading.Timer(1.0, os.kill, [os.getpid(), signal.SIGTERM]).start()
    status, line = run_line("mirror", tmp_path / "pipe.bvh", tmp_path / "out.bvh")
    os.close(writer)
    assert status == 130 and "cancelled" in line


@POSIX
def test_ctrl_c_while_packages_are_loaded_is_one_line():
    code = """
import runpy, signal, sys
class Interrupt:
    def find_spec(self, name, *_):
        if name == "beyond_mocap.cli.main":
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
runpy.run_module("beyond_mocap", run_name="__main__")
"""
    done = run_python(code)
    assert (done.returncode, done.stderr) == (130, "beyond-mocap: cancelled\n")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no full device")
def test_a_full_disk_below_standard_output_is_named(tmp_path):
    command = [sys.executable, "-m", "beyond_mocap", "mirror", str(WALK), str(tmp_path / "out.bvh")]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, cwd=TOP, stdout=full, stderr=-1, text=True, timeout=120)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert done.returncode == 2 and len(lines) == 1 and "standard output" in lines[0] and "No space" in lines[0]


def test_a_user_without_a_home_has_no_cache_folder(monkeypatch):
    for name in ("LOCALAPPDATA", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # as of a number without an entry in passwd
    assert user_folders.find_user_cache() is None
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert user_folders.find_user_cache() == Path("/somewhere/beyond_mocap")


@pytest.mark.parametrize("name", ["CON", "aux", "lpt3"])
def test_names_that_windows_keeps_are_changed(name):
    assert avoid_reserved_name(name) == f"_{name}" and avoid_reserved_name(f"{name}x") == f"{name}x"


@pytest.mark.parametrize("arguments", [("mirror", "", "o.bvh"), ("mirror", WALK, ""), ("library", "x", "--cache", "")])
def test_an_empty_name_is_reported_as_one(run_line, arguments):
    status, line = run_line(*arguments)
    assert status == 2 and "no file or folder is named" in line


@pytest.mark.parametrize("name", ["walk.bvh", "walk.txt", "walk.ball.csv", "annotations.csv"])
@pytest.mark.parametrize("command", ["library {library} --report {out}", "library {library} --learn {out}",
                                     "evaluate {clip} --library {library} --report {out}",
                                     "synthesize --library {library} --track {track} --out {clip}2 --report {out}"])
def test_no_output_takes_the_place_of_a_librarys_recording_or_labels(command, name, run_line, tmp_path):
    (tmp_path / "walk.bvh").write_bytes(WALK.read_bytes())
    (tmp_path / "walk.txt").write_text("0 1 walking\n")
    (tmp_path / "walk.ball.csv").write_text("time_s,x_m,y_m,z_m\n")
    (tmp_path / "annotations.csv").write_text("file,start_frame,end_frame,key_frame,labels\n")
    content = (tmp_path / name).read_bytes()
    track = TOP / "sample_blend" / "match" / "player1.csv"
    words = command.format(library=tmp_path, out=tmp_path / name, clip=WALK, track=track)
    status, line = run_line(*words.split())
    assert status == 2 and f"{name}: is a file of the library" in line and (tmp_path / name).read_bytes() == content


@pytest.mark.parametrize("name", ["walk.txt", "walk.ball.csv", "annotations.csv", "sub/annotations.csv",
                                  "../annotations.csv"])
def test_no_output_becomes_labels_or_a_ball_of_a_library(name, run_line, tmp_path):
    top = tmp_path / "library"
    (top / "sub").mkdir(parents=True)
    for place in (top / "walk.bvh", top / "sub" / "run.bvh"):
        place.write_bytes(WALK.read_bytes())
    (tmp_path / "link").symlink_to(top)
    for library in (top, tmp_path / "link"):
        status, line = run_line("library", library, "--report", top / name)
        assert status == 2 and "would be read as labels or as a ball of the library" in line
        assert not (top / name).exists()
    check_outputs(tmp_path / "walk.txt", top / "else.ball.csv", library=top)
    table = top / "annotations.csv"
    check_outputs(None, table, library=top, labels=table)
    with pytest.raises(InputError, match="would be read as labels"):
        check_outputs(table, top / "walk.txt", library=top, labels=top / "walk.txt")


def test_no_report_becomes_a_recording_of_a_library(run_line, tmp_path):
    library = tmp_path / "library"
    library.mkdir()
    (library / "walk.bvh").write_bytes(WALK.read_bytes())
    for name in ("r.bvh", "r.BVH", "r.fbx"):
        for command in ("library {library} --report {out}", "evaluate {clip} --library {library} --report {out}"):
            line = command.format(library=library, out=library / name, clip=WALK)
            status, answer = run_line(*line.split())
            assert status == 2 and "would be read as a recording of the library" in answer
            assert not (library / name).exists()
    out = library / "new.bvh"
    check_outputs(out, library / "r.json", tmp_path / "r.bvh", library=library, motion=out)


def test_the_library_is_listed_once_for_all_outputs_that_exist(tmp_path, monkeypatch):
    outputs = [tmp_path / name for name in ("a.bvh", "b.json", "c.csv")]
    for path in outputs:
        path.touch()
    folders, find = [], recordings.find_recordings
    monkeypatch.setattr(recordings, "find_recordings", lambda folder: folders.append(folder) or find(folder))
    check_outputs(*outputs, None, library=SAMPLE_LIBRARY)
    check_outputs(tmp_path / "new.bvh", library=SAMPLE_LIBRARY)
    assert folders == [SAMPLE_LIBRARY]


def test_where_files_have_no_numbers_outputs_and_folders_are_told_apart_by_their_paths(tmp_path, monkeypatch):
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "walk.bvh").write_bytes(WALK.read_bytes())
    (tmp_path / "out.bvh").touch()
    (tmp_path / "link.bvh").symlink_to(tmp_path / "two" / "walk.bvh")
    stat = os.stat

    def stat_without_number(path, **named):
        fields = list(stat(path, **named))
        fields[1] = 0
        return os.stat_result(fields)

    monkeypatch.setattr(os, "stat", stat_without_number)
    assert {path.parent.name for path in recordings.find_recordings(tmp_path)} >= {"one", "two"}
    check_outputs(tmp_path / "out.bvh", library=tmp_path / "one")
    with pytest.raises(InputError, match="is a file of the library"):
        check_outputs(tmp_path / "link.bvh", library=tmp_path / "two")


def test_no_output_takes_the_place_of_metadata_that_is_found_beside_tracking_data(run_line, tmp_path):
    shutil.copytree(TOP / "sample_blend" / "match" / "small", tmp_path / "small")
    meta = tmp_path / "small" / "small_meta.xml"
    status, line = run_line("touches", tmp_path / "small" / "small.dat", "--out", meta)
    assert status == 2 and "small_meta.xml: is both an output and another file" in line and b"<" in meta.read_bytes()


@pytest.mark.parametrize("folder", ["library", "library/kicks"])
def test_passes_are_not_written_between_the_recordings(folder, run_line, tmp_path):
    source = TOP / "sample_blend" / "passes"
    shutil.copytree(source / "library", tmp_path / folder)
    line = run_line("passes", source / "three.json", "--library", tmp_path / "library", "--out", tmp_path / folder)
    assert line[0] == 2 and f"{folder}: holds recordings of the library; expected another folder" in line[1]


def test_proposed_labels_do_not_take_the_place_of_labels(run_line, tmp_path):
    shutil.copytree(TOP / "sample_blend" / "passes" / "library", tmp_path / "library")
    table = tmp_path / "library" / "annotations.csv"
    table.write_text("file,start_frame,end_frame,key_frame,labels\n")
    status, line = run_line("library", tmp_path / "library", "--propose", table)
    assert status == 2 and "already has labels" in line and "then merge the rows" in line


@pytest.mark.parametrize("command", ["evaluate {clip} --report {out} --cache none",
                                     "evaluate {clip} --report {out} --skeleton none.bvh",
                                     "throw synthesize --target 8,1,1 --out {out} --cache none"])
def test_options_of_a_library_need_one(command, run_line, tmp_path):
    status, line = run_line(*command.format(clip=WALK, out=tmp_path / "r.bvh").split())
    assert status == 2 and "set without --library; expected a folder of" in line and line.endswith("add --library")


def test_an_empty_marker_set_is_reported_as_none(run_line, tmp_path):
    trial = TOP / "sample_blend" / "markers" / "walk.trc"
    status, line = run_line("reconstruct", trial, "--out", tmp_path / "o.bvh", "--marker-set=")
    assert status == 2 and "no marker set ''; expected one of" in line


@pytest.mark.parametrize("option, said", [("--meta=--", "--meta: expected one argument"), ("--to=--", "expected one"),
                                          ("--to=soon", "'soon' is not a number of seconds"),
                                          ("--from=nan", "'nan' is not a number of seconds")])
def test_values_that_are_none_are_named_with_their_option(option, said, run_line):
    status, line = run_line("touches", "small.dat", "--out", "t.csv", option)
    assert status == 2 and said in line


def iter_options(parser):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                yield from iter_options(verb)
        else:
            yield parser, action


def test_every_option_has_a_help_text_and_every_page_names_the_documents():
    options = list(iter_options(build_parser()))
    assert [f"{parser.prog} {action.dest}" for parser, action in options if not action.help] == []
    assert "docs/reference/commands.md" in build_parser().format_help()


def test_texts_with_labels_beside_no_recording_are_told(tmp_path, capfd):
    shutil.copy(WALK, tmp_path / "walk.bvh")
    (tmp_path / "wlak.txt").write_text("0 2 walking\n")
    (tmp_path / "README.txt").write_text("These recordings are ours.\n")
    assert main(["library", str(tmp_path)]) == 0
    assert "1 text with labels beside no recording of the name, such as wlak.txt" in capfd.readouterr().out


def test_no_package_is_advised_that_no_index_has():
    advice, sources = "install 'beyond-mocap", (TOP / "beyond_mocap").rglob("*.py")
    assert [path for path in sources if advice in path.read_text("utf-8")] == []
