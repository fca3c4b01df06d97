"""Read a match's event data: providers' files through kloppy, and plain tables, with the tracking's players.

kloppy's kinds, qualifiers and results are converted to the kinds and details of `annotation.event_labels`.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ..base.errors import InputError, build_read_error
from ..motion.track.match_data import Match
from .event_data import EventPlayer, MatchEvent, MatchEvents, assign_players
from .event_providers import (
    EVENT_PROVIDERS,
    EventProvider,
    detect_event_provider,
    find_pitch_size,
    find_second_file,
    load_events,
)
from .tracking.feed import refuse_damage
from .tracking.match_repairs import find_home_end

_MIN_KNOWN_SHARE = 0.5  # smallest share of the events' players that must be tracked
_KINDS = {
    "PASS": "pass", "SHOT": "shot", "TAKE_ON": "take-on", "CARRY": "carry", "CLEARANCE": "clearance",
    "INTERCEPTION": "interception", "RECOVERY": "touch", "MISCONTROL": "miscontrol", "BALL_OUT": "out",
    "FOUL_COMMITTED": "foul", "DUEL": "tackle", "GOALKEEPER": "save",
}  # fmt: skip
_BY_NAME = {  # names of events that kloppy treats as generic -> kind
    "ball receipt*": "receive", "reception": "receive", "receival": "receive", "touch": "touch", "ball touch": "touch",
    "block": "deflection",
}  # fmt: skip
_BY_KEEPER = {"CLAIM": "catch", "PUNCH": "punch", "PICK_UP": "pick-up", "SMOTHER": "catch"}
_PARTS = {
    "RIGHT_FOOT": ("foot", "right"), "LEFT_FOOT": ("foot", "left"), "HEAD": ("head", ""), "CHEST": ("chest", ""),
    "BOTH_HANDS": ("hand", ""), "LEFT_HAND": ("hand", "left"), "RIGHT_HAND": ("hand", "right"),
    "KEEPER_ARM": ("hand", ""), "DROP_KICK": ("foot", ""),
}  # fmt: skip
_PASSES = {"HEAD_PASS": ("head", ""), "HAND_PASS": ("hand", "")}
_DETAILS = {
    "THROW_IN": "throw-in", "CORNER_KICK": "corner", "FREE_KICK": "free-kick", "GOAL_KICK": "goal-kick",
    "KICK_OFF": "kick-off", "PENALTY": "penalty", "SLIDING_TACKLE": "sliding", "CROSS": "cross",
    "HIGH_PASS": "high", "LONG_BALL": "long", "LAUNCH": "long", "CHIPPED_PASS": "chipped",
}  # fmt: skip
_SUCCESSES = {"COMPLETE", "GOAL", "WON", "SUCCESS"}
_FAILURES = {"INCOMPLETE", "OUT", "OFFSIDE", "OFF_TARGET", "POST", "BLOCKED", "SAVED", "LOST"}


def read_events(
    path: str | os.PathLike, meta: str | os.PathLike | None = None, provider: str | None = None,
    match: Match | None = None,
) -> MatchEvents:
    """Read a provider's events, with the players of a tracked match.

    Args:
        path: the file of events.
        meta: lineups or metadata if the provider has a second file (Opta's F7, StatsBomb's lineups, the metadata of
            Metrica and Sportec, Stats Perform's MA1); None searches beside `path`.
        provider: key of `event_providers.EVENT_PROVIDERS`; None detects it from the content.
        match: the tracked match that gives the players' ids and the pitch; without it they keep their own.
    Returns:
        The events.
    Raises:
        InputError: if files are missing or invalid, or most players are not in the match, so the events are of another
            match.
    """
    if not Path(path).is_file():
        raise build_read_error(path, "a file of events")
    path, name = Path(path), (provider or "").lower()
    if name and name not in EVENT_PROVIDERS:
        raise InputError("provider", f"{name!r}", f"one of {', '.join(EVENT_PROVIDERS)} for events")
    record = EVENT_PROVIDERS[name] if name else detect_event_provider(path)
    second = find_second_file(path, record, meta)
    if record.has_table(path):
        rows = record.read_table(path, match)
    else:
        rows = _load_kloppy_events(path, record, second, match)
    if not rows:
        raise InputError(path, "has no events", "at least one event", "export it again")
    events, notes = _assign_players(path, rows, match)
    file_notes = [f"{second.name} is used as its second file"] if second and meta is None else []
    file_notes += [f"{meta}: not used, because events of {record.title} are in one file"] if meta and not second else []
    return MatchEvents(tuple(events), record.name, str(path), tuple([*file_notes, *notes]))


def _assign_players(path: Path, rows: list[tuple[MatchEvent, EventPlayer | None]], match: Match | None):
    """Assign the tracking's ids to the events, ordered by period and time; return them with notes."""
    event_players = list(dict.fromkeys(who for _, who in rows if who is not None))
    known, notes = assign_players(event_players, match)
    is_mostly_unknown = match is not None and len(known) < _MIN_KNOWN_SHARE * len(event_players)
    if is_mostly_unknown and all(who.number < 0 and not who.name
                                 for who in event_players):  # nothing shows that it is another match
        ids = ", ".join([who.id for who in event_players if who not in known][:3])
        notes = [
            f"{path.name}: {len(event_players) - len(known)} of {len(event_players)} players cannot be assigned, "
            f"because the events have neither shirt numbers nor names, and the tracking has other ids than theirs "
            f"({ids} ...): their events are ignored"
        ]
    elif is_mostly_unknown:
        missing = ", ".join(who.display_name for who in event_players if who not in known)
        found = (f"{len(event_players) - len(known)} of {len(event_players)} players ({missing[:80]}) are not in the "
                 "tracking")
        raise InputError(path, found, "events of the same match, with ids, numbers or names", "check both files")
    out = []
    for event, who in rows:
        own = (who.id if who and not match else "", event.team)
        player, team = known.get(who, own)
        out.append(MatchEvent(**{**vars(event), "player": player, "team": team}))
    return sorted(out, key=lambda event: (event.period, event.time)), notes


def _load_kloppy_events(path: Path, provider: EventProvider, second: Path | None, match: Match | None):
    """Load events with kloppy and convert them; InputError also for values that kloppy takes as they are."""
    dataset = load_events(path, provider, second)
    with refuse_damage(path, f"events of {provider.title}", () if second is None else (second,)):
        return _convert_events(dataset, provider, match)


def _convert_events(dataset, provider: EventProvider, match: Match | None):
    """Convert kloppy's events, with their players."""
    place = _build_position_map(dataset, match)
    rows = []
    for record in dataset.records:
        kind, part, side, details, success = convert_kind(record, provider.has_foot_side)
        team = str(record.team.ground) if record.team else ""
        event = MatchEvent(time=record.timestamp.total_seconds(), period=int(record.period.id), player="", team=team,
                           kind=kind, part=part, side=side, details=details, original_text=str(record.event_name),
                           success=success, place=place(record, team))
        rows.append((event, _build_event_player(record)))
    return rows


def _build_event_player(record) -> EventPlayer | None:
    player = record.player
    if player is None:
        raw = record.raw_event.get("from") if isinstance(record.raw_event, dict) else None  # Metrica's player, whom its
        name = raw.get("name") if isinstance(raw, dict) else None  # metadata does not list
        return EventPlayer.from_text(str(name), str(record.team.ground) if record.team else "") if name else None
    shirt = -1 if player.jersey_no is None else int(player.jersey_no)
    return EventPlayer(str(player.player_id), str(player.team.ground), shirt, player.name or "")


def _build_position_map(dataset, match: Match | None):
    """Build the map from one of kloppy's records and its team to (x, y) m on the tracking's pitch."""
    system = dataset.metadata.coordinate_system
    size, length, width = system.pitch_dimensions, *find_pitch_size(match)
    is_y_down = system.vertical_orientation.name == "TOP_TO_BOTTOM"
    by_team = dataset.metadata.orientation.name == "ACTION_EXECUTING_TEAM"
    ends = _find_home_ends(match)

    def place(record, team: str) -> tuple[float, float]:
        point = record.coordinates
        if point is None or size.x_dim.max is None or size.y_dim.max is None or point.x is None or point.y is None:
            return np.nan, np.nan
        x = ((point.x - size.x_dim.min) / (size.x_dim.max - size.x_dim.min) - 0.5) * length
        y = ((point.y - size.y_dim.min) / (size.y_dim.max - size.y_dim.min) - 0.5) * width * (-1.0 if is_y_down
                else 1.0)
        end = ends.get(int(record.period.id) if by_team else 1, -1.0)
        turn = -end if team != "away" or not by_team else end
        return float(turn * x), float(turn * y)

    return place


def _find_home_ends(match: Match | None) -> dict[int, float]:
    """Find the end that the home team defends, -1 or 1, for each period in which it is clear."""
    if match is None:
        return {}
    teams = np.array([player.team for player in match.players])
    ends = {}
    for half in match.halves:
        part = slice(*np.searchsorted(match.times, [half.start - 1e-6, half.end + 1e-6]))
        ends[half.number] = find_home_end(match.positions[:, part], teams)
    return {number: end for number, end in ends.items() if end}


def convert_kind(event, has_foot_side: bool) -> tuple[str, str, str, tuple[str, ...], bool | None]:
    """Convert one of kloppy's events.

    Args:
        event: the event.
        has_foot_side: whether the provider's data has left and right feet.
    Returns:
        Kind, body part, side, details, success.
    """
    names = [_format_qualifier(one) for one in getattr(event, "qualifiers", None) or ()]
    result = getattr(getattr(event, "result", None), "name", "")
    success = True if result in _SUCCESSES else False if result in _FAILURES else None
    kind = _KINDS.get(event.event_type.name) or _BY_NAME.get(str(event.event_name).lower(), "other")
    details = [_DETAILS[name] for name in names if name in _DETAILS]
    if "AERIAL" in names and kind == "tackle":
        kind = "aerial"
    if kind in ("aerial", "tackle") and result == "LOST":
        details.append("lost")
    part, side = next((_PARTS[name] for name in names if name in _PARTS), ("", ""))
    if not part and kind == "pass":
        part, side = next((_PASSES[name] for name in names if name in _PASSES), ("", ""))
    if "throw-in" in details:
        part, side = "hand", ""
    if event.event_type.name == "GOALKEEPER":
        kind = next((_BY_KEEPER[name] for name in names if name in _BY_KEEPER), kind)
        part = part or "hand"
    if not has_foot_side or part != "foot":
        side = ""
    return kind, part, side, tuple(dict.fromkeys(details)), success


def _format_qualifier(qualifier) -> str:
    value = getattr(qualifier, "value", None)
    return str(getattr(value, "name", value))
