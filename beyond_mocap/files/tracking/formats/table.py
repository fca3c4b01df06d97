"""Positions of all players in one plain table: a row for each player and moment, metres."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np

from ....base.errors import InputError, format_count
from ...tables import parse_number, read_rows
from ..feed import Feed
from ..match_arrays import MAX_OUTSIDE, USUAL_PITCH
from .gps import parse_clock
from .samples import MatchSamples, SampleCollector

_NAMES = {
    "time_s": ("time", "timestamp", "t", "seconds"), "player": ("player_id", "id", "track_id"), "x_m": ("x",),
    "y_m": ("y",), "z_m": ("z",), "number": ("jersey", "jersey_number", "shirt"), "position": ("role",),
    "period": ("half",), "name": ("player_name",), "team": (),
}  # fmt: skip
_COLUMNS = {variant: column for column, names in _NAMES.items() for name in (column, *names)
            for variant in {name, name.capitalize(), name.upper()} if variant != column}
_BALL = "ball"
_BESIDE = 5.0  # metres beside the pitch where players still are
_MANY_OUTSIDE, _MOST_OUTSIDE = 0.05, 0.5  # shares of places beside the pitch: of exchanged axes, and of any file
_SLOWEST_RATE = 0.5  # positions of a player a second
_SLOW_STEP = 1.0  # metres in a second that the fastest players of a match always exceed
_WIDEST = 500.0  # metres between players; more is another unit
_Tracks = dict[str, list[tuple[int, float, float, float, float]]]
"""Player -> period, seconds, x, y and z."""
_SHARED = 1.5  # as many moments as the busiest player has samples: above, players have moments of their own


def read_table(feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    """Read a table with time, player, x and y, and team, z, number, name, position and period where they are there.

    The ball is the player `ball`. Teams are home, away, and else in their order in the file. The origin is the pitch's
    centre or, where all players are on one side of both axes and some beyond half of the pitch, a corner.

    Args:
        feed: the file.
        pitch: length and width in metres; None: 105 x 68.
    Returns:
        The match.
    Raises:
        InputError: with the line, for cells that are no numbers; for other units than metres and seconds, and for
            axes that do not fit the pitch.
    """
    found = SampleCollector(feed.path)
    tracks, has_whole_times = _read_tracks(feed.path, found)
    _check_seconds(feed.path, tracks, has_whole_times)
    corner = _find_origin(feed.path, tracks, pitch or USUAL_PITCH, found)
    if doubled := sum(len(rows) - len({row[:2] for row in rows}) for rows in tracks.values()):
        found.lines.append(f"{format_count(doubled, 'row')} of a player and moment that the file has already: the last "
                           "one is used")
    step = _find_step(feed.path, tracks)
    for key, rows in tracks.items():
        samples = np.array(rows, dtype=float)
        samples[:, 2:4] -= corner
        if step is None or key == _BALL:
            _add_rows(found, key, samples)
        else:
            _add_resampled(found, key, samples, step)
    return found.build(pitch)


def _read_tracks(path: Path, found: SampleCollector) -> tuple[_Tracks, bool]:
    """Read period, seconds, x, y and z of each player, and add the people; and whether all times are whole numbers."""
    tracks: _Tracks = defaultdict(list)
    grounds: dict[str, str] = {}
    has_whole_times = True
    for place, row in read_rows(path, ("time_s", "player", "x_m", "y_m"), others=_COLUMNS, separators=",;\t"):
        x, y, z = (parse_number(row.get(name, ""), name, place, blank=True) for name in ("x_m", "y_m", "z_m"))
        period = parse_number(row["period"], "period", place) if row.get("period") else 1
        key = row["player"]
        if key.lower() == _BALL:
            key = _BALL
        else:
            found.add_person(key, _find_ground(row.get("team", ""), grounds, found.lines), row.get("name", ""),
                             row.get("number", ""), row.get("position", ""))
        tracks[key].append((int(period), round(parse_clock(row["time_s"], place), 4), x, y, z))
        has_whole_times = has_whole_times and row["time_s"].isdigit()
    moments = {row[:2] for rows in tracks.values() for row in rows}
    if len(moments) < 2:
        raise InputError(path, f"rows of {format_count(len(moments), 'moment')}", "a row for each player and moment",
                         "export a longer part of the match")
    return tracks, has_whole_times


def _check_seconds(path: Path, tracks: _Tracks, has_whole_times: bool) -> None:
    """Raise an error for times that are milliseconds, frame numbers or of another unit."""
    with np.errstate(over="ignore", invalid="ignore"):  # absurd numbers are nowhere, later
        moves = [np.diff(np.array(sorted(rows), dtype=float)[:, :4], axis=0)
                 for key, rows in tracks.items() if key != _BALL]
        period, seconds, x, y = np.concatenate([np.zeros((0, 4)), *moves]).T
        metres = np.hypot(x, y)
    follows = (period == 0.0) & (seconds > 0.0)
    if not follows.any():
        return
    step, metres = float(np.median(seconds[follows])), metres[follows & (seconds == 1.0) & np.isfinite(metres)]
    if step > 1.0 / _SLOWEST_RATE:
        hint = "the times look like milliseconds: divide them by 1000" if has_whole_times else "convert the times"
        raise InputError(path, f"positions of a player {step:.4g} s apart", "times in seconds", hint)
    if has_whole_times and step == 1.0 and len(metres) and 0.0 < (fast := np.percentile(metres, 99)) < _SLOW_STEP:
        raise InputError(path, f"times 1 apart in which players move {fast:.2g} m at most", "times in seconds",
                         "the times look like frame numbers: divide them by the frames per second, or write 1.0 for 1 "
                         "if they are seconds")


def _find_ground(team: str, grounds: dict[str, str], lines: list[str]) -> str:
    """Return "home" or "away" for a team's name, anything else for referees."""
    if team.lower() in ("home", "away", "referee"):
        return team.lower()
    if team not in grounds:
        grounds[team] = ("home", "away", "referee")[min(len(grounds), 2)]
        if team:
            lines.append(f"{team} is taken as {'referees' if len(grounds) > 2 else f'the {grounds[team]} team'}")
    return grounds[team]


def _find_origin(path: Path, tracks, pitch: tuple[float, float], found: SampleCollector) -> np.ndarray:
    """Return where the pitch's centre is in the file's coordinates, (2,)."""
    found_places = [row[2:4] for key, rows in tracks.items() if key != _BALL for row in rows]
    places = np.array(found_places, dtype=float).reshape(-1, 2)
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        raise InputError(path, "no position of a player", "x and y in metres", "export it again")
    low, high = np.percentile(places, (1, 99), axis=0)
    if not 1.0 < np.ptp([low, high], axis=0).max() <= _WIDEST:
        raise InputError(path, f"players between {low[0]:.4g} and {high[0]:.4g} along the pitch", "metres",
                         "convert x and y to metres")
    half = np.array(pitch) / 2.0
    origin, outside = _place_pitch(places, half)
    are_exchanged = outside > _MANY_OUTSIDE and _place_pitch(places[:, ::-1], half)[1] < outside / 10.0
    if outside > _MOST_OUTSIDE or are_exchanged:
        raise InputError(path, f"players from {low[0]:.4g} to {high[0]:.4g} m in x and {low[1]:.4g} to {high[1]:.4g} m "
                         "in y", f"x along and y across a pitch of {pitch[0]:g} x {pitch[1]:g} m, from its centre or a "
                         "corner", "exchange x and y" if are_exchanged else
                         "move the origin there, give the size of the pitch, or convert x and y to metres")
    if origin.any():
        found.lines.append("the origin is taken as a corner of the pitch")
    return origin


def _place_pitch(places: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, float]:
    """Return where the centre of a pitch with sides `half` (2,) is for places (N, 2), and the share outside it."""
    low, high = np.percentile(places, (1, 99), axis=0)
    sides = np.where(low > -_BESIDE, 1.0, np.where(high < _BESIDE, -1.0, 0.0))
    is_corner = sides.all() and (np.maximum(abs(low), abs(high)) > half + 1.0).any()
    origin = sides * half if is_corner else np.zeros(2)
    return origin, float((abs(places - origin) > half + MAX_OUTSIDE).any(axis=1).mean())


def _add_rows(found: SampleCollector, key: str, samples: np.ndarray) -> None:
    """Add samples (N, 5) as they are."""
    for period, seconds, x, y, z in samples.tolist():
        if key == _BALL:
            found.add_ball((int(period), seconds), x, y, z)
        else:
            found.add_sample((int(period), seconds), key, x, y)


def _find_step(path: Path, tracks) -> float | None:
    """Find the seconds between moments that all players can share; None where they share those of the file."""
    moments = {row[:2] for rows in tracks.values() for row in rows}
    if len(moments) <= _SHARED * max(map(len, tracks.values())):
        return None
    steps = np.concatenate([np.diff(np.unique([row[1] for row in rows])) for rows in tracks.values()])
    step = round(float(np.median(steps)), 3) if len(steps) else 0.0
    if not step:
        raise InputError(path, "players at moments of their own, not steps of a millisecond or more apart",
                         "several rows for each player", "export it again")
    return step


def _add_resampled(found: SampleCollector, key: str, samples: np.ndarray, step: float) -> None:
    """Add a player's samples (N, 5) at moments that all players share."""
    for period in np.unique(samples[:, 0]):
        own = samples[(samples[:, 0] == period) & np.isfinite(samples[:, 2:4]).all(axis=1)]
        times, order = np.unique(own[:, 1], return_index=True)
        if len(times) > 1:
            found.add_track(int(period), key, times, own[order, 2:4], step)
