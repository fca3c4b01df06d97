"""Fetch the wheels of the bundle, once per platform and Python, into a cache outside the clone."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import slim
from bundle import plain, wheel

CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "beyond-mocap" / "wheels"


def gather(packages, platform, folder):
    """Put every wheel that this platform needs into `folder`; return the file names, sorted."""
    folder.mkdir(parents=True)
    with ThreadPoolExecutor(2) as pool:
        fetched = list(pool.map(lambda python: _fetch(packages, platform, python), platform.pythons))
    for source in sorted({path.name: path for paths in fetched for path in paths}.values()):
        package = next(p for p in packages if plain(p.name) == wheel(source.name).name)
        if package.slimmed:
            slim.slim(source, folder, package)
        else:
            shutil.copyfile(source, folder / source.name)
    return sorted(path.name for path in folder.iterdir())


def _fetch(packages, platform, python):
    """The cached wheels for one platform and Python; downloaded where the cache has not all of them."""
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
    """Download beside the folder and move each file in when it is whole, so that two builds at once do no harm."""
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
