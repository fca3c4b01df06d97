"""Checks of the extension that Blender's `validate` does not make.

A platform with a typo, a missing wheel, a Python version without its wheel, a bundled package that the copyright does
not name, a file that must not be in the zip.
"""

import tomllib
import zipfile

from bundle import normalize_name, parse_wheel_name

BLENDER_PLATFORMS = {f"{system}-{processor}" for system in ("linux", "windows", "macos")
                     for processor in ("x64", "arm64")}
SAMPLE = "sample_blend/"
SAMPLE_FILES = ("library/walking_1_2.bvh", "match/player1.csv", "match/player1.txt", "match/small/small.dat",
                "match/small/small_meta.xml", "passes/library/ready_1.bvh", "markers/walk.trc")
MAX_SAMPLE_BYTES = 3_500_000  # of the sample in the zip, compressed
FORBIDDEN = ("tests/", "benchmarks/", "docs/", "packaging/", "build/", "training/", ".git", ".venv", "shared/")


def lint_stage(folder, packages, platform):
    """Check the folder staged for one platform.

    Args:
        folder: the staging folder.
        packages: the bundled packages.
        platform: the platform.
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
            *_check_copyright(manifest, packages), *_check_coverage(listed, packages, platform)]


def _check_copyright(manifest, packages):
    for package in packages:
        credit = f"({package.name} {package.bundled_version}, {package.license})"
        if not any(line.endswith(credit) for line in manifest["copyright"]):
            yield f"the copyright does not name {package.name} {package.bundled_version}"


def _check_coverage(listed, packages, platform):
    """Check that each Python version gets exactly one wheel of each package, and that each wheel is used."""
    wheels = {name: parse_wheel_name(name) for name in listed}
    unused = set(listed)
    for python in platform.pythons:
        for package in packages:
            matching = {name for name, w in wheels.items() if w.is_compatible(platform, python)
                        and (w.name, w.version) == (normalize_name(package.name), package.bundled_version)}
            unused -= matching
            if len(matching) != 1:
                found = f"{len(matching)} wheels of {package.name}"
                yield f"{found} for {platform.name}, Python {python}: {sorted(matching)}"
    yield from (f"wheel {name} fits no Python version of {platform.name}" for name in sorted(unused))


def lint_zip(path, platform):
    """Check a finished zip for one platform.

    Args:
        path: the zip.
        platform: the platform.
    Returns:
        Complaints, one line each.
    """
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
            if not any(parse_wheel_name(name).is_compatible(platform, python) for python in platform.pythons)
        ),
        *(
            f"{path.name}: {name} is missing"
            for name in ("__init__.py", "LICENSE", "blender_manifest.toml", *(SAMPLE + name for name in SAMPLE_FILES))
            if name not in names
        ),
        *([f"{path.name}: the sample has {sample_size} bytes, at most {MAX_SAMPLE_BYTES} are expected"]
          if sample_size > MAX_SAMPLE_BYTES else []),
    ]


def is_sample_generator(name):
    """Return whether a file is beside the sample's data: what generates it, or a file of Blender."""
    return name.startswith(SAMPLE) and name.count("/") == 1 and not name.endswith("/")
