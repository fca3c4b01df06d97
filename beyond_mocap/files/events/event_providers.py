"""The providers of events, one record each, and the second file that goes with a file of events."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...base.errors import InputError
from ..tracking.feed import Provider, find_provider, load_through_kloppy, read_head
from .event_tables import read_metrica_events, read_plain_events


@dataclass(frozen=True, kw_only=True)
class EventProvider(Provider):
    """What is known of a provider's events.

    Args:
        arguments: kloppy's names for "events", the file, and "meta", the second one; none where kloppy reads nothing.
        second: what the second file begins with; empty where there is no second file.
        read_table: reads a CSV, which has no second file; None where kloppy reads all.
        tells_foot: whether it tells left feet from right ones; where not, kloppy says "right" for either.
    """

    second: bytes = b""
    read_table: Callable | None = None
    tells_foot: bool = True

    def has_table(self, path: Path) -> bool:
        """Whether a file of this provider is one for `read_table`."""
        return self.read_table is not None and (not self.arguments or path.suffix.lower() == ".csv")


def guessed_event_provider(path: Path) -> EventProvider:
    """Whose form a file has; InputError where it is none that is known."""
    found = find_provider(path, EVENT_PROVIDERS)
    if found is None:
        what = "a form that is not known" if read_head(path).strip() else "an empty file"
        raise InputError(path, what, f"events of one of {', '.join(EVENT_PROVIDERS)}", "name the provider")
    return found


def other_file(path: Path, provider: EventProvider, meta: str | os.PathLike | None) -> Path | None:
    """The lineups or metadata that an events file needs: `meta`, else the one beside it whose name, or else whose
    form fits; None where it needs none. InputError where there is none."""
    if not provider.second or provider.has_table(path):
        return None
    if meta is not None:
        if not Path(meta).is_file():
            raise InputError(meta, "no such file", "lineups or metadata of the events", "check the path")
        return Path(meta)
    names = [re.sub(re.escape(ours), theirs, path.name, flags=re.IGNORECASE) for ours, theirs in provider.renamed]
    folders = [path.parent, path.parent.parent / "lineups"]
    names = [name for one in names for name in (one, str(Path(one).with_suffix(".xml")))] + [path.name]
    for beside in (folder / name for folder in folders for name in names):
        if beside.is_file() and beside != path:
            return beside
    fitting = [one for one in sorted(path.parent.glob("*.[xj]*")) if one != path
               and re.match(provider.second, read_head(one))]  # fmt: skip
    if len(fitting) == 1:
        return fitting[0]
    expected = f"one as {names[0]}" if names[0] != path.name else "the provider's lineups or metadata"
    raise InputError(path, f"no second file beside it for {provider.name}", expected, "put it there, or name it")


def load_events(path: Path, provider: EventProvider, meta: Path | None):
    """kloppy's dataset in the provider's own coordinates. InputError where kloppy is not installed or cannot read the
    files."""
    known = {"events": str(path), "meta": str(meta)}
    arguments = {key: known[name] for key, name in provider.arguments.items()}
    others = f" and their {meta.name}" if meta else ""
    return load_through_kloppy(path, provider.name, provider.loader, arguments, f"{provider.name} events", others)


_XML = rb"(?s)\s*(<\?xml[^>]*>\s*)?"
_ALONE, _WITH_METADATA = {"event_data": "events"}, {"event_data": "events", "meta_data": "meta"}
_WITH_LINEUPS = {"event_data": "events", "lineup_data": "meta"}
_LINEUPS = (("events", "lineups"), ("event", "lineup"))

# in the order of the choices that saved scenes number: a new one goes to the end
EVENT_PROVIDERS: dict[str, EventProvider] = {record.name: record for record in (
    EventProvider(
        name="opta", title="Opta", files="F24 or F73 with F7", renamed=(("f24", "f7"), ("F24", "F7"), ("f73", "f7")),
        patterns=(_XML + rb"(<!--.{0,400}?-->\s*)?<Games\b",), second=_XML + rb"<SoccerFeed\b",
        arguments={"f24_data": "events", "f7_data": "meta"},
    ),
    EventProvider(
        name="sportec", title="Sportec (DFL)", files="events with the tracking's metadata",
        patterns=(_XML + rb"<PutDataRequest\b.{0,2000}<Event\b",),
        second=_XML + rb"<PutDataRequest\b.{0,900}<MatchInf", loader="load_event", arguments=_WITH_METADATA,
        renamed=(("events", "meta"), ("events_raw", "matchinformation")),
    ),
    EventProvider(
        name="statsbomb", title="StatsBomb", files="events with their lineups", renamed=_LINEUPS,
        patterns=(rb'(?s)\s*\[\s*\{.{0,600}"possession"',), second=rb'(?s)\s*\[\s*\{.{0,300}"lineup"',
        arguments=_WITH_LINEUPS,
    ),
    EventProvider(
        name="metrica", title="Metrica", files="events with the tracking's metadata; CSV alone",
        patterns=(rb"Team,Type,Subtype,Period", rb'(?s)\s*\{\s*"data"\s*:\s*\[.{0,600}"subtypes"'),
        second=_XML + rb"<main\b.{0,900}<Metadata\b", loader="load_event", arguments=_WITH_METADATA,
        renamed=(("events", "metadata"), ("events.json", "metadata.xml")), read_table=read_metrica_events,
    ),
    EventProvider(
        name="wyscout", title="Wyscout", files="alone (2 and 3)", arguments=_ALONE,
        patterns=(rb'(?s)\s*\{.{0,4000}("eventSec"|"matchTimestamp")',),
    ),
    EventProvider(
        name="datafactory", title="DataFactory", files="alone", arguments=_ALONE,
        patterns=(rb'(?s)\s*\{\s*"match"\s*:\s*\{.{0,600}"homeTeamId"',),
    ),
    EventProvider(
        name="statsperform", title="Stats Perform", files="MA3 with MA1", renamed=(("ma3", "ma1"), ("MA3", "MA1")),
        patterns=(_XML + rb"<matchEvents\b", rb'(?s)\s*\{\s*"matchInfo"'),
        second=_XML + rb'(<match\b|\{.{0,9000}"(lineUp|liveData)")', loader="load_event",
        arguments={"ma3_data": "events", "ma1_data": "meta"},
    ),
    EventProvider(
        name="impect", title="Impect", files="events with their lineups", renamed=_LINEUPS, arguments=_WITH_LINEUPS,
        patterns=(rb'(?s)\s*\[\s*\{.{0,400}"gameTimeInSec"',), second=rb'(?s)\s*\{.{0,900}"squadHome"',
        tells_foot=False,
    ),
    EventProvider(
        name="csv", title="CSV",
        files="`time_s,type,player[,detail,success,x,y,period,part,side]`, seconds of the match, or of the period "
              "where a column names it",
        patterns=(rb"[^\r\n{<\[]{0,400}time_s",), read_table=read_plain_events,
    ),
)}  # fmt: skip
