"""Events of a match in: providers' files through kloppy, and plain tables, with the tracking's players."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ..annotation.event_words import KINDS
from ..errors import InputError
from ..motion.striking import BODY_PARTS
from .event_data import MatchEvent, MatchEvents
from .event_kinds import kind_of
from .event_players import Who, same_players
from .event_providers import EVENT_PROVIDERS, guessed_event_provider, load_events, other_file
from .match_data import Match
from .match_mending import home_end
from .tables import number, read_rows

_USUAL_PITCH = (105.0, 68.0)
_LEAST_KNOWN = 0.5  # share of the events' players who must be in the tracking
_TABLE_KINDS = {  # of plain tables -> kind
    "miss": "shot", "goal": "shot", "post": "shot", "saved shot": "shot", "cross": "pass", "blocked pass": "deflection",
    "takeon": "take-on", "ball touch": "touch", "recovery": "touch", "challenge": "tackle", "dispossessed": "touch",
    "ball lost": "touch", "ball out": "out", "set piece": "other", "fault received": "foul", "card": "other",
    "header": "pass", "reception": "receive", "throw-in": "pass", "kick": "pass",
}  # fmt: skip
_METRICA_SUBTYPES = {"clearance": "clearance", "aerial": "aerial"}
_HEAD = {"header", "head"}


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
    path, provider = Path(path), (provider or "").lower()
    provider = provider or guessed_event_provider(path)
    if provider not in EVENT_PROVIDERS:
        raise InputError("provider", f"{provider!r}", f"one of {', '.join(EVENT_PROVIDERS)} for events")
    second = other_file(path, provider, meta)
    if provider == "csv" or second is None and path.suffix.lower() == ".csv":
        rows = _plain(path, match) if provider == "csv" else _metrica_csv(path, match)
    else:
        rows = _through_kloppy(path, provider, second, match)
    if not rows:
        raise InputError(path, "no events", "some", "export it again")
    events, notes = _with_players(path, rows, match)
    told = [f"{second.name} taken as its second file"] if second and meta is None else []
    told += [f"{meta}: not used, since events of {provider} are in one file"] if meta and not second else []
    return MatchEvents(tuple(events), provider, str(path), tuple([*told, *notes]))


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


def _through_kloppy(path: Path, provider: str, second: Path | None, match: Match | None):
    dataset = load_events(path, provider, second)
    place = _placing(dataset, match)
    rows = []
    for record in dataset.records:
        kind, part, side, details, success = kind_of(record, provider)
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
    size, length, width = system.pitch_dimensions, *(_pitch_of(match))
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


def _pitch_of(match: Match | None) -> tuple[float, float]:
    return (match.length, match.width) if match else _USUAL_PITCH


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


def _plain(path: Path, match: Match | None):
    """Rows of time_s,type,player[,detail,success,x,y,period,part,side]: seconds of the match's clock, or of the
    period's where a column names it."""
    rows = []
    for place, row in read_rows(path, ("time_s", "type", "player")):
        time, period = number(row["time_s"], "time_s", place), 1
        if row.get("period"):
            period = int(number(row["period"], "period", place))
        elif match is not None:
            half = max((half for half in match.halves if time >= half.start - 5.0), key=lambda half: half.start,
                       default=match.halves[0])  # fmt: skip
            time, period = time - half.zero, half.number
        said, detail = row["type"].lower(), row.get("detail", "").lower()
        kind = said if said in KINDS else _TABLE_KINDS.get(said, "other")
        words = detail.replace("/", " ").replace("_", " ")
        part = row.get("part", "").lower() or _part_in(words, said)
        if part and part not in BODY_PARTS:
            raise InputError(place, f"part {part!r}", f"one of {', '.join(BODY_PARTS)}, or none")
        sides = f"{row.get('side', '')} {words}".split() if part == "foot" else ()
        side = next((one for one in ("left", "right") if one in sides), "")
        details = ("throw-in",) if "throw in" in f"{said} {words}".replace("-", " ") else ()
        xy = tuple(number(row.get(name, ""), name, place, blank=True) for name in ("x", "y"))
        success = {"true": True, "1": True, "false": False, "0": False}.get(row.get("success", "").lower())
        event = MatchEvent(time, period, "", "", kind, "hand" if details else part, side, details, said, success, xy)
        rows.append((event, Who.spelled(row["player"]) if row["player"] else None))
    return rows


def _part_in(words: str, said: str) -> str:
    """The part that a detail names."""
    if _HEAD & {*words.split(), said}:
        return "head"
    return "foot" if "foot" in words else ""


def _metrica_csv(path: Path, match: Match | None):
    """Metrica's own table of events, which kloppy leaves out."""
    rows = []
    needed = ("Team", "Type", "Subtype", "Period", "Start Time [s]", "From", "Start X", "Start Y")
    length, width = _pitch_of(match)
    begins: dict[int, float] = {}
    for place, row in read_rows(path, needed):
        period = int(number(row["Period"], "Period", place))
        time = number(row["Start Time [s]"], "Start Time [s]", place)
        time -= begins.setdefault(period, 0.0 if period == 1 else time)
        said = f"{row['Type']} {row['Subtype']}".strip().lower()
        named = (row["Type"].lower(), "other")[row["Type"].lower() not in (*KINDS, *_TABLE_KINDS)]
        kind = next((kind for word, kind in _METRICA_SUBTYPES.items() if word in said), _TABLE_KINDS.get(named, named))
        part = "head" if "head" in said else "hand" if "throw in" in said else ""
        details = ("throw-in",) * (part == "hand") + ("lost",) * (kind == "aerial" and "lost" in said)
        x, y = (number(row[name], name, place, blank=True) for name in ("Start X", "Start Y"))
        team = row["Team"].lower() if row["Team"].lower() in ("home", "away") else ""
        event = MatchEvent(
            time, period, "", team, kind, part, "", details, said, None, ((x - 0.5) * length, (0.5 - y) * width),
        )
        rows.append((event, Who.spelled(row["From"], team) if row["From"] else None))
    return rows
