"""Tracking data of RespoVision: one JSON object a line, metres from a corner of the pitch."""

from __future__ import annotations

import math
import re

from ....base.errors import InputError
from ..feed import Feed
from ..match_arrays import USUAL_PITCH
from .samples import MatchSamples, SampleCollector, iter_json_lines

_PERIOD = re.compile(r"(half|extra)_(\d)")


def read_respovision(feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    """Read the tracking data. See `_find_grounds` for the home team; y is taken to grow to the left of +x.

    Args:
        feed: the files.
        pitch: length and width in metres, which the feed does not have; None: 105 x 68.
    Returns:
        The match.
    Raises:
        InputError: for a file of another form.
    """
    found, (length, width) = SampleCollector(feed.path), pitch or USUAL_PITCH
    grounds: dict[str, str] = {}
    for line, frame in iter_json_lines(feed.path):
        moment = _find_moment(frame, f"{feed.path}:{line}")
        if not grounds:
            grounds = _find_grounds(frame.get("pitch_side") or {}, found.lines)
        for player in frame.get("players") or ():
            key = str(player["person_id"])
            found.add_person(key, grounds.get(str(player.get("team_name")), ""), str(player.get("person_name") or ""),
                             player.get("jersey_number"), _name_position(player))
            x, y = player.get("x"), player.get("y")
            if x is not None and y is not None:
                found.add_sample(moment, key, x - length / 2, y - width / 2)
                if not player.get("is_imputed"):
                    found.add_angle(moment, key, _choose_angle(player))
        ball = frame.get("ball") or {}
        if ball.get("x") is not None and ball.get("y") is not None:
            found.add_ball(moment, ball["x"] - length / 2, ball["y"] - width / 2, ball.get("z"))
    names = {ground: name for name, ground in grounds.items()}
    return found.build(pitch, (names.get("home", ""), names.get("away", "")))


def _find_grounds(sides: dict, lines: list[str]) -> dict[str, str]:
    """Return team -> ground: the home team is the one whose name says so, else the one that begins on the left."""
    home, away = str(sides.get("left")), str(sides.get("right"))
    if "home" in away.lower() or "away" in home.lower():
        home, away = away, home
    elif "home" not in home.lower():
        lines.append(f"{home} begins on the left and is taken as the home team")
    return {home: "home", away: "away"}


def _find_moment(frame: dict, place: str) -> tuple[int, float]:
    """Return a frame's period and its seconds, from "MM:SS.ffffff"."""
    period = _PERIOD.fullmatch(str(frame.get("period")))
    minutes, _, seconds = str(frame.get("time")).partition(":")
    try:
        passed = 60.0 * int(minutes) + float(seconds)
    except ValueError:
        passed = None
    if period is None or passed is None or not math.isfinite(passed):
        raise InputError(place, f"period {str(frame.get('period'))[:20]!r}, time {str(frame.get('time'))[:20]!r}",
                         "half_1 or half_2, and MM:SS.f", "export it again")
    return int(period[2]) + 2 * (period[1] == "extra"), round(passed, 3)


def _choose_angle(player: dict) -> float | None:
    """Return the angle of the hips, else that of the shoulders; None where neither is a number."""
    angles = (player.get(f"{part}_angle") for part in ("hips", "shoulders"))
    return next((angle for angle in angles if isinstance(angle, (int, float)) and math.isfinite(angle)), None)


def _name_position(player: dict) -> str:
    category = str(player.get("category_name") or "")
    return "" if category == "player" else category
