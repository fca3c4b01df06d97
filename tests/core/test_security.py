"""What SECURITY.md promises holds, and each of its lines names a test that exists."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from architecture import CORE, TOP, list_sources

LIBRARY = TOP / "sample_blend" / "library"
# Runs command lines in one process, and tells what they ask the system for: Python itself reports it (PEP 578).
WATCHED = """
import json, os, sys

events = {"network": [], "processes": [], "pickles": [], "written": []}
CHANGES = {"os.mkdir", "os.remove", "os.rename", "os.rmdir", "os.symlink", "os.link", "os.truncate", "os.chmod"}

def watch(event, arguments):
    if event in ("socket.connect", "socket.bind", "socket.sendto", "socket.getaddrinfo", "socket.gethostbyname"):
        events["network"].append(f"{event} {arguments[1:]}")
    elif event in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn"):
        events["processes"].append(str(arguments[1]))
    elif event == "pickle.find_class":
        events["pickles"].append(str(arguments))
    elif event in CHANGES:
        paths = [part for part in arguments if isinstance(part, (str, bytes, os.PathLike))]
        events["written"] += [os.path.abspath(path) for path in paths]
    elif event == "open" and isinstance(arguments[0], (str, os.PathLike)) and (
            arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)):
        events["written"].append(os.path.abspath(arguments[0]))

from beyond_mocap.cli.main import main
sys.addaudithook(watch)
status = [main(words) for words in json.loads(sys.argv[1])]
print("EVENTS", json.dumps({"status": status, **events}))
"""


@pytest.fixture
def watched(tmp_path):
    """Run command lines in a process of their own, below an empty home; return what they asked the system for."""

    def run(*commands):
        environment = {name: value for name, value in os.environ.items() if not name.startswith("XDG_")}
        environment |= {"HOME": str(tmp_path / "home"), "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(TOP)}
        words = json.dumps([list(map(str, command)) for command in commands])
        done = subprocess.run([sys.executable, "-c", WATCHED, words], cwd=tmp_path, env=environment,
                              capture_output=True, text=True, timeout=300)
        line = next((line for line in done.stdout.splitlines() if line.startswith("EVENTS ")), None)
        assert line, done.stdout + done.stderr
        return json.loads(line.removeprefix("EVENTS ")) | {"stderr": done.stderr}

    return run


def test_commands_reach_no_network_and_write_only_into_folders_that_they_are_given(watched, tmp_path):
    out, cache, clips = tmp_path / "out", tmp_path / "cache", tmp_path / "clips"
    out.mkdir()
    clips.mkdir()
    for path in LIBRARY.glob("walking_1_*"):
        shutil.copy(path, clips)
    (tmp_path / "labels.txt").touch()
    (tmp_path / "track.csv").write_text("time_s,x_m,y_m\n" + "".join(f"{t / 10},{0.13 * t:.2f},0\n" for t in range(60)))
    events = watched(
        ["synthesize", "--library", clips, "--cache", cache, "--track", "track.csv", "--annotations", "labels.txt",
         "--out", out / "take.bvh", "--report", out / "take.json", "--json"],
        ["evaluate", out / "take.bvh", "--track", "track.csv", "--report", out / "again.json"],
        ["mirror", LIBRARY / "walking_1_2.bvh", out / "mirrored.bvh"],
    )  # fmt: skip
    assert events["status"] == [0, 0, 0], events["stderr"]
    assert (events["network"], events["pickles"]) == ([], [])
    counters = ("['lscpu'", "['sysctl'", "['powershell.exe'")  # joblib counts the cores with what the system has
    assert [command for command in events["processes"] if not command.startswith(counters)] == []
    allowed = (str(out), str(cache), os.devnull)
    outsiders = sorted({path for path in events["written"] if not path.startswith(allowed)})
    assert events["written"] and outsiders == []


def test_an_address_in_place_of_a_file_is_not_fetched(watched, tmp_path):
    """kloppy can read addresses; nothing but paths of this machine ever reaches it."""
    addresses = "https://example.org/match.dat", "s3://bucket/match.dat", "file:///etc/passwd"
    events = watched(*(["match", "--tracking", address, "--library", LIBRARY, "--out", tmp_path / "out"]
                       for address in addresses))
    assert events["status"] == [2, 2, 2] and events["network"] == [] and "Traceback" not in events["stderr"]


def test_the_extension_leaves_pythons_modules_and_search_path_alone():
    sources = [*list_sources(CORE, "scene", "operators", "panels"), "batch.py", "__init__.py"]
    change = re.compile(r"sys\.(modules|meta_path|path_hooks)|sys\.path(\.\w+\(|\[.*\] = | \+?= )|site\.addsitedir")
    assert [str(path) for path in sources if change.search((TOP / path).read_text("utf-8"))] == []
    assert change.search("sys.path.insert(0, x)") and change.search('sys.modules["x"] = y')
    assert not change.search("[*(path for path in sys.path if path)]")


def test_each_promise_names_tests_that_exist():
    page = (TOP / "SECURITY.md").read_text("utf-8")
    promises = page[page.index("## What is promised") : page.index("## What is not")]
    rows = [row for row in promises.splitlines() if row.startswith("| ")][1:]
    assert len(rows) > 8
    for row in rows:
        named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", row)
        assert named, row
        for path, name in named:
            assert f"def {name}(" in (TOP / path).read_text("utf-8"), f"{path}::{name}"
