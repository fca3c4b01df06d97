"""The contents of the zip, read from bundle.toml, and the parts of a wheel's file name."""

import pathlib
import re
import tomllib
from typing import NamedTuple

HERE = pathlib.Path(__file__).resolve().parent


class Package(NamedTuple):
    """One bundled package.

    Attributes:
        name, version: as released.
        copyright: the copyright holder.
        license: SPDX name.
        slimmed: whether the zip's wheel is reduced.
    """

    name: str
    version: str
    copyright: str
    license: str
    slimmed: bool = False

    @property
    def bundled_version(self):
        """The version of the zip's wheel, marked if the wheel is reduced."""
        return self.version + ("+slim" if self.slimmed else "")


class Platform(NamedTuple):
    """One of Blender's platforms.

    Attributes:
        name: Blender's name.
        pythons: the Python versions to support.
        tags: the wheel tags that fit, the best first.
    """

    name: str
    pythons: list[str]
    tags: list[str]


class Wheel(NamedTuple):
    """The parts of a wheel's file name; each tag set is split at the dots."""

    name: str
    version: str
    pythons: frozenset[str]
    abis: frozenset[str]
    platforms: frozenset[str]

    def serves(self, platform, python):
        """Return whether Blender unpacks this wheel on a platform under a Python version.

        Args:
            platform: the platform.
            python: the version, such as "311".
        """
        fits_python = f"cp{python}" in self.pythons or "py3" in self.pythons or (
            "abi3" in self.abis and any(_older(tag, python) for tag in self.pythons))
        return fits_python and ("any" in self.platforms or bool(self.platforms & set(platform.tags)))


def _older(tag, python):
    return bool(re.fullmatch(r"cp3\d+", tag)) and int(tag[3:]) <= int(python[1:])


def wheel(filename):
    """Split a wheel's file name into its parts.

    >>> wheel("lxml-6.1.3-cp311-cp311-win_amd64.whl").platforms
    frozenset({'win_amd64'})
    """
    name, version, *_, python, abi, platform = filename.removesuffix(".whl").split("-")
    return Wheel(plain(name), version, *(frozenset(tags.split(".")) for tags in (python, abi, platform)))


def plain(name):
    """Normalize a package's name, so that equivalent spellings are equal."""
    return re.sub(r"[-_.]+", "-", name).lower()


def packages():
    """List all bundled packages, in the file's order."""
    return [Package(**row) for row in _table()["package"]]


def platforms():
    """Read the platforms that a zip can be built for.

    Returns:
        Name -> platform.
    """
    return {name: Platform(name, **row) for name, row in _table()["platform"].items()}


def _table():
    return tomllib.loads((HERE / "bundle.toml").read_text("utf-8"))
