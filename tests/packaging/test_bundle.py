"""The bundle is consistent, kloppy's slimming keeps what it must, and the lint sees what it is for."""

import base64
import csv
import hashlib
import io
import tomllib
import zipfile

import pytest

import build
import bundle
import lint
from wheels import reduce_wheel

LINUX = bundle.read_platforms()["linux-x64"]
PACKAGES = [bundle.Package("scipy", "1.17.1", "2001 SciPy Developers", "BSD-3-Clause"),
            bundle.Package("joblib", "1.6.0", "2008 joblib developers", "BSD-3-Clause")]
WHEELS = [f"scipy-1.17.1-cp{python}-cp{python}-manylinux_2_28_x86_64.whl" for python in LINUX.pythons] + [
    "joblib-1.6.0-py3-none-any.whl"]
MANIFEST = 'license = ["SPDX:GPL-3.0-or-later"]\ncopyright = ["2026 Us"]\nname = "x"\n'


def staged(folder, wheels=WHEELS, platform="linux-x64", packages=PACKAGES, present=None):
    """A staged folder with empty wheel files, as packaging/build.py would lay it out."""
    (folder / "wheels").mkdir()
    for name in present if present is not None else wheels:
        (folder / "wheels" / name).touch()
    text = build.complete_manifest(MANIFEST, packages, platform, wheels)
    (folder / "blender_manifest.toml").write_text(text, "utf-8")
    return folder


@pytest.mark.parametrize("name, platform, python, serves", [
    ("lxml-6.1.3-cp311-cp311-manylinux_2_26_x86_64.manylinux_2_28_x86_64.whl", "linux-x64", "311", True),
    ("lxml-6.1.3-cp311-cp311-manylinux_2_26_x86_64.whl", "linux-x64", "313", False),
    ("lxml-6.1.3-cp311-cp311-win_amd64.whl", "linux-x64", "311", False),
    ("pytz-2026.6-py2.py3-none-any.whl", "macos-arm64", "313", True),
    ("some-1.0-cp39-abi3-manylinux2014_x86_64.whl", "linux-x64", "314", True),
    ("some-1.0-cp313-abi3-manylinux2014_x86_64.whl", "linux-x64", "311", False),
])
def test_whom_a_wheel_serves(name, platform, python, serves):
    assert bundle.parse_wheel_name(name).is_compatible(bundle.read_platforms()[platform], python) is serves


def test_the_completed_manifest_is_toml_and_names_everything():
    manifest = tomllib.loads(build.complete_manifest(MANIFEST, PACKAGES, "linux-x64", WHEELS))
    assert manifest["copyright"][0] == "2026 Us"
    assert manifest["copyright"][1] == "2001 SciPy Developers (scipy 1.17.1, BSD-3-Clause)"
    assert manifest["wheels"] == [f"./wheels/{name}" for name in WHEELS]
    assert manifest["name"] == "x"


def test_a_whole_bundle_has_no_complaint(tmp_path):
    assert lint.lint_stage(staged(tmp_path), PACKAGES, LINUX) == []


@pytest.mark.parametrize("change, complaint", [
    ({"wheels": WHEELS[1:]}, "0 wheels of scipy for linux-x64, Python 311"),
    ({"wheels": [*WHEELS, "scipy-1.17.1-cp312-cp312-manylinux_2_28_x86_64.whl"]}, "fits no Python version of linux"),
    ({"present": WHEELS[1:]}, "is listed but missing"),
    ({"wheels": WHEELS, "present": [*WHEELS, "six-1.0-py3-none-any.whl"]}, "exists but is not listed"),
    ({"platform": "linux-x86"}, "is not one of Blender's"),
    ({"packages": PACKAGES[:1]}, "the copyright does not name joblib"),
])
def test_the_lint_sees(tmp_path, change, complaint):
    lines = lint.lint_stage(staged(tmp_path, **change), PACKAGES, LINUX)
    assert len(lines) == 1 and complaint in lines[0], lines


def test_the_lint_sees_what_does_not_belong_in_a_zip(tmp_path):
    path = tmp_path / "x.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("__init__.py", "blender_manifest.toml", "tests/core/test_x.py", "sample_blend/make_match.py",
                     "wheels/x-1-py3-none-win_amd64.whl", *(lint.SAMPLE + name for name in lint.SAMPLE_FILES[1:])):
            archive.writestr(name, "")
    lines = lint.lint_zip(path, LINUX)
    assert [line.split(": ")[1] for line in lines] == [
        "tests/core/test_x.py does not belong in it", "sample_blend/make_match.py does not belong in it",
        "x-1-py3-none-win_amd64.whl is for another platform", "LICENSE is missing",
        f"{lint.SAMPLE}{lint.SAMPLE_FILES[0]} is missing"]


def test_the_zip_has_the_sample_without_what_generates_it(tmp_path):
    build.copy_parts(build.TOP, tmp_path)
    assert not [name for name in lint.SAMPLE_FILES if not (tmp_path / lint.SAMPLE / name).is_file()]
    assert not [path.name for path in (tmp_path / lint.SAMPLE).iterdir() if path.is_file()]


def test_slimming_keeps_licence_and_metadata_and_rebuilds_the_record(tmp_path):
    package = bundle.Package("kloppy", "3.19.1", "2020 PySport", "BSD-3-Clause", slimmed=True)
    source = tmp_path / "kloppy-3.19.1-py3-none-any.whl"
    with zipfile.ZipFile(source, "w") as archive:
        archive.writestr("kloppy/__init__.py", "x = 1\n")
        archive.writestr("kloppy/tests/files/large.dat", "0" * 1000)
        archive.writestr("kloppy-3.19.1.dist-info/METADATA",
                         "Name: kloppy\nVersion: 3.19.1\nRequires-Dist: fsspec[http]>=2024.12.0\nRequires-Dist: "
                         "lxml>=4.4.0\n\nfsspec[http]\n")
        archive.writestr("kloppy-3.19.1.dist-info/licenses/LICENSE", "BSD")
        archive.writestr("kloppy-3.19.1.dist-info/RECORD", "stale,,\n")
    (tmp_path / "out").mkdir()
    target = reduce_wheel(source, tmp_path / "out", package)
    assert target.name == "kloppy-3.19.1+slim-py3-none-any.whl"
    with zipfile.ZipFile(target) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    info = "kloppy-3.19.1+slim.dist-info"
    assert set(files) == {"kloppy/__init__.py", f"{info}/METADATA", f"{info}/licenses/LICENSE", f"{info}/RECORD"}
    metadata = files[f"{info}/METADATA"].decode()
    assert metadata.startswith(
        "Name: kloppy\nVersion: 3.19.1+slim\nRequires-Dist: fsspec>=2024.12.0\nRequires-Dist: lxml>=4.4.0\n\n"
    )
    rows = {row[0]: row[1:] for row in csv.reader(io.StringIO(files[f"{info}/RECORD"].decode()))}
    assert set(rows) == set(files) and rows[f"{info}/RECORD"] == ["", ""]
    digest = base64.urlsafe_b64encode(hashlib.sha256(b"x = 1\n").digest()).rstrip(b"=").decode()
    assert rows["kloppy/__init__.py"] == [f"sha256={digest}", "6"]
