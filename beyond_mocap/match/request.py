"""What is requested of a match, as plain values, and the digests by which finished work is found again: the same
content has the same digest in every process and on every machine.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..appearance.sports import find_assumed_pitch
from ..base.errors import InputError, build_read_error, format_seconds
from ..base.settings import collect_defaults
from ..base.settings.match import OVERLAP, WINDOW
from ..files.event_providers import EVENT_PROVIDERS
from ..files.joints.joint_readers import is_joint_file, list_joint_files

_DEFAULTS = collect_defaults("match")
FORM = 5
"""Raised whenever the same request would give other results, so that stored ones are not used for it."""

WINDOW_LIMITS = (5.0, 600.0)
"""s: shortest and longest window."""

_LENGTH = 20  # bytes of a digest


@dataclass(frozen=True)
class MatchRequest:
    """One match to synthesize. The settings table describes the fields that are not listed here.

    Attributes:
        tracking: the provider's tracking file.
        meta: its metadata; None: searched beside it, or none.
        joints: skeletal tracking of the same match; None: none, or `tracking` itself.
        events: the events file; None: no events.
        provider: the form of the files; "": detected.
        events_meta: metadata of the events.
        events_provider: the form of the events; "": detected.
        library: as for `library.build`.
        cache: as for `library.build`.
        skeleton: as for `library.build`.
        unit: as for `library.build`.
        out: folder of the results.
        start: s on the match's clock; None: its first sample.
        end: s on the match's clock; None: its last sample.
        players: ids; (): all players.
        annotations: folder with a text per player (ID.txt), used instead of automatic labels.
        window: s of a piece of the search.
        overlap: s that neighbouring pieces share.
        variety: as in a plan.
        workers: as for `pool.WorkerConfig`.
        scheduler: as for `pool.WorkerConfig`.
        pitch: length and width, m, for tracking data without them; None: the sport's regular size.
    Raises:
        InputError: for numbers outside their limits, a span that ends before it starts, times that are NaN, event
            settings without events, or an unknown provider of events.
    """

    tracking: Path
    library: Path
    out: Path
    meta: Path | None = None
    events: Path | None = None
    provider: str = ""
    cache: Path | None = None
    skeleton: Path | None = None
    unit: float | None = None
    start: float | None = None
    end: float | None = None
    players: tuple[str, ...] = ()
    fps: float = _DEFAULTS["fps"]
    seed: int = _DEFAULTS["seed"]
    nearest: bool = _DEFAULTS["nearest"]
    solve_touches: bool = _DEFAULTS["solve_touches"]
    watch: float = _DEFAULTS["watch"]
    strength: float = _DEFAULTS["strength"]
    masses: str = _DEFAULTS["masses"]
    fatigue: float = _DEFAULTS["fatigue"]
    annotations: Path | None = None
    bvh: bool = _DEFAULTS["bvh"]
    figures: bool = _DEFAULTS["figures"]
    window: float = WINDOW
    overlap: float = OVERLAP
    variety: float = 0.6
    workers: int = 1
    scheduler: str = ""
    events_meta: Path | None = None
    events_provider: str = ""
    sport: str = collect_defaults("pitch")["sport"]
    pitch: tuple[float, float] | None = None
    joints: Path | None = None

    def __post_init__(self):
        for option, value in (("start time", self.start), ("end time", self.end)):
            if value is not None and math.isnan(value):
                raise InputError(option, "not a number", "seconds of the match's clock")
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise InputError("end time", f"{format_seconds(self.end)} s",
                             f"later than the start, {format_seconds(self.start)} s", "choose a later end")
        if not WINDOW_LIMITS[0] <= self.window <= WINDOW_LIMITS[1]:
            raise InputError("window", f"{self.window:g} s", f"{WINDOW_LIMITS[0]:g} to {WINDOW_LIMITS[1]:g} s")
        if not 1.0 <= self.overlap <= self.window / 2.0:
            raise InputError("overlap", f"{self.overlap:g} s", f"1 s to half of the window, {self.window / 2.0:g} s")
        for option, value in (("events metadata", self.events_meta), ("events provider", self.events_provider)):
            if value and self.events is None:
                raise InputError(option, f"{value}, without an events file", "an events file", "choose the events file")
        if self.events_provider and self.events_provider.lower() not in EVENT_PROVIDERS:
            raise InputError("events provider", f"{self.events_provider!r}", f"one of {', '.join(EVENT_PROVIDERS)}",
                             "write others as CSV with time_s,type,player")

    def find_pitch(self) -> tuple[float, float] | None:
        """Find the pitch's size, m, for tracking data without it; None: what readers assume of a football pitch."""
        return self.pitch or find_assumed_pitch(self.sport)

    def find_joint_file(self) -> Path | None:
        """Find the skeletal tracking: the file of joints, or the tracking itself where that is skeletal.

        Raises:
            InputError: if both are skeletal, or there is no such file.
        """
        is_skeletal = not self.provider and is_joint_file(self.tracking)
        if self.joints is not None and not self.joints.is_file():
            raise build_read_error(self.joints, "a file of skeletal tracking")
        if is_skeletal and self.joints is not None:
            raise InputError(self.tracking, "skeletal tracking, beside which no joints can be given",
                             f"positions of the players for the joints in {self.joints.name}",
                             "leave the joints out: the tracking has its own" if is_joint_file(self.joints)
                             else "exchange tracking and joints")
        return self.tracking if is_skeletal else self.joints

    def to_plain(self) -> dict:
        """Convert the request to plain values, for match.json."""
        return {name: value.as_posix() if isinstance(value, Path) else value for name, value in asdict(self).items()}


_RESULTS = ("provider", "start", "end", "players", "fps", "seed", "nearest", "solve_touches", "watch", "strength",
            "masses", "fatigue", "window", "overlap", "variety", "events_provider", "sport", "pitch")
_FILES = ("tracking", "meta", "events", "events_meta")


def build_identity(request: MatchRequest, library_key: str) -> dict[str, object]:
    """Build what determines the results of a request, by name: settings, and digests of the content of its files.

    The label texts are not part of it: they may be edited between runs.

    Args:
        request: the request.
        library_key: of the library's content and the seed it was read with (`Library.kept`); last, so that another seed
            is reported as such.
    Returns:
        Values by name.
    Raises:
        InputError: if a file cannot be read.
    """
    out: dict[str, object] = {"form": FORM, "software": __version__}
    out |= {name: getattr(request, name) for name in _RESULTS}
    for name in _FILES:
        path = getattr(request, name)
        out[name] = None if path is None else _compute_input_digest(path)
    if (joints := request.find_joint_file()) is not None:
        files = list_joint_files(joints, with_ball=request.joints is None)
        out["joints"] = [_compute_input_digest(path) for path in files]
    out["library"] = library_key
    return out


def _compute_input_digest(path: Path) -> str:
    """Compute the digest of a file of the match; InputError if it cannot be read."""
    try:
        return compute_file_digest(path)
    except OSError as error:
        raise build_read_error(path, "a file of the match", error) from None


def compute_digest(*values: object) -> str:
    """Compute hex digits for the content of `values`.

    Args:
        values: plain values, arrays, and dataclasses, tuples and mappings of them, at any depth.
    Returns:
        The digest.
    Raises:
        TypeError: for anything else.
    """
    hashed = hashlib.blake2b(digest_size=_LENGTH)
    _add_to_hash(hashed, values)
    return hashed.hexdigest()


def compute_file_digest(path: str | os.PathLike) -> str:
    """Compute the digest of a file's bytes; OSError if it cannot be read."""
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=_LENGTH)).hexdigest()


def _add_to_hash(hashed, value: object) -> None:
    """Add a value to a hash. It starts with its kind and ends with a zero, so that different contents give different
    bytes.
    """
    kind = type(value)
    if kind in _PLAIN:  # nearly all of them
        hashed.update(f"{kind.__name__} {value!r}\0".encode())
    elif isinstance(value, np.ndarray):
        hashed.update(f"array {value.dtype.str} {value.shape}\0".encode())
        hashed.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, (int, float, str, bytes, np.generic)):
        value = value.item() if isinstance(value, np.generic) else value
        hashed.update(f"{type(value).__name__} {value!r}\0".encode())
    elif isinstance(value, Path):
        hashed.update(f"path {value.as_posix()}\0".encode())
    else:
        _add_parts_to_hash(hashed, value)


_PLAIN = frozenset((type(None), bool, int, float, str, bytes))


@lru_cache
def _list_fields(kind: type) -> tuple[tuple[str, bytes, bool], ...]:
    """List the fields of a dataclass: name, what the hash gets before the content, and whether it is a part that was
    added later (`LATER_PART`).
    """
    return tuple((field.name, f"row 2\0str {field.name!r}\0".encode(), bool(field.metadata.get("is_part")))
                 for field in fields(kind))


def _add_parts_to_hash(hashed, value: object) -> None:
    parts: Sequence
    if isinstance(value, (tuple, list)):
        parts, kind = value, "row"
    elif is_dataclass(value) and not isinstance(value, type):
        return _add_fields_to_hash(hashed, value)
    elif isinstance(value, Mapping):
        parts, kind = sorted(value.items()), "mapping"
    elif isinstance(value, (set, frozenset)):
        parts, kind = sorted(value), "set"
    else:
        raise TypeError(f"{type(value).__name__} has no content to hash")
    hashed.update(f"{kind} {len(parts)}\0".encode())
    for part in parts:
        _add_to_hash(hashed, part)


def _add_fields_to_hash(hashed, value: Any) -> None:
    """Add a dataclass: rows of a field's name and its content."""
    kind: type = type(value)
    rows = [(begin, getattr(value, name), is_later) for name, begin, is_later in _list_fields(kind)]
    parts = [(begin, content) for begin, content, is_later in rows if not is_later or content]
    hashed.update(f"{kind.__name__} {len(parts)}\0".encode())
    for begin, content in parts:
        hashed.update(begin)
        _add_to_hash(hashed, content)
