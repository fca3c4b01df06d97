"""Tracking data in the Common Data Format: one JSON object a line, with metadata (cdf.football, version 0.2)."""

from __future__ import annotations

import json
from datetime import datetime, timedelta

from ....base.content import read_utf8
from ....base.errors import InputError
from ..feed import Feed
from .samples import MatchSamples, SampleCollector, iter_json_lines

_PERIODS = {"first_half": 1, "second_half": 2, "first_half_extratime": 3, "second_half_extratime": 4, "shootout": 5}
_POSITIONS = {"GK": "goalkeeper", "DF": "defender", "MF": "midfielder", "FW": "forward"}


def read_cdf(feed: Feed) -> MatchSamples:
    """Read the tracking data; metres from the pitch's centre, y to the left of +x.

    Args:
        feed: the files.
    Returns:
        The match.
    Raises:
        InputError: for a file of another form.
    """
    meta = read_json(feed.meta[0]) if feed.meta else {}
    found = SampleCollector(feed.path)
    teams = meta.get("teams", {})
    for ground in ("home", "away"):
        for player in teams.get(ground, {}).get("players", ()):
            add_cdf_player(found, player, ground)
    starts: dict[int, datetime] = {}
    for place, frame in iter_json_lines(feed.path):
        number = find_cdf_period(frame, f"{feed.path}:{place}")
        stamp = parse_time(frame["timestamp"], f"{feed.path}:{place}")
        moment = number, round((stamp - starts.setdefault(number, stamp)).total_seconds(), 3)
        for ground, team in frame["teams"].items():
            for player in team.get("players") or ():
                found.add_person(str(player["id"]), ground)
                found.add_sample(moment, str(player["id"]), player.get("x"), player.get("y"))
        ball = frame.get("ball") or {}
        found.add_ball(moment, ball.get("x"), ball.get("y"), ball.get("z"))
    stadium = meta.get("stadium") or {}
    length, width = stadium.get("pitch_length"), stadium.get("pitch_width")
    home, away = (str(teams.get(ground, {}).get("name") or "") for ground in ("home", "away"))
    return found.build((float(length), float(width)) if length and width else None, (home, away))


def add_cdf_player(found: SampleCollector, player: dict, ground: str) -> None:
    """Add a player of the metadata."""
    name = player.get("name") or " ".join(filter(None, (player.get("first_name"), player.get("last_name"))))
    group = str(player.get("position_group") or "")
    found.add_person(str(player["id"]), ground, name, player.get("jersey_number"), _POSITIONS.get(group, group.lower()))


def find_cdf_period(frame: dict, place: str) -> int:
    """Return the number of a frame's period."""
    name = str(frame.get("period"))
    if name not in _PERIODS:
        raise InputError(place, f"period {name[:40]!r}", f"one of {', '.join(_PERIODS)}", "export it again")
    return _PERIODS[name]


def parse_time(text: object, place: str) -> datetime:
    """Parse a time in ISO 8601; one without a zone counts as UTC."""
    try:
        stamp = datetime.fromisoformat(str(text))
    except ValueError:
        raise InputError(place, f"time {str(text)[:40]!r}", "a time such as 2024-12-21T06:00:00.1Z") from None
    return stamp.replace(tzinfo=None) - (stamp.utcoffset() or timedelta(0))


def read_json(path) -> dict:
    """Read a JSON object; NaN is allowed."""
    try:
        value = json.loads(read_utf8(path, "a JSON file"))
    except (ValueError, RecursionError):
        raise InputError(path, "not JSON", "a JSON object", "export it again") from None
    if not isinstance(value, dict):
        raise InputError(path, "not a JSON object", "a JSON object", "choose the right file")
    return value
