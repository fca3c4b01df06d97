"""A data provider as a record, the files of one match, and what all providers share: detecting and loading a format."""

from __future__ import annotations

import codecs
import contextlib
import json
import logging
import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar
from xml.parsers import expat

from ...base import optional_packages
from ...base.errors import InputError, build_read_error, describe_damage

MAX_PLAYERS = 60
"""Two squads of 26 and the referees have fewer; more are two matches in one file."""
_MANY = rb"(?i)\b(player(_id)?|track_id|id|joint|landmark)\b"  # columns of tables of several people
_HEAD_BYTES = 8192  # bytes that identify a format
_LINE_SUFFIXES = {".dat", ".csv", ".txt", ".jsonl"}  # suffixes of files that are read line by line

Samples = Iterator[tuple[int, str, float, float]]
"""Frame number, id, x and y in the provider's coordinates."""
Files = tuple[tuple[Path, ...], tuple[Path, ...]]
"""Tracking files in time order, then metadata and further files."""


@dataclass(frozen=True, kw_only=True)
class Provider:
    """A provider's file format.

    Attributes:
        name: on the command line and in saved scenes; kloppy's module of this name reads the files.
        title: as the provider spells it.
        files: the files of a match, for users.
        patterns: the beginning of a file (8 kB) matches one of them, and none of another provider's.
        loader: kloppy's function.
        arguments: its arguments' names -> their content.
        renamed: parts of a file's name and their replacement in the name of the second file.
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
    """A provider's tracking data; the values of `arguments` are those of `providers.load_tracking`.

    Attributes:
        coordinates: kloppy's name of the provider's coordinates, "" if it is the provider's name.
        needs_metadata: whether there is always a second file; its name is also found without `renamed`.
        metadata_kinds: suffixes that the second file can have.
        find_files: the tracking file, its metadata, and notes to add to -> all files of the match.
        team_loader: kloppy's function for one CSV per team, "" if there is none.
        has_pitch_size: whether the files contain the pitch's size.
        has_own_roster: whether names are in a further file that nothing else depends on.
        number_in_tracking, number_in_metadata: from the beginning of a file to the match's number, None if not found.
        read_referees: reads the referees' samples, which kloppy ignores; None if the provider has none.
        read_samples: reads the files, where kloppy does not know them: feed, and the pitch's size where the user gives
            one -> `formats.samples.MatchSamples`.
    """

    arguments: Mapping[str, str] = field(default_factory=lambda: {"meta_data": "meta", "raw_data": "raw"})
    coordinates: str = ""
    needs_metadata: bool = True
    metadata_kinds: tuple[str, ...] = (".xml", ".json")
    find_files: Callable[[Path, Path | None, list[str]], Files] = lambda path, meta, notes: ((path,), (meta,))
    team_loader: str = ""
    has_pitch_size: bool = True
    has_own_roster: bool = False
    number_in_tracking: Callable[[bytes], str | None] | None = None
    number_in_metadata: Callable[[bytes], str | None] | None = None
    read_referees: Callable[[Feed], Samples] | None = None
    read_samples: Callable[[Feed, tuple[float, float] | None], Any] | None = None


@dataclass(frozen=True)
class Feed:
    """The files of one match.

    Attributes:
        provider: the provider.
        tracking: tracking files in time order; with one CSV per team the home team's first.
        meta: the metadata first, then further files; () without any.
        is_meta_chosen: whether the user named the metadata.
    """

    provider: TrackingProvider
    tracking: tuple[Path, ...]
    meta: tuple[Path, ...] = ()
    is_meta_chosen: bool = False

    @property
    def path(self) -> Path:
        """The first tracking file."""
        return self.tracking[0]

    @property
    def is_line_based(self) -> bool:
        """Whether a truncated tracking file still has whole lines."""
        return self.path.suffix.lower() in _LINE_SUFFIXES

    @property
    def has_team_files(self) -> bool:
        """Whether each team has its own tracking file."""
        return bool(self.provider.team_loader) and not self.meta


def read_head(path: Path) -> bytes:
    """Read the beginning of a file.

    Args:
        path: the file.
    Returns:
        Up to 8 kB, of UTF-16 as UTF-8; nothing for a folder.
    """
    from ...base.content import is_utf16

    if not path.is_file():
        return b""
    with open(path, "rb") as file:
        head = file.read(_HEAD_BYTES)
    if is_utf16(head):
        return head.decode("utf-16", "ignore").encode()
    return head.removeprefix(codecs.BOM_UTF8)


def is_track_csv(path: Path) -> bool:
    """Return whether a file is a table of one player's track: its first line names `time_s` and neither players nor
    joints.

    Raises:
        InputError: if it cannot be read.
    """
    try:
        first = read_head(path).partition(b"\n")[0]
    except OSError as error:
        raise build_read_error(path, "a tracking file", error) from None
    return b"time_s" in first and not re.search(_MANY, first)


Known = TypeVar("Known", bound=Provider)


def find_provider(path: Path, providers: Mapping[str, Known]) -> Known | None:
    """Find the provider whose format a file has.

    Args:
        path: the file.
        providers: name -> provider.
    Returns:
        The provider; None if no format matches.
    """
    head = read_head(path)
    return next((one for one in providers.values() if any(re.match(form, head) for form in one.patterns)), None)


def load_with_kloppy(path: Path, provider: str, loader: str, arguments: Mapping, expected: str, others: str):
    """Load a dataset with kloppy.

    Args:
        path: the file, for errors.
        provider: kloppy's module.
        loader: kloppy's function.
        arguments: its arguments.
        expected: what the file should be, for errors.
        others: the files that belong to it, for errors.
    Returns:
        kloppy's dataset.
    Raises:
        InputError: if kloppy is not installed or cannot read the files.
    """
    module = optional_packages.import_optional(f"kloppy.{provider}", path)
    try:
        with warnings.catch_warnings(), _silence_logging():
            warnings.simplefilter("ignore")
            return getattr(module, loader)(**arguments)
    except Exception as error:  # kloppy's parsers raise many kinds of errors
        is_plain = type(error).__module__.startswith("kloppy")  # others are of use to kloppy's developers only
        reason = _find_syntax_error(arguments.values()) or (str(error)[:120] if is_plain else "")
        found = f"not readable as {expected}" + (f" ({reason})" if reason else "")
        raise InputError(path, found, f"{expected}{others}", "check the files, and the provider") from None


@contextlib.contextmanager
def refuse_damage(path: Path, expected: str, others: Sequence[Path] = ()) -> Iterator[None]:
    """Context manager: values of another kind, which kloppy takes as they are, end in one line.

    Args:
        path: the file, for errors.
        expected: what it should be.
        others: the files that belong to it, in which the damage may be.
    Raises:
        InputError: where what is done with the values fails.
    """
    try:
        yield
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        where = f", in it or in {' or '.join(one.name for one in others)}" if others else ""
        step = "export them again" if others else "export it again"
        raise InputError(path, describe_damage(error) + where, expected, step) from None


@contextlib.contextmanager
def _silence_logging() -> Iterator[None]:
    """Context manager: nothing is logged, also not by the root logger; our own messages cover what kloppy logs."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _find_syntax_error(files: Iterable) -> str:
    """Find the first of some JSON and XML files that is damaged: its name, the line and what is wrong there; "" if all
    are well-formed.
    """
    for path in (Path(file) for file in files if isinstance(file, (str, os.PathLike)) and Path(file).is_file()):
        try:
            if path.suffix.lower() == ".json":
                json.loads(path.read_bytes())
            elif path.suffix.lower() == ".xml":
                _check_xml(path)
        except json.JSONDecodeError as error:
            return f"{path}:{error.lineno}: {error.msg.lower()} at column {error.colno}"
        except expat.ExpatError as error:
            return f"{path}:{error.lineno}: {expat.ErrorString(error.code)} at column {error.offset + 1}"
        except (ValueError, OSError, RecursionError, LookupError):  # the last: an encoding that does not exist
            return f"{path}: damaged"
    return ""


def _check_xml(path: Path) -> None:
    """Parse an XML file without building anything; ExpatError where it is not well-formed."""
    with open(path, "rb") as file:
        expat.ParserCreate().ParseFile(file)
