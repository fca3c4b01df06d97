"""The providers of event data, one record each, and readers for tables that kloppy does not support.

These are the project's own table (columns in docs/reference/match-input.md) and Metrica's. The second file of a
provider's events is found here too.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.errors import InputError, build_read_error
from . import event_data, tables
from .provider_texts import EVENTS
from .tracking import match_arrays
from .tracking.feed import Provider, find_provider, load_with_kloppy, read_head

if TYPE_CHECKING:
    from ..motion.track.match_data import Match

_TABLE_KINDS = {  # event types of plain tables -> kind
    "miss": "shot", "goal": "shot", "post": "shot", "saved shot": "shot", "cross": "pass", "blocked pass": "deflection",
    "takeon": "take-on", "ball touch": "touch", "recovery": "touch", "challenge": "tackle", "dispossessed": "touch",
    "ball lost": "touch", "ball out": "out", "set piece": "other", "fault received": "foul", "card": "other",
    "header": "pass", "reception": "receive", "throw-in": "pass", "kick": "pass",
}  # fmt: skip
_WAY_OUT = "choose the provider, or write a CSV with time_s,type,player"
_METRICA_SUBTYPES = {"clearance": "clearance", "aerial": "aerial"}
_HEAD = {"header", "head"}


@dataclass(frozen=True, kw_only=True)
class EventProvider(Provider):
    """A provider of event data.

    Attributes:
        arguments: kloppy's names for "events" (the file) and "meta" (the second file); empty if kloppy reads nothing.
        second_pattern: pattern of the second file's beginning; empty if there is no second file.
        read_table: reads a CSV, which has no second file; None if kloppy reads all files.
        has_foot_side: whether the data has left and right feet; without them kloppy says "right" for both.
    """

    second_pattern: bytes = b""
    read_table: Callable | None = None
    has_foot_side: bool = True

    def has_table(self, path: Path) -> bool:
        """Return whether a file of this provider is one for `read_table`.

        Args:
            path: the file.
        """
        return self.read_table is not None and (not self.arguments or path.suffix.lower() == ".csv")


def detect_event_provider(path: Path) -> EventProvider:
    """Detect the provider of a file from its content.

    Args:
        path: the file.
    Returns:
        The provider.
    Raises:
        InputError: if no provider's form fits.
    """
    found = find_provider(path, EVENT_PROVIDERS)
    if found is None:
        problem = "unknown format" if read_head(path).strip() else "the file is empty"
        titles = ", ".join(one.title for one in EVENT_PROVIDERS.values())
        raise InputError(path, problem, f"events of one of {titles}", _WAY_OUT)
    return found


def find_second_file(path: Path, provider: EventProvider, meta: str | os.PathLike | None) -> Path | None:
    """Find the lineups or metadata that a file of events needs.

    Args:
        path: the file of events.
        provider: its provider.
        meta: the second file; None searches beside `path` for a matching name, then for matching content.
    Returns:
        The second file; None if none is needed.
    Raises:
        InputError: if it is missing.
    """
    if not provider.second_pattern or provider.has_table(path):
        return None
    if meta is not None:
        if not Path(meta).is_file():
            raise build_read_error(meta, "lineups or metadata of the events")
        return Path(meta)
    names = [re.sub(re.escape(old), new, path.name, flags=re.IGNORECASE) for old, new in provider.renamed]
    folders = [path.parent, path.parent.parent / "lineups"]
    names = [name for one in names for name in (one, str(Path(one).with_suffix(".xml")))] + [path.name]
    for candidate in (folder / name for folder in folders for name in names):
        if candidate.is_file() and candidate != path:
            return candidate
    matching = [one for one in sorted(path.parent.glob("*.[xj]*")) if one != path
                and re.match(provider.second_pattern, read_head(one))]  # fmt: skip
    if len(matching) == 1:
        return matching[0]
    expected = f"a file such as {names[0]}" if names[0] != path.name else "the provider's lineups or metadata"
    raise InputError(path, f"the second file of {provider.title} is missing", expected, "add it, or choose it")


def load_events(path: Path, provider: EventProvider, meta: Path | None):
    """Load events with kloppy, in the provider's own coordinates.

    Args:
        path: the file of events.
        provider: its provider.
        meta: the second file, or None.
    Returns:
        kloppy's dataset.
    Raises:
        InputError: if kloppy is not installed or cannot read the files.
    """
    files = {"events": str(path), "meta": str(meta)}
    arguments = {key: files[name] for key, name in provider.arguments.items()}
    others = f" and their {meta.name}" if meta else ""
    return load_with_kloppy(path, provider.name, provider.loader, arguments=arguments,
                            expected=f"events of {provider.title}", others=others)


def find_pitch_size(match: Match | None) -> tuple[float, float]:
    """Return the size of the tracking's pitch, or of a usual one.

    Args:
        match: the tracked match, or None.
    Returns:
        Length and width, m.
    """
    return (match.length, match.width) if match else match_arrays.USUAL_PITCH


def read_plain_events(path: Path, match: Match | None):
    """Read a table time_s,type,player[,detail,success,x,y,period,part,side].

    Times are seconds of the match's clock, or of the period's if there is a column `period`.

    Args:
        path: the file.
        match: the tracked match, or None.
    Returns:
        (event, player or None) of each row.
    Raises:
        InputError: with the line, if a cell is invalid.
    """
    from ..annotation.event_labels import KINDS
    from ..annotation.striking import BODY_PARTS

    rows = []
    for place, row in tables.read_rows(path, ("time_s", "type", "player")):
        time, period = tables.parse_number(row["time_s"], "time_s", place), 1
        if row.get("period"):
            period = int(tables.parse_number(row["period"], "period", place))
        elif match is not None:
            half = max((half for half in match.halves if time >= half.start - 5.0), key=lambda half: half.start,
                       default=match.halves[0])  # fmt: skip
            time, period = time - half.clock_zero, half.number
        event_type, detail = row["type"].lower(), row.get("detail", "").lower()
        kind = event_type if event_type in KINDS else _TABLE_KINDS.get(event_type, "other")
        words = detail.replace("/", " ").replace("_", " ")
        part = row.get("part", "").lower() or _find_part(words, event_type)
        if part and part not in BODY_PARTS:
            raise InputError(place, f"part {part!r}", f"one of {', '.join(BODY_PARTS)}, or blank")
        sides = f"{row.get('side', '')} {words}".split() if part == "foot" else ()
        side = next((one for one in ("left", "right") if one in sides), "")
        details = ("throw-in",) if "throw in" in f"{event_type} {words}".replace("-", " ") else ()
        xy = tuple(tables.parse_number(row.get(name, ""), name, place, blank=True) for name in ("x", "y"))
        success = {"true": True, "1": True, "false": False, "0": False}.get(row.get("success", "").lower())
        event = event_data.MatchEvent(time=time, period=period, player="", team="", kind=kind, side=side,
                                      part="hand" if details else part, details=details, original_text=event_type,
                                      success=success, place=xy)
        rows.append((event, event_data.EventPlayer.from_text(row["player"]) if row["player"] else None))
    return rows


def _find_part(words: str, event_type: str) -> str:
    """Find the body part that a detail names."""
    if _HEAD & {*words.split(), event_type}:
        return "head"
    return "foot" if "foot" in words else ""


def read_metrica_events(path: Path, match: Match | None):
    """Read Metrica's own table of events, which kloppy does not support.

    Args:
        path: the file.
        match: the tracked match, or None.
    Returns:
        (event, player or None) of each row.
    Raises:
        InputError: with the line, if a cell is invalid.
    """
    from ..annotation.event_labels import KINDS

    rows = []
    needed = ("Team", "Type", "Subtype", "Period", "Start Time [s]", "From", "Start X", "Start Y")
    length, width = find_pitch_size(match)
    period_starts: dict[int, float] = {}
    for place, row in tables.read_rows(path, needed):
        period = int(tables.parse_number(row["Period"], "Period", place))
        time = tables.parse_number(row["Start Time [s]"], "Start Time [s]", place)
        time -= period_starts.setdefault(period, 0.0 if period == 1 else time)
        event_type = f"{row['Type']} {row['Subtype']}".strip().lower()
        type_name = (row["Type"].lower(), "other")[row["Type"].lower() not in (*KINDS, *_TABLE_KINDS)]
        kind = next((kind for word, kind in _METRICA_SUBTYPES.items() if word in event_type),
                    _TABLE_KINDS.get(type_name, type_name))
        part = "head" if "head" in event_type else "hand" if "throw in" in event_type else ""
        details = ("throw-in",) * (part == "hand") + ("lost",) * (kind == "aerial" and "lost" in event_type)
        x, y = (tables.parse_number(row[name], name, place, blank=True) for name in ("Start X", "Start Y"))
        team = row["Team"].lower() if row["Team"].lower() in ("home", "away") else ""
        event = event_data.MatchEvent(time=time, period=period, player="", team=team, kind=kind, part=part, side="",
                                      details=details, original_text=event_type, success=None,
                                      place=((x - 0.5) * length, (0.5 - y) * width))
        rows.append((event, event_data.EventPlayer.from_text(row["From"], team) if row["From"] else None))
    return rows


_XML = rb"(?s)\s*(<\?xml[^>]*>\s*)?"
_ALONE, _WITH_METADATA = {"event_data": "events"}, {"event_data": "events", "meta_data": "meta"}
_WITH_LINEUPS = {"event_data": "events", "lineup_data": "meta"}
_LINEUPS = (("events", "lineups"), ("event", "lineup"))

EVENT_PROVIDERS: dict[str, EventProvider] = {record.name: record for record in (
    EventProvider(
        **EVENTS["opta"], renamed=(("f24", "f7"), ("F24", "F7"), ("f73", "f7")),
        patterns=(_XML + rb"(<!--.{0,400}?-->\s*)?<Games\b",), second_pattern=_XML + rb"<SoccerFeed\b",
        arguments={"f24_data": "events", "f7_data": "meta"},
    ),
    EventProvider(
        **EVENTS["sportec"], patterns=(_XML + rb"<PutDataRequest\b.{0,2000}<Event\b",),
        second_pattern=_XML + rb"<PutDataRequest\b.{0,900}<MatchInf", loader="load_event", arguments=_WITH_METADATA,
        renamed=(("events", "meta"), ("events_raw", "matchinformation")),
    ),
    EventProvider(
        **EVENTS["statsbomb"], renamed=_LINEUPS,
        patterns=(rb'(?s)\s*\[\s*\{.{0,600}"possession"',), second_pattern=rb'(?s)\s*\[\s*\{.{0,300}"lineup"',
        arguments=_WITH_LINEUPS,
    ),
    EventProvider(
        **EVENTS["metrica"], patterns=(rb"Team,Type,Subtype,Period", rb'(?s)\s*\{\s*"data"\s*:\s*\[.{0,600}"subtypes"'),
        second_pattern=_XML + rb"<main\b.{0,900}<Metadata\b", loader="load_event", arguments=_WITH_METADATA,
        renamed=(("events", "metadata"), ("events.json", "metadata.xml")), read_table=read_metrica_events,
    ),
    EventProvider(
        **EVENTS["wyscout"], arguments=_ALONE,
        patterns=(rb'(?s)\s*\{.{0,4000}("eventSec"|"matchTimestamp")',),
    ),
    EventProvider(
        **EVENTS["datafactory"], arguments=_ALONE,
        patterns=(rb'(?s)\s*\{\s*"match"\s*:\s*\{.{0,600}"homeTeamId"',),
    ),
    EventProvider(
        **EVENTS["statsperform"], renamed=(("ma3", "ma1"), ("MA3", "MA1")),
        patterns=(_XML + rb"<matchEvents\b", rb'(?s)\s*\{\s*"matchInfo"'),
        second_pattern=_XML + rb'(<match\b|\{.{0,9000}"(lineUp|liveData)")', loader="load_event",
        arguments={"ma3_data": "events", "ma1_data": "meta"},
    ),
    EventProvider(
        **EVENTS["impect"], renamed=_LINEUPS, arguments=_WITH_LINEUPS,
        patterns=(rb'(?s)\s*\[\s*\{.{0,400}"gameTimeInSec"',), second_pattern=rb'(?s)\s*\{.{0,900}"squadHome"',
        has_foot_side=False,
    ),
    EventProvider(
        **EVENTS["csv"], patterns=(rb"[^\r\n{<\[]{0,400}time_s",), read_table=read_plain_events,
    ),
)}  # fmt: skip
