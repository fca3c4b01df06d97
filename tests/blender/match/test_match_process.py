"""The command line in a process of its own: what it tells comes through, and it can be asked to end."""

import importlib
import pathlib
import subprocess
import sys
import time

import bpy
import pytest
from conftest import EXTENSION

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture
def child():
    return importlib.import_module(f"{EXTENSION}.scene.match.command_process")


@pytest.fixture
def errors(core):
    return core("base.errors")


def run(child, *arguments, cancelled=lambda: False):
    told = []
    notes = child.run_command(list(map(str, arguments)), lambda done, text: told.append((done, text)), cancelled)
    return notes, told


def test_it_does_what_the_command_does_and_tells_how_far_it_is(child, library_folder, tmp_path):
    _, told = run(child, "library", library_folder, "--cache", tmp_path / "cache", "--report", tmp_path / "report.json")
    assert (tmp_path / "report.json").stat().st_size > 100
    assert len(told) > 3 and told[-1][0] > 0.5 and all(text for _, text in told)
    assert not child._running


def test_what_is_wrong_is_told_in_the_commands_words(child, errors, tmp_path):
    with pytest.raises(errors.BeyondMocapError, match="nowhere.*no such") as caught:
        run(child, "library", tmp_path / "nowhere")
    assert "beyond-mocap:" not in str(caught.value) and "\n" not in str(caught.value)


def test_cancelled_it_ends_soon(child, errors, tmp_path):
    start = time.monotonic()
    with pytest.raises(errors.UserCancelledError):
        run(child, "library", SAMPLE, "--cache", tmp_path, cancelled=lambda: time.monotonic() - start > 0.5)
    assert time.monotonic() - start < 30.0 and not child._running


@pytest.mark.parametrize("online", [False, True])
def test_blenders_online_access_holds_for_a_scheduler_elsewhere(child, errors, tmp_path, online):
    """A name of .invalid never exists (RFC 2606): online, it is asked for and does not answer."""
    system, match = bpy.context.preferences.system, SAMPLE.parent / "match" / "small"
    system.use_online_access = online
    assert bpy.app.online_access is online
    words = ("match", "--tracking", match / "small.dat", "--library", SAMPLE, "--out", tmp_path / "out",
             "--scheduler", "tcp://cluster.invalid:8786")
    with pytest.raises(errors.BeyondMocapError, match="does not answer" if online else "Blender is offline"):
        run(child, *words)
    system.use_online_access = False


def heard(child, script, cancelled=lambda: False):
    """What is heard of a process that runs a Python script."""
    process = subprocess.Popen([sys.executable, "-c", script], stderr=subprocess.PIPE, text=True)
    return *child._follow_process(process, lambda done, text: None, cancelled), process.returncode


def test_one_that_talks_while_it_ends_has_its_time(child):
    """Patience is in seconds, however many lines come in them."""
    script = """
import signal, sys
signal.signal(signal.SIGINT, lambda *_: (sys.stderr.write("ending\\n" * 2000), sys.exit(130)))
print("{}", file=sys.stderr, flush=True)
signal.pause()
"""
    begun = time.monotonic()
    *_, asked, status = heard(child, script, lambda: time.monotonic() - begun > 1.0)
    assert asked and status == 130


def test_a_worker_that_lives_on_is_not_waited_for(child, monkeypatch):
    monkeypatch.setattr(child, "FINAL_WAIT", 0.3)
    script = "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(40)'])"
    start = time.monotonic()
    assert heard(child, script)[-1] == 0
    assert time.monotonic() - start < 30.0


def test_its_own_words_count_whatever_is_said_after_them(child):
    script = "import sys; sys.exit(print('beyond-mocap: no such file\\nUserWarning: leaked', file=sys.stderr) or 2)"
    assert heard(child, script)[1] == "beyond-mocap: no such file"


def test_it_finds_the_core_wherever_it_is_started_from(child, tmp_path, monkeypatch):
    """A folder beside it that has the core's name does not get in between, and sys.path itself is left alone."""
    (tmp_path / "beyond_mocap.py").write_text("raise SystemExit('wrong one')\n")
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    run(child, "mirror", SAMPLE / "walking_1_2.bvh", tmp_path / "out.bvh")
    assert (tmp_path / "out.bvh").exists() and sys.path == before
