"""The Python package: built twice with the same bits, complete and no more, and at work in a fresh environment.

That environment has what the package requires, and none of its extras.
"""

import email
import hashlib
import importlib.util
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from beyond_mocap.base.optional_packages import EXTRAS
from build import TOP

PROJECT = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))["project"]
TUTORIAL = "docs/get-started/python.md"
DATE = (2026, 1, 2, 3, 4, 6)
EPOCH = "1767323046"  # the same as SOURCE_DATE_EPOCH
RUN_TUTORIAL = """
import contextlib, io, pathlib, re, sys
names, printed = {}, ""
for kind, text in re.findall(r"```(python|text)\\n(.*?)```", pathlib.Path(sys.argv[1]).read_text("utf-8"), re.S):
    if kind == "python":
        with contextlib.redirect_stdout(io.StringIO()) as out:
            exec(text, names)
        printed = out.getvalue()
    elif printed != text:
        raise SystemExit(f"the page says\\n{text}\\nand the code\\n{printed}")
"""


def build_package(source: Path, out: Path) -> dict[str, Path]:
    """Build sdist and wheel of a folder: suffix -> file."""
    subprocess.run([TOP / "packaging" / "venv.sh", "package"], check=True)
    command = [TOP / ".venv-package/bin/python", "-m", "build", "--no-isolation", "--outdir", out, source]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "SOURCE_DATE_EPOCH": EPOCH})
    return {path.suffix: path for path in out.iterdir()}


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> SimpleNamespace:
    """Sdist and wheel of the clone, and the sdist unpacked as somebody with other rights to files would."""
    folder = tmp_path_factory.mktemp("package")
    files = build_package(TOP, folder / "out")
    mask = os.umask(0o077)
    try:
        with tarfile.open(files[".gz"]) as archive:
            archive.extractall(folder, filter="data")
    finally:
        os.umask(mask)
    return SimpleNamespace(sdist=files[".gz"], wheel=files[".whl"],
                           source=folder / files[".gz"].name.removesuffix(".tar.gz"))


@pytest.fixture(scope="module")
def fresh(package, tmp_path_factory) -> Path:
    """An environment with the wheel, and with what it requires taken from this one."""
    folder = tmp_path_factory.mktemp("fresh") / "venv"
    venv.create(folder, symlinks=os.name != "nt")
    (site,) = (folder / "lib").glob("python*/site-packages")
    for requirement in PROJECT["dependencies"]:
        module = Path(importlib.util.find_spec(re.match(r"\w+", requirement)[0]).origin)
        for source in (module.parent, *module.parents[1].glob(f"{module.parent.name}.libs")) \
                if module.name == "__init__.py" else (module,):
            (site / source.name).symlink_to(source)
    subprocess.run([sys.executable, "-m", "pip", "--python", folder, "install", "--quiet", "--no-deps", "--no-index",
                    "--disable-pip-version-check", package.wheel], check=True)
    return folder / "bin"


def run(command: list, cwd: Path) -> subprocess.CompletedProcess:
    """Run a command that sees neither the clone nor its environment."""
    ours = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return subprocess.run(command, cwd=cwd, env=ours, capture_output=True, text=True)


def test_the_unpacked_sdist_builds_the_same_bits(package, tmp_path):
    again = build_package(package.source, tmp_path)
    hashes = [[hashlib.sha256(path.read_bytes()).hexdigest() for path in files]
              for files in ((package.sdist, package.wheel), (again[".gz"], again[".whl"]))]
    assert hashes[0] == hashes[1]
    with zipfile.ZipFile(package.wheel) as archive:
        assert {entry.date_time for entry in archive.infolist()} == {DATE}


def test_the_wheel_has_the_core_and_nothing_else(package):
    with zipfile.ZipFile(package.wheel) as archive:
        names = set(archive.namelist())
    tracked = subprocess.run(["git", "ls-files", "beyond_mocap", "training"], cwd=TOP, capture_output=True, text=True)
    own = {name for name in names if ".dist-info/" not in name}
    if tracked.returncode == 0:
        assert own == set(tracked.stdout.splitlines())
    assert {name.partition("/")[0] for name in own} == {"beyond_mocap", "training"}
    assert "beyond_mocap/py.typed" in own and any(name.endswith("licenses/LICENSE") for name in names)


def test_the_sdist_has_the_core_the_tutorial_and_its_sample(package):
    with tarfile.open(package.sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {name.partition("/")[0] for name in names} == {
        "beyond_mocap", "training", "sample_blend", "docs", "CHANGELOG.md", "LICENSE", "PKG-INFO", "README.md",
        "pyproject.toml", ".gitignore"}
    assert {name for name in names if name.startswith("docs/")} == {TUTORIAL}
    assert {name.split("/")[1] for name in names if name.startswith("sample_blend/")} == {"library", "match"}


def test_every_optional_import_has_its_extra(package):
    """The table of the code against the requirements in the wheel."""
    with zipfile.ZipFile(package.wheel) as archive:
        (place,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        metadata = email.message_from_bytes(archive.read(place))
    names = {"sklearn": "scikit-learn"}
    for extra, packages in EXTRAS.items():
        required = [line for line in metadata.get_all("Requires-Dist") if f"extra == '{extra}'" in line]
        assert all(any(re.match(rf"{names.get(package, package)}\b", line) for line in required)
                   for package in packages), extra
    assert set(metadata.get_all("Provides-Extra")) == {*EXTRAS, "test"}


def test_the_tutorial_runs_in_a_fresh_environment(package, fresh):
    done = run([fresh / "python", "-c", RUN_TUTORIAL, TUTORIAL], package.source)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (package.source / "player2.bvh").stat().st_size > 100_000


@pytest.mark.parametrize("arguments, extra", [
    ("synthesize --library sample_blend/library --track sample_blend/match/player1.csv --method blocks --out x.bvh",
     "learn"),
    ("match --tracking sample_blend/match/small/small.dat --library sample_blend/library --out match", "match"),
    ("reconstruct throw.c3d --out x.bvh", "markers"),
    ("evaluate sample_blend/library/walking_1_2.bvh --report x.json --html x.html", "plots"),
    ("throw train . --out x.npz", "training"),
])
def test_a_missing_extra_is_one_line(package, fresh, arguments, extra):
    (package.source / "throw.c3d").write_bytes((TOP / "sample_blend/markers/throw.c3d").read_bytes())
    before = set(package.source.iterdir())
    done = run([fresh / "beyond-mocap", *arguments.split()], package.source)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert f"pip install '.[{extra}]'" in done.stderr.splitlines()[-1], done.stderr
    assert not {path.name for path in set(package.source.iterdir()) - before} & {"x.bvh", "x.html", "x.json", "x.npz"}


@pytest.mark.parametrize("arguments", [
    "mirror sample_blend/library/walking_1_2.bvh mirrored.bvh",
    "retarget sample_blend/library/walking_1_2.bvh --to sample_blend/library/jogging_2_4.bvh --out other.bvh",
    "path sample_blend/library/walking_1_2.bvh --path sample_blend/match/player1.csv --out bent.bvh",
    "evaluate sample_blend/library/walking_1_2.bvh --report report.json",
])
def test_verbs_of_one_motion_need_no_extra(package, fresh, arguments):
    done = run([fresh / "beyond-mocap", *arguments.split()], package.source)
    assert done.returncode == 0, done.stderr
    assert (package.source / arguments.split()[-1]).is_file()
