"""A provider of data as a record, the files of one match, and what all providers share: knowing a form, reading it."""

from __future__ import annotations

import importlib
import logging
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from ...base.errors import InputError

_HEAD = 8192  # bytes that show a form
_BY_LINES = {".dat", ".csv", ".txt", ".jsonl"}  # endings of files that are read line by line

Samples = Iterator[tuple[int, str, float, float]]
"""Frame number, id, x and y in the provider's coordinates."""
Files = tuple[tuple[Path, ...], tuple[Path, ...]]
"""Tracking files in the order of time, then metadata and what else belongs to them."""


@dataclass(frozen=True, kw_only=True)
class Provider:
    """What is known of a provider's form.

    Args:
        name: on the command line and in saved scenes; kloppy's module of this name reads the files.
        title: as the provider spells it.
        files: which files a match has, for people.
        patterns: the beginning of a file, 8 kB, matches one of them, and none of another provider's.
        loader: kloppy's function.
        arguments: its arguments' names -> what they are.
        renamed: parts of a file's name and what stands there in the name of the second file.
    """

    name: str
    title: str
    files: str
    patterns: tuple[bytes, ...]
    loader: str = "load"
    arguments: Mapping[str, str] = field(default_factory=dict)
    renamed: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, kw_only=True)
class TrackingProvider(Provider):
    """What is known of a provider's tracking; `arguments` are of `providers.load_tracking`.

    Args:
        coordinates: kloppy's name of the provider's own, "" for that of the provider.
        needs_metadata: whether there is always a second file; its name is also found without `renamed`.
        find_files: the tracking file, its metadata, and lines to add to -> all files of the match.
        team_loader: kloppy's function for a CSV of each team, "" where there is none.
        has_pitch_size: whether the pitch's size is in the files.
        has_own_roster: whether names come in a further file that nothing else depends on.
        number_in_tracking, number_in_metadata: from the beginning of a file to the match's number, None if not found.
        read_referees: the referees' samples, which kloppy leaves out; None where the provider has none.
    """

    arguments: Mapping[str, str] = field(default_factory=lambda: {"meta_data": "meta", "raw_data": "raw"})
    coordinates: str = ""
    needs_metadata: bool = True
    find_files: Callable[[Path, Path | None, list[str]], Files] = lambda path, meta, notes: ((path,), (meta,))
    team_loader: str = ""
    has_pitch_size: bool = True
    has_own_roster: bool = False
    number_in_tracking: Callable[[bytes], str | None] | None = None
    number_in_metadata: Callable[[bytes], str | None] | None = None
    read_referees: Callable[[Feed], Samples] | None = None


@dataclass(frozen=True)
class Feed:
    """The files of one match. tracking: in the order of time; for a CSV of each team the home team's first. meta: the
    metadata first, then what else belongs to it; () where there is none."""

    provider: TrackingProvider
    tracking: tuple[Path, ...]
    meta: tuple[Path, ...] = ()

    @property
    def path(self) -> Path:
        """The first tracking file."""
        return self.tracking[0]

    @property
    def by_lines(self) -> bool:
        """Whether a tracking file that ends too early still has whole lines."""
        return self.path.suffix.lower() in _BY_LINES

    @property
    def by_teams(self) -> bool:
        """Whether each team has a tracking file of its own."""
        return bool(self.provider.team_loader) and not self.meta


def read_head(path: Path) -> bytes:
    """The beginning of a file; nothing of a folder."""
    if not path.is_file():
        return b""
    with open(path, "rb") as file:
        return file.read(_HEAD).removeprefix(b"\xef\xbb\xbf")


Known = TypeVar("Known", bound=Provider)


def find_provider(path: Path, providers: Mapping[str, Known]) -> Known | None:
    """The provider whose form a file has; None where it is none that is known."""
    head = read_head(path)
    return next((one for one in providers.values() if any(re.match(form, head) for form in one.patterns)), None)


def load_through_kloppy(path: Path, provider: str, loader: str, arguments: Mapping, form: str, others: str):
    """kloppy's dataset. path, form, others: for messages: the file, what it should be, and what belongs to it.
    InputError where kloppy is not installed or cannot read the files."""
    try:
        module = importlib.import_module(f"kloppy.{provider}")
    except ImportError as error:
        raise InputError(
            path, f"kloppy cannot be imported ({error})", "kloppy 3.19 or newer", "pip install 'beyond-mocap[tracking]'"
        ) from None
    logging.getLogger("kloppy").addHandler(logging.NullHandler())  # what it would print is in our own lines
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return getattr(module, loader)(**arguments)
    except Exception as error:  # kloppy raises whatever its parsers meet in a wrong file
        found = f"not readable as {form} ({type(error).__name__}: {str(error)[:120]})"
        raise InputError(path, found, f"{form}{others}", "check the files, and the provider") from None
