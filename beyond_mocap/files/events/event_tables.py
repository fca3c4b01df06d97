"""Events in tables: our own, of which docs/match/match-input.md names the columns, and Metrica's, which kloppy leaves
out."""

from __future__ import annotations

from pathlib import Path

from ...annotation.event_words import KINDS
from ...annotation.striking import BODY_PARTS
from ...base.errors import InputError
from ...motion.track.match_data import Match
from ..tables import number, read_rows
from .event_data import MatchEvent
from .event_players import Who

_USUAL_PITCH = (105.0, 68.0)
_TABLE_KINDS = {  # of plain tables -> kind
    "miss": "shot", "goal": "shot", "post": "shot", "saved shot": "shot", "cross": "pass", "blocked pass": "deflection",
    "takeon": "take-on", "ball touch": "touch", "recovery": "touch", "challenge": "tackle", "dispossessed": "touch",
    "ball lost": "touch", "ball out": "out", "set piece": "other", "fault received": "foul", "card": "other",
    "header": "pass", "reception": "receive", "throw-in": "pass", "kick": "pass",
}  # fmt: skip
_METRICA_SUBTYPES = {"clearance": "clearance", "aerial": "aerial"}
_HEAD = {"header", "head"}


def pitch_size(match: Match | None) -> tuple[float, float]:
    """Length and width, m, of the tracking's pitch, or of a usual one."""
    return (match.length, match.width) if match else _USUAL_PITCH


def read_plain_events(path: Path, match: Match | None):
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


def read_metrica_events(path: Path, match: Match | None):
    """Metrica's own table of events, which kloppy leaves out."""
    rows = []
    needed = ("Team", "Type", "Subtype", "Period", "Start Time [s]", "From", "Start X", "Start Y")
    length, width = pitch_size(match)
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
