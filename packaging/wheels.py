"""Fetch the bundle's wheels, once per platform and Python version, into a cache outside the clone, and reduce kloppy's.

kloppy is bundled without its 213 MB of test recordings and without the HTTP client that only its downloads need; the
extension reads local files. The rest is kloppy's code as released, its licence and its metadata. The metadata no longer
requires `fsspec[http]` (the aiohttp family), the version shows that the wheel is reduced, and RECORD lists its actual
files.
"""

import base64
import csv
import hashlib
import io
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor

from bundle import plain, wheel

CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "beyond-mocap" / "wheels"
LEFT_OUT = ("kloppy/tests/",)
STAMP = (2020, 1, 1, 0, 0, 0)  # fixed, so that the wheel is reproducible bit for bit


def gather(packages, platform, folder):
    """Copy every wheel that a platform needs into a folder.

    Args:
        packages: the bundled packages.
        platform: the platform.
        folder: a new folder.
    Returns:
        The file names, sorted.
    """
    folder.mkdir(parents=True)
    with ThreadPoolExecutor(2) as pool:
        fetched = list(pool.map(lambda python: _fetch(packages, platform, python), platform.pythons))
    for source in sorted({path.name: path for paths in fetched for path in paths}.values()):
        package = next(p for p in packages if plain(p.name) == wheel(source.name).name)
        if package.slimmed:
            slim(source, folder, package)
        else:
            shutil.copyfile(source, folder / source.name)
    return sorted(path.name for path in folder.iterdir())


def _fetch(packages, platform, python):
    """Return the cached wheels for one platform and Python version; download them if the cache is incomplete."""
    pins = [f"{package.name}=={package.version}" for package in packages]
    folder = CACHE / f"{platform.name}-cp{python}"
    if not _complete(folder, packages):
        _download(pins, platform, python, folder)
    wanted = {(plain(package.name), package.version) for package in packages}
    return [path for path in folder.glob("*.whl") if wheel(path.name)[:2] in wanted]


def _complete(folder, packages):
    have = {wheel(path.name)[:2] for path in folder.glob("*.whl")}
    return all((plain(package.name), package.version) in have for package in packages)


def _download(pins, platform, python, folder):
    """Download to a temporary folder and move complete files, so that simultaneous builds do not interfere."""
    print(f"wheels: fetching {len(pins)} packages for {platform.name}, Python {python[0]}.{python[1:]}", flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=CACHE) as fresh:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps",
                   "--only-binary=:all:", "--implementation", "cp", "--python-version", python,
                   "--abi", f"cp{python}", "--abi", "abi3", "--abi", "none", "--dest", fresh]
        command += [part for tag in platform.tags for part in ("--platform", tag)]
        subprocess.run([*command, *pins], check=True)
        for path in pathlib.Path(fresh).glob("*.whl"):
            path.replace(folder / path.name)


def slim(source, folder, package):
    """Write the reduced wheel of a package.

    Args:
        source: the released wheel.
        folder: the folder to write to.
        package: the package.
    Returns:
        The new wheel's path.
    """
    old, new = (f"{package.name}-{version}" for version in (package.version, package.bundled_version))
    target = folder / source.name.replace(old, new)
    files = {name.replace(f"{old}.dist-info/", f"{new}.dist-info/"): text for name, text in _kept(source)}
    metadata = f"{new}.dist-info/METADATA"
    files[metadata] = _slim_metadata(files[metadata].decode("utf-8"), package).encode("utf-8")
    record = f"{new}.dist-info/RECORD"
    files[record] = _record(files, record)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, STAMP), data, zipfile.ZIP_DEFLATED)
    return target


def _kept(source):
    with zipfile.ZipFile(source) as archive:
        for name in archive.namelist():
            if not name.startswith(LEFT_OUT):
                yield name, archive.read(name)


def _slim_metadata(text, package):
    """Return the metadata with the marked version and with fsspec without its "http" extra."""
    head, gap, description = text.partition("\n\n")
    lines = [line.replace("fsspec[http]", "fsspec") for line in head.splitlines()]
    lines[lines.index(f"Version: {package.version}")] = f"Version: {package.bundled_version}"
    return "\n".join(lines) + gap + description


def _record(files, record):
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    for name, data in files.items():
        if name != record:
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode("ascii")
            rows.writerow([name, f"sha256={digest}", len(data)])
    rows.writerow([record, "", ""])
    return out.getvalue().encode("utf-8")
