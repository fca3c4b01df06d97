"""Fetch the bundle's wheels, once for each platform and Python, into a cache outside the clone.

pip takes only files whose hash is pinned in requirements/bundle.txt. A file of the cache is hashed again each time.
"""

import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from bundle import PINS, normalize_name, parse_wheel_name

CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "beyond-mocap" / "wheels"


def copy_wheels(packages, target, folder):
    """Copy every wheel that a zip needs into a folder.

    Args:
        packages: the bundled packages.
        target: what the zip is for.
        folder: a new folder.
    Returns:
        The file names, sorted.
    """
    folder.mkdir(parents=True)
    for source in _fetch_wheels(packages, target):
        shutil.copyfile(source, folder / source.name)
    return sorted(path.name for path in folder.iterdir())


def _fetch_wheels(packages, target):
    """Return the cached wheels of one platform and Python; download them if any is missing or is not the pinned one."""
    folder = CACHE / target.name
    if len(list_pinned(packages, folder)) < len(packages):
        _download_wheels(target, folder)
    return list_pinned(packages, folder)


def list_pinned(packages, folder):
    """List the wheels in a folder whose name, version and hash are pinned."""
    hashes = {(normalize_name(package.name), package.version): package.hashes for package in packages}
    return [path for path in sorted(folder.glob("*.whl"))
            if compute_hash(path) in hashes.get(parse_wheel_name(path.name)[:2], ())]


def compute_hash(path):
    """Compute the SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _download_wheels(target, folder):
    """Download to a temporary folder and move complete files, so that simultaneous builds do not interfere."""
    print(f"wheels: fetching the bundle for {target.name}", flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=CACHE) as fresh:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps",
                   "--only-binary=:all:", "--implementation", "cp", "--python-version", target.python,
                   "--abi", f"cp{target.python}", "--abi", "abi3", "--abi", "none", "--dest", fresh]
        command += [part for tag in target.tags for part in ("--platform", tag)]
        subprocess.run([*command, "--require-hashes", "--requirement", PINS], check=True)
        for path in pathlib.Path(fresh).glob("*.whl"):
            path.replace(folder / path.name)
