"""Events of a match in: providers' files through kloppy, and plain tables, with the tracking's players."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...motion.track.match_data import Match
from ..tracking.match_repairs import home_end
from .event_data import MatchEvent, MatchEvents
from .event_kinds import kind_of
from .event_players import Who, same_players
from .event_providers import EVENT_PROVIDERS, EventProvider, guessed_event_provider, load_events, other_file
from .event_tables import pitch_size

_LEAST_KNOWN = 0.5  # share of the events' players who must be in the tracking

def read_events(
    path: str | os.PathLike,
    meta: str | os.PathLike | None = None,
    provider: str | None = None,
    match: Match | None = None,
) -> MatchEvents:
    """A provider's events, with the players of a tracked match.

    meta: lineups or metadata where the provider has them in a second file (Opta's F7, StatsBomb's lineups, the metadata
    of Metrica and Sportec, Stats Perform's MA1); where None, one beside `path` whose name fits. provider: one of
    `event_providers.EVENT_PROVIDERS`; where None, guessed from the content. match: whose ids the players get and on
    whose pitch the places are; without one they keep their own. InputError where files are missing or not of that form,
    and where most players are not in the match: the events are of another one.
    """
    if not Path(path).is_file():
        found = "is a folder" if Path(path).is_dir() else "no such file"
        raise InputError(path, found, "a file of events", "check the path")
    path, name = Path(path), (provider or "").lower()
    if name and name not in EVENT_PROVIDERS:
        raise InputError("provider", f"{name!r}", f"one of {', '.join(EVENT_PROVIDERS)} for events")
    record = EVENT_PROVIDERS[name] if name else guessed_event_provider(path)
    second = other_file(path, record, meta)
    if record.has_table(path):
        rows = record.read_table(path, match)
    else:
        rows = _through_kloppy(path, record, second, match)
    if not rows:
        raise InputError(path, "no events", "some", "export it again")
    events, notes = _with_players(path, rows, match)
    told = [f"{second.name} taken as its second file"] if second and meta is None else []
    told += [f"{meta}: not used, since events of {record.name} are in one file"] if meta and not second else []
    return MatchEvents(tuple(events), record.name, str(path), tuple([*told, *notes]))


def _with_players(path: Path, rows: list[tuple[MatchEvent, Who | None]], match: Match | None):
    """The events with the tracking's ids, by period and time, and notes."""
    everybody = list(dict.fromkeys(who for _, who in rows if who is not None))
    known, notes = same_players(everybody, match)
    few = match is not None and len(known) < _LEAST_KNOWN * len(everybody)
    if few and all(who.number < 0 and not who.name for who in everybody):  # nothing says that it is another match
        ids = ", ".join([who.id for who in everybody if who not in known][:3])
        notes = [
            f"{path.name}: {len(everybody) - len(known)} of {len(everybody)} players cannot be assigned, for these "
            f"events have neither shirt numbers nor names, and the tracking has other ids than theirs ({ids} ...): "
            "what they do is left out"
        ]
    elif few:
        lost = ", ".join(who.said for who in everybody if who not in known)
        found = f"{len(everybody) - len(known)} of {len(everybody)} players ({lost[:80]}) are not in the tracking"
        raise InputError(path, found, "events of the same match, with ids, numbers or names", "check both files")
    out = []
    for event, who in rows:
        own = (who.id if who and not match else "", event.team)
        player, team = known.get(who, own)
        out.append(MatchEvent(**{**vars(event), "player": player, "team": team}))
    return sorted(out, key=lambda event: (event.period, event.time)), notes


def _through_kloppy(path: Path, provider: EventProvider, second: Path | None, match: Match | None):
    dataset = load_events(path, provider, second)
    place = _placing(dataset, match)
    rows = []
    for record in dataset.records:
        kind, part, side, details, success = kind_of(record, provider.tells_foot)
        team = str(record.team.ground) if record.team else ""
        event = MatchEvent(
            record.timestamp.total_seconds(), int(record.period.id), "", team, kind, part, side, details,
            str(record.event_name), success, place(record, team),
        )
        rows.append((event, _who(record)))
    return rows


def _who(record) -> Who | None:
    player = record.player
    if player is None:
        raw = record.raw_event.get("from") if isinstance(record.raw_event, dict) else None  # Metrica's, of whom its
        name = raw.get("name") if isinstance(raw, dict) else None  # metadata knows nothing
        return Who.spelled(str(name), str(record.team.ground) if record.team else "") if name else None
    shirt = -1 if player.jersey_no is None else int(player.jersey_no)
    return Who(str(player.player_id), str(player.team.ground), shirt, player.name or "")


def _placing(dataset, match: Match | None):
    """The map from one of kloppy's records and its team to (x, y) m on the tracking's pitch."""
    system = dataset.metadata.coordinate_system
    size, length, width = system.pitch_dimensions, *pitch_size(match)
    down = system.vertical_orientation.name == "TOP_TO_BOTTOM"
    by_team = dataset.metadata.orientation.name == "ACTION_EXECUTING_TEAM"
    ends = _ends(match)

    def place(record, team: str) -> tuple[float, float]:
        point = record.coordinates
        if point is None or size.x_dim.max is None or size.y_dim.max is None or point.x is None or point.y is None:
            return np.nan, np.nan
        x = ((point.x - size.x_dim.min) / (size.x_dim.max - size.x_dim.min) - 0.5) * length
        y = ((point.y - size.y_dim.min) / (size.y_dim.max - size.y_dim.min) - 0.5) * width * (-1.0 if down else 1.0)
        end = ends.get(int(record.period.id) if by_team else 1, -1.0)
        turn = -end if team != "away" or not by_team else end
        return float(turn * x), float(turn * y)

    return place


def _ends(match: Match | None) -> dict[int, float]:
    """Period -> the end that the home team keeps there, -1 or 1; those where it cannot be told are left out."""
    if match is None:
        return {}
    teams = np.array([player.team for player in match.players])
    found = {}
    for half in match.halves:
        part = slice(*np.searchsorted(match.times, [half.start - 1e-6, half.end + 1e-6]))
        found[half.number] = home_end(match.positions[:, part], teams)
    return {number: end for number, end in found.items() if end}
