"""What the zip carries, read from bundle.toml, and how a wheel's file name is understood."""

import pathlib
import re
import tomllib
from typing import NamedTuple

HERE = pathlib.Path(__file__).resolve().parent


class Package(NamedTuple):
    """One bundled package: its name and version as released, whom it belongs to, whether it goes in slimmed."""

    name: str
    version: str
    copyright: str
    license: str
    slimmed: bool = False

    @property
    def bundled_version(self):
        """The version the zip's wheel carries: marked where we took something out."""
        return self.version + ("+slim" if self.slimmed else "")


class Platform(NamedTuple):
    """One of Blender's platforms: the Pythons to serve and the wheel tags that fit, the best first."""

    name: str
    pythons: list[str]
    tags: list[str]


class Wheel(NamedTuple):
    """A wheel's file name, taken apart; each tag set is what stands between the dots."""

    name: str
    version: str
    pythons: frozenset[str]
    abis: frozenset[str]
    platforms: frozenset[str]

    def serves(self, platform, python):
        """Whether Blender would unpack this wheel on that platform under that Python ("311")."""
        fits_python = f"cp{python}" in self.pythons or "py3" in self.pythons or (
            "abi3" in self.abis and any(_older(tag, python) for tag in self.pythons))
        return fits_python and ("any" in self.platforms or bool(self.platforms & set(platform.tags)))


def _older(tag, python):
    return bool(re.fullmatch(r"cp3\d+", tag)) and int(tag[3:]) <= int(python[1:])


def wheel(filename):
    """Take a wheel's file name apart.

    >>> wheel("lxml-6.1.3-cp311-cp311-win_amd64.whl").platforms
    frozenset({'win_amd64'})"""
    name, version, *_, python, abi, platform = filename.removesuffix(".whl").split("-")
    return Wheel(plain(name), version, *(frozenset(tags.split(".")) for tags in (python, abi, platform)))


def plain(name):
    """A package's name in the form in which two spellings are equal."""
    return re.sub(r"[-_.]+", "-", name).lower()


def packages():
    """All bundled packages, in the file's order."""
    return [Package(**row) for row in _table()["package"]]


def platforms():
    """Blender's platforms that a zip can be built for, by name."""
    return {name: Platform(name, **row) for name, row in _table()["platform"].items()}


def _table():
    return tomllib.loads((HERE / "bundle.toml").read_text("utf-8"))
