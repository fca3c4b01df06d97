"""The contents of the zips, read from bundle.toml and the pinned requirements, and the parts of a wheel's file name."""

import pathlib
import re
import tomllib
from typing import NamedTuple

HERE = pathlib.Path(__file__).resolve().parent
PINS = HERE / "requirements" / "bundle.txt"


class Package(NamedTuple):
    """One bundled package.

    Attributes:
        name, version: as released.
        copyright: the copyright holder.
        license: SPDX name.
        hashes: SHA-256 of its released wheels.
    """

    name: str
    version: str
    copyright: str
    license: str
    hashes: frozenset[str] = frozenset()


class Target(NamedTuple):
    """What one zip is for.

    Attributes:
        platform: Blender's name of the platform.
        python: the Python version, such as "311".
        tags: the wheel tags that fit, the best first.
        blender_min: the first Blender of this Python.
        blender_max: the first Blender after it that runs another; "" if there is none yet.
    """

    platform: str
    python: str
    tags: list[str]
    blender_min: str
    blender_max: str = ""

    @property
    def name(self):
        """Platform and Python."""
        return f"{self.platform}-cp{self.python}"


class Wheel(NamedTuple):
    """The parts of a wheel's file name; each tag set is split at the dots."""

    name: str
    version: str
    pythons: frozenset[str]
    abis: frozenset[str]
    platforms: frozenset[str]

    def is_compatible(self, target):
        """Return whether Blender unpacks this wheel there."""
        fits_python = f"cp{target.python}" in self.pythons or "py3" in self.pythons or (
            "abi3" in self.abis and any(_is_older(tag, target.python) for tag in self.pythons))
        return fits_python and ("any" in self.platforms or bool(self.platforms & set(target.tags)))


def _is_older(tag, python):
    return bool(re.fullmatch(r"cp3\d+", tag)) and int(tag[3:]) <= int(python[1:])


def parse_wheel_name(filename):
    """Split a wheel's file name into its parts.

    >>> parse_wheel_name("lxml-6.1.3-cp311-cp311-win_amd64.whl").platforms
    frozenset({'win_amd64'})
    """
    name, version, *_, python, abi, platform = filename.removesuffix(".whl").split("-")
    return Wheel(normalize_name(name), version, *(frozenset(tags.split(".")) for tags in (python, abi, platform)))


def normalize_name(name):
    """Normalize a package's name, so that equivalent spellings are equal."""
    return re.sub(r"[-_.]+", "-", name).lower()


def list_packages():
    """List all bundled packages, in the file's order; exit where bundle.toml and the pins name different ones."""
    rows, pins = _read_table()["package"], read_pins()
    if different := pins.keys() ^ {row["name"] for row in rows}:
        raise SystemExit(f"bundle.toml and {PINS.name} differ: {', '.join(sorted(different))}")
    return [Package(**row, **pins[row["name"]]) for row in rows]


def read_pins():
    """Read the pinned requirements.

    Returns:
        Name -> version and hashes.
    """
    pins = re.findall(r"^([a-z0-9-]+)==(\S+)((?:\s*\\\n\s+--hash=sha256:\w+)+)", PINS.read_text("utf-8"), re.MULTILINE)
    return {name: {"version": version, "hashes": frozenset(re.findall(r"sha256:(\w+)", hashes))}
            for name, version, hashes in pins}


def list_targets(*platforms):
    """List what zips can be built for.

    Args:
        platforms: Blender's names; none for all.
    Returns:
        One target for each Python of each platform.
    """
    table = _read_table()
    return [Target(name, python, table["platform"][name]["tags"], **table["python"][python])
            for name in platforms or table["platform"] for python in table["platform"][name]["pythons"]]


def _read_table():
    return tomllib.loads((HERE / "bundle.toml").read_text("utf-8"))
