"""What is asked of a match: plain values, and the digest by which results of the same order are known again."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path

from .. import __version__
from ..base.errors import InputError, told_time
from ..base.settings import defaults
from ..files.event_providers import EVENT_PROVIDERS
from .pieces.content_digest import digest_of_file
from .pieces.units import OVERLAP, WINDOW

_DEFAULTS = defaults("match")
FORM = 3
"""Raised whenever the same order would give other results, so that kept ones are not taken for them."""

WINDOWS = (5.0, 600.0)
"""Seconds that a window has at least and at most."""


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
    what is said of events where there are none or of a provider whose events nobody reads.
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
        self._check_events()

    def _check_events(self) -> None:
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


