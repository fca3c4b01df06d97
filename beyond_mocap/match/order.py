"""What is asked of a match: plain values, and the digests by which work that was done already is found again: the same
content has the same name in every process and on every machine."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from pathlib import Path

import numpy as np

from .. import __version__
from ..base.errors import InputError, told_time
from ..base.settings import defaults
from ..files.event_providers import EVENT_PROVIDERS
from .pieces.units import OVERLAP, WINDOW

_DEFAULTS = defaults("match")
FORM = 3
"""Raised whenever the same order would give other results, so that kept ones are not taken for them."""

WINDOWS = (5.0, 600.0)
"""Seconds that a window has at least and at most."""

_LENGTH = 20  # bytes of a digest


@dataclass(frozen=True)
class MatchOrder:
    """One match to make.

    tracking, meta, events: the provider's files (None: looked for beside, none); provider: whose form, "" guessed.
    events_meta, events_provider: the same of the events.
    library, cache, skeleton, unit: as `library.build` has them. out: the folder of the results. start, end: seconds on
    the match's clock, None from its first to its last sample. players: ids, () everybody. annotations: folder with a
    text for players (ID.txt), instead of automatic words. window, overlap: seconds that a piece of the search has, and
    shares with the next. variety: as a plan has it. workers, scheduler: `pool.Workplace`. The settings table says what
    the other fields mean.
    InputError for numbers outside their limits, a span that ends before it begins, times that are no numbers, and
    what is said of events where there are none or of a provider whose events nobody reads."""

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
    annotations: Path | None = None
    bvh: bool = _DEFAULTS["bvh"]
    figures: bool = _DEFAULTS["figures"]
    window: float = WINDOW
    overlap: float = OVERLAP
    variety: float = 0.3
    workers: int = 1
    scheduler: str = ""
    events_meta: Path | None = None
    events_provider: str = ""

    def __post_init__(self):
        for option, value in (("--from", self.start), ("--to", self.end)):
            if value is not None and math.isnan(value):
                raise InputError(option, "nan", "seconds of the match's clock")
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise InputError("--to", f"{told_time(self.end)} s", f"later than --from {told_time(self.start)} s")
        if not WINDOWS[0] <= self.window <= WINDOWS[1]:
            raise InputError("window", f"{self.window:g} s", f"{WINDOWS[0]:g} to {WINDOWS[1]:g} s")
        if not 1.0 <= self.overlap <= self.window / 2.0:
            raise InputError("overlap", f"{self.overlap:g} s", f"1 s to half of the window, {self.window / 2.0:g} s")
        for option, value in (("--events-meta", self.events_meta), ("--events-provider", self.events_provider)):
            if value and self.events is None:
                raise InputError(option, f"{value}, without --events", "--events FILE too", "name the events")
        if self.events_provider and self.events_provider.lower() not in EVENT_PROVIDERS:
            raise InputError("--events-provider", f"{self.events_provider!r}", f"one of {', '.join(EVENT_PROVIDERS)}")

    def told(self) -> dict:
        """The order as plain values, for people."""
        return {name: value.as_posix() if isinstance(value, Path) else value for name, value in asdict(self).items()}


_RESULTS = ("provider", "start", "end", "players", "fps", "seed", "nearest", "solve_touches", "window", "overlap",
            "variety", "events_provider")
_FILES = ("tracking", "meta", "events", "events_meta")


def identity(order: MatchOrder, library_key: str) -> dict[str, object]:
    """What decides the results of an order, by name: settings, and the content of its files by their digests. The
    words' texts are not among them: they may be edited between runs. library_key: of the library's content and of the
    seed that it was read with (`Library.kept`), last, so that another seed is told as such. InputError for a file that
    cannot be read."""
    out: dict[str, object] = {"form": FORM, "software": __version__}
    out |= {name: getattr(order, name) for name in _RESULTS}
    for name in _FILES:
        path = getattr(order, name)
        try:
            out[name] = None if path is None else digest_of_file(path)
        except OSError as error:
            raise InputError(path, error.strerror or str(error), "a file that can be read", "check the path") from None
    out["library"] = library_key
    return out


def digest_of(*values: object) -> str:
    """Hex digits that stand for the content of `values`: plain values, arrays, and dataclasses, tuples and mappings of
    such, however deep. TypeError for anything else."""
    hashed = hashlib.blake2b(digest_size=_LENGTH)
    _feed(hashed, values)
    return hashed.hexdigest()


def digest_of_file(path: str | os.PathLike) -> str:
    """The same for the bytes of a file; OSError where it cannot be read."""
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=_LENGTH)).hexdigest()


def _feed(hashed, value: object) -> None:
    """Every value begins with its kind and ends its text with a zero, so that no two contents give the same bytes."""
    if isinstance(value, np.ndarray):
        hashed.update(f"array {value.dtype.str} {value.shape}\0".encode())
        hashed.update(np.ascontiguousarray(value).tobytes())
    elif value is None or isinstance(value, (bool, int, float, str, bytes, np.generic)):
        value = value.item() if isinstance(value, np.generic) else value
        hashed.update(f"{type(value).__name__} {value!r}\0".encode())
    elif isinstance(value, Path):
        hashed.update(f"path {value.as_posix()}\0".encode())
    else:
        _feed_parts(hashed, value)


def _feed_parts(hashed, value: object) -> None:
    if is_dataclass(value) and not isinstance(value, type):
        parts = [(field.name, getattr(value, field.name)) for field in fields(value)]
        kind = type(value).__name__
    elif isinstance(value, Mapping):
        parts, kind = sorted(value.items()), "mapping"
    elif isinstance(value, (set, frozenset)):
        parts, kind = sorted(value), "set"
    elif isinstance(value, (tuple, list)):
        parts, kind = value, "row"
    else:
        raise TypeError(f"{type(value).__name__} has no content that could be told")
    hashed.update(f"{kind} {len(parts)}\0".encode())
    for part in parts:
        _feed(hashed, part)
