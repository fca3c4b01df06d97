"""The bundle is consistent, only pinned files get into a zip, and the lint sees what it is for."""

import hashlib
import io
import re
import tomllib
import zipfile

import pytest

import build
import bundle
import lint
import wheels

TARGETS = {target.name: target for target in bundle.list_targets()}
LINUX = TARGETS["linux-x64-cp311"]
SCIPY, JOBLIB = "scipy-1.17.1-cp311-cp311-manylinux_2_28_x86_64.whl", "joblib-1.6.0-py3-none-any.whl"
WHEELS = [SCIPY, JOBLIB]
MANIFEST = """license = ["SPDX:GPL-3.0-or-later"]
maintainer = "Us <us@example.org>"
blender_version_min = "4.5.0"
copyright = ["2026 Us"]
name = "x"

[permissions]
files = "y"
"""


def make_wheel(name, licence="LICENSE.txt"):
    """The bytes of a wheel with a licence."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(zipfile.ZipInfo(f"{name.split('-')[0]}-1.dist-info/{licence}"), name)
    return out.getvalue()


def pin(name, version, data, copyright):
    """A package of one released wheel."""
    return bundle.Package(name, version, copyright, "BSD-3-Clause", frozenset([hashlib.sha256(data).hexdigest()]))


PACKAGES = [pin("scipy", "1.17.1", make_wheel(SCIPY), "2001 SciPy Developers"),
            pin("joblib", "1.6.0", make_wheel(JOBLIB), "2008 joblib developers")]


def staged(folder, listed=WHEELS, target=LINUX, packages=PACKAGES, present=None, maintainer=None, files=None):
    """A staged folder with small wheels, as packaging/build.py would lay it out; `files` have other bytes."""
    (folder / "wheels").mkdir()
    for name in present if present is not None else listed:
        (folder / "wheels" / name).write_bytes((files or {}).get(name, make_wheel(name)))
    text = build.complete_manifest(MANIFEST, packages, target, listed, maintainer)
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
    assert bundle.parse_wheel_name(name).is_compatible(TARGETS[f"{platform}-cp{python}"]) is serves


def test_the_completed_manifest_is_toml_and_names_everything():
    manifest = tomllib.loads(build.complete_manifest(MANIFEST, PACKAGES, LINUX, WHEELS, 'A "B" <c@d.org>'))
    assert manifest["copyright"] == ["2026 Us", "2001 SciPy Developers (scipy 1.17.1, BSD-3-Clause)",
                                     "2008 joblib developers (joblib 1.6.0, BSD-3-Clause)"]
    assert manifest["wheels"] == [f"./wheels/{name}" for name in WHEELS]
    assert manifest["name"] == "x" and manifest["permissions"] == {"files": "y"}
    assert manifest["maintainer"] == 'A "B" <c@d.org>'
    assert (manifest["blender_version_min"], manifest["blender_version_max"]) == ("4.5.0", "5.1.0")


def test_each_blender_has_one_zip_of_each_platform():
    """No two zips of a platform are for the same Python, and the ranges of Blender leave no gap."""
    assert len(TARGETS) == len(bundle.list_targets())
    for platform in {target.platform for target in TARGETS.values()}:
        ends = {(target.blender_min, target.blender_max) for target in bundle.list_targets(platform)}
        assert ends <= {("4.5.0", "5.1.0"), ("5.1.0", "")} and ("4.5.0", "5.1.0") in ends


def test_every_bundled_package_is_pinned_by_hash():
    assert all(package.hashes and re.fullmatch(r"[\w.]+", package.version) for package in bundle.list_packages())


def test_a_cached_file_with_another_hash_is_fetched_again(tmp_path, monkeypatch):
    """Neither an altered file in the cache nor one that is not pinned gets into a zip."""
    monkeypatch.setattr(wheels, "CACHE", tmp_path)
    folder = tmp_path / LINUX.name
    folder.mkdir()
    for name, data in ((SCIPY, b"altered"), (JOBLIB, make_wheel(JOBLIB)), ("six-1.0-py3-none-any.whl", b"x")):
        (folder / name).write_bytes(data)
    fetched = []

    def download(target, into):
        fetched.append(target)
        (into / SCIPY).write_bytes(make_wheel(SCIPY))

    monkeypatch.setattr(wheels, "_download_wheels", download)
    assert wheels.copy_wheels(PACKAGES, LINUX, tmp_path / "out") == sorted(WHEELS) and fetched == [LINUX]


def test_a_whole_bundle_has_no_complaint(tmp_path):
    assert lint.lint_stage(staged(tmp_path), PACKAGES, LINUX) == []


@pytest.mark.parametrize("change, complaint", [
    ({"listed": WHEELS[1:]}, "0 wheels of scipy for linux-x64-cp311"),
    ({"present": WHEELS[1:]}, "is listed but missing"),
    ({"target": LINUX._replace(platform="linux-x86")}, "is not one of Blender's"),
    ({"packages": PACKAGES[:1]}, "the copyright does not name joblib"),
    ({"maintainer": "Somebody"}, "expected a name and an address"),
    ({"files": {JOBLIB: make_wheel("altered")}}, f"wheel {JOBLIB} is not the released file"),
])
def test_the_lint_sees(tmp_path, change, complaint):
    lines = lint.lint_stage(staged(tmp_path, **change), PACKAGES, LINUX)
    assert len(lines) == 1 and complaint in lines[0], lines


def test_the_lint_sees_a_wheel_too_many_and_one_without_a_licence(tmp_path):
    other, bare = "scipy-1.17.1-cp312-cp312-manylinux_2_28_x86_64.whl", make_wheel(JOBLIB, "METADATA")
    packages = [PACKAGES[0]._replace(hashes=PACKAGES[0].hashes | {hashlib.sha256(make_wheel(other)).hexdigest()}),
                pin("joblib", "1.6.0", bare, "2008 joblib developers")]
    folder = staged(tmp_path, [*WHEELS, other], packages=packages, files={JOBLIB: bare})
    assert lint.lint_stage(folder, packages, LINUX) == [
        f"wheel {other} is not for linux-x64-cp311", f"wheel {JOBLIB} has no licence in it"]


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
        "SECURITY.md is missing", "sbom.cdx.json is missing", f"{lint.SAMPLE}{lint.SAMPLE_FILES[0]} is missing"]


def test_the_zip_has_the_sample_without_what_generates_it(tmp_path):
    build.copy_parts(build.TOP, tmp_path)
    assert not [name for name in lint.SAMPLE_FILES if not (tmp_path / lint.SAMPLE / name).is_file()]
    assert not [path.name for path in (tmp_path / lint.SAMPLE).iterdir() if path.is_file()]
