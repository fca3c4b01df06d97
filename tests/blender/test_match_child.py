"""The command line in a process of its own: what it tells comes through, and it can be asked to end."""

import importlib
import pathlib
import sys
import time

import pytest
from conftest import EXTENSION

SAMPLE = pathlib.Path(__file__).resolve().parents[2] / "sample_blend" / "library"


@pytest.fixture
def child():
    return importlib.import_module(f"{EXTENSION}.scene.match.child")


@pytest.fixture
def errors(core):
    return core("errors")


def run(child, *arguments, cancelled=lambda: False):
    told = []
    notes = child.run(list(map(str, arguments)), lambda done, text: told.append((done, text)), cancelled)
    return notes, told


def test_it_does_what_the_command_does_and_tells_how_far_it_is(child, tmp_path):
    _, told = run(child, "library", SAMPLE, "--cache", tmp_path / "cache", "--report", tmp_path / "report.json")
    assert (tmp_path / "report.json").stat().st_size > 100
    assert len(told) > 3 and told[-1][0] > 0.5 and all(text for _, text in told)
    assert not child._running


def test_what_is_wrong_is_told_in_the_commands_words(child, errors, tmp_path):
    with pytest.raises(errors.BeyondMocapError, match="nowhere.*no such") as caught:
        run(child, "library", tmp_path / "nowhere")
    assert "beyond-mocap:" not in str(caught.value) and "\n" not in str(caught.value)


def test_cancelled_it_ends_soon(child, errors, tmp_path):
    start = time.monotonic()
    with pytest.raises(errors.Cancelled):
        run(child, "library", SAMPLE, "--cache", tmp_path, cancelled=lambda: time.monotonic() - start > 0.5)
    assert time.monotonic() - start < 30.0 and not child._running


def test_it_finds_the_core_wherever_it_is_started_from(child, tmp_path, monkeypatch):
    """A folder beside it that has the core's name does not get in between, and sys.path itself is left alone."""
    (tmp_path / "beyond_mocap.py").write_text("raise SystemExit('wrong one')\n")
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    run(child, "mirror", SAMPLE / "walking_1_2.bvh", tmp_path / "out.bvh")
    assert (tmp_path / "out.bvh").exists() and sys.path == before
