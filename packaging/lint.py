"""Checks of the extension that Blender's `validate` does not make.

A platform with a typo, a missing or altered wheel, one without its licence, a bundled package that the copyright does
not name, a maintainer without an address, a file that must not be in the zip, a zip that is too big.
"""

import re
import tomllib
import zipfile

from bundle import normalize_name, parse_wheel_name
from wheels import list_pinned

BLENDER_PLATFORMS = {f"{system}-{processor}" for system in ("linux", "windows", "macos")
                     for processor in ("x64", "arm64")}
SAMPLE = "sample_blend/"
SAMPLE_FILES = ("library/walking_1_2.bvh", "match/player1.csv", "match/player1.txt", "match/small/small.dat",
                "match/small/small_meta.xml", "passes/library/ready_1.bvh", "markers/walk.trc")
MAX_ZIP_BYTES = 100_000_000
MAX_SAMPLE_BYTES = 3_500_000  # of the sample in the zip, compressed
FORBIDDEN = ("tests/", "benchmarks/", "docs/", "packaging/", "build/", "training/", ".git", ".venv", "shared/")


def lint_stage(folder, packages, target):
    """Check the folder staged for one zip.

    Args:
        folder: the staging folder.
        packages: the bundled packages.
        target: what the zip is for.
    Returns:
        Complaints, one line each.
    """
    manifest = tomllib.loads((folder / "blender_manifest.toml").read_text("utf-8"))
    listed = [path.removeprefix("./wheels/") for path in manifest["wheels"]]
    existing = {path.name for path in (folder / "wheels").iterdir()}
    return [*(f"platform {name!r} is not one of Blender's" for name in manifest["platforms"]
              if name not in BLENDER_PLATFORMS), *(f"wheel {name} is listed but missing" for name in listed
                                                   if name not in existing),
            *(f"wheel {name} exists but is not listed" for name in sorted(existing) if name not in listed),
            *(f"licence {name!r} has no SPDX name" for name in manifest["license"] if not name.startswith("SPDX:")),
            *check_maintainer(manifest["maintainer"]), *_check_copyright(manifest, packages),
            *_check_coverage(listed, packages, target), *_check_wheels(folder / "wheels", packages)]


def check_maintainer(text):
    """Check that a maintainer is a name and an address; return complaints."""
    fits = re.fullmatch(r"[^<>]*\w[^<>]* <[^<>@\s]+@[^<>@\s]+\.\w+>", text)
    return [] if fits else [f"maintainer {text!r}: expected a name and an address, 'Name <name@host>'"]


def _check_copyright(manifest, packages):
    for package in packages:
        credit = f"({package.name} {package.version}, {package.license})"
        if not any(line.endswith(credit) for line in manifest["copyright"]):
            yield f"the copyright does not name {package.name} {package.version}"


def _check_coverage(listed, packages, target):
    """Check that there is exactly one wheel of each package that Blender unpacks there, and no other."""
    wheels = {name: parse_wheel_name(name) for name in listed}
    unused = set(listed)
    for package in packages:
        matching = {name for name, wheel in wheels.items() if wheel.is_compatible(target)
                    and (wheel.name, wheel.version) == (normalize_name(package.name), package.version)}
        unused -= matching
        if len(matching) != 1:
            yield f"{len(matching)} wheels of {package.name} for {target.name}: {sorted(matching)}"
    yield from (f"wheel {name} is not for {target.name}" for name in sorted(unused))


def _check_wheels(folder, packages):
    """Check that all wheels are as released, and bring their licences."""
    pinned = list_pinned(packages, folder)
    altered = sorted(set(folder.iterdir()) - set(pinned))
    yield from (f"wheel {path.name} is not the released file" for path in altered)
    for path in pinned:
        with zipfile.ZipFile(path) as archive:
            if not any(re.search(r"\.dist-info/.*(LICEN[CS]E|COPYING)", name, re.I) for name in archive.namelist()):
                yield f"wheel {path.name} has no licence in it"


def lint_zip(path, target):
    """Check a finished zip.

    Args:
        path: the zip.
        target: what it is for.
    Returns:
        Complaints, one line each.
    """
    size = path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        sample_size = sum(one.compress_size for one in archive.infolist() if one.filename.startswith(SAMPLE))
    wheels = [name.removeprefix("wheels/") for name in names if name.startswith("wheels/") and name.endswith(".whl")]
    return [
        *(
            f"{path.name}: {name} does not belong in it"
            for name in names
            if name.startswith(FORBIDDEN) or "__pycache__" in name or is_sample_generator(name)
        ),
        *(
            f"{path.name}: {name} is for another platform"
            for name in wheels
            if not parse_wheel_name(name).is_compatible(target)
        ),
        *(
            f"{path.name}: {name} is missing"
            for name in ("__init__.py", "LICENSE", "SECURITY.md", "blender_manifest.toml", "sbom.cdx.json",
                         *(SAMPLE + name for name in SAMPLE_FILES))
            if name not in names
        ),
        *([f"{path.name}: the sample has {sample_size} bytes, at most {MAX_SAMPLE_BYTES} are expected"]
          if sample_size > MAX_SAMPLE_BYTES else []),
        *([f"{path.name}: {size} bytes, at most {MAX_ZIP_BYTES} are allowed"] if size > MAX_ZIP_BYTES else []),
    ]


def is_sample_generator(name):
    """Return whether a file is beside the sample's data: what generates it, or a file of Blender."""
    return name.startswith(SAMPLE) and name.count("/") == 1 and not name.endswith("/")
