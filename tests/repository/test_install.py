"""From a repository over http on this machine: Blender installs the extension, updates it, and keeps what was saved.

`make repository-test` runs it, in Blender as a Python module and in the real one. Version 0.1.0 is this code under that
number; a file that the real 0.1 has saved is opened too.
"""

import http.server
import json
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import zipfile
from urllib.parse import urlsplit

import pytest
from repository import build_repository

import build

HERE = pathlib.Path(__file__).resolve().parent
REAL_BLENDER = build.TOP / os.environ.get("REAL_BLENDER", "../shared/tools/real-blender")
WORK = build.TOP / "build" / "repository-test"


@pytest.fixture(scope="module")
def repositories(tmp_path_factory):
    """Two repositories of this machine's zips, with 0.1.0 and with the version of today."""
    zips = build.list_zips(build.find_own_platform())
    if not zips:
        pytest.skip("no zips; run: make extension")
    top = tmp_path_factory.mktemp("repositories")
    (top / "zips").mkdir()
    older = [give_version(path, top / "zips" / path.name, "0.1.0") for path in zips]
    build_repository(older, top / "0.1.0")
    build_repository(zips, top / build.read_version())
    return top


def give_version(source, target, version):
    """Copy a zip with another version in its manifest; return the copy."""
    now = f'\nversion = "{build.read_version()}"'.encode()
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for entry in old.infolist():
            data = old.read(entry)
            if entry.filename == "blender_manifest.toml":
                assert data.count(now) == 1
                data = data.replace(now, f'\nversion = "{version}"'.encode())
            new.writestr(entry, data)
    return target


@pytest.fixture
def server(repositories):
    """Serve the repository in `server.shown` on the loopback, under one address; `server.asked`: the paths so far."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def translate_path(self, path):
            return str(repositories / self.server.shown / urlsplit(path).path.lstrip("/"))

        def log_message(self, *_):
            self.server.asked.append(urlsplit(self.path).path)

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.shown, server.asked = "0.1.0", []
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def build_command(kind, profile):
    """Build the start of a command that runs a script in a Blender, and its environment."""
    if kind == "real":
        if not os.access(REAL_BLENDER, os.X_OK) or subprocess.run([REAL_BLENDER, "setup"]).returncode:
            pytest.skip("no real Blender can be had here")
        return [REAL_BLENDER, "run", "-b", "--online-mode", "--python"], {"REAL_BLENDER_HOME": str(profile)}
    python = pathlib.Path(sys.executable) if kind == "module" else build.TOP / ".venv-4.5" / "bin" / "python"
    if not python.exists():
        pytest.skip("no Blender 4.5 here")
    return [python, "-P"], {"BLENDER_USER_RESOURCES": str(profile)}


@pytest.mark.parametrize("kind", ["module", "oldest", "real"])
def test_a_repository_installs_and_updates_and_saved_files_stay(kind, server):
    work = WORK / kind
    shutil.rmtree(work, ignore_errors=True)
    (work / "profile").mkdir(parents=True)
    start, environment = build_command(kind, work / "profile")
    url = f"http://127.0.0.1:{server.server_port}/index.json"

    def run(*words):
        command = [*start, HERE / "in_blender.py", "--", *words, work]
        done = subprocess.run(command, cwd=build.TOP, env=os.environ | environment, capture_output=True, text=True,
                              timeout=300)
        line = next((line for line in done.stdout.splitlines() if line.startswith("REPORT ")), None)
        assert done.returncode == 0 and line, done.stdout + done.stderr
        print(line)
        return json.loads(line.removeprefix("REPORT "))

    installed = run("install", url)
    assert installed["version"] == "0.1.0"
    server.shown = build.read_version()
    updated = run("update")
    assert updated["version"] == build.read_version() and str(work) in updated["scipy"], "packages are our wheels"
    python = "cp" + "".join(updated["python"].split(".")[:2])
    fetched = [path for path in server.asked if path.endswith(".zip")]
    assert len(fetched) == 2 and all(python in path for path in fetched), "each Blender takes its Python's zip"
