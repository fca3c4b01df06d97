"""Positions of satellite receivers: CSV of wearables (Catapult, STATSports and alike) and GPX, a file for each player.

Latitude and longitude become metres on the plane that touches the earth at the pitch. Four corners of the pitch, in a
CSV with `corners` in its name, place it; without them it lies along the way that the players move.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from xml.parsers import expat

import numpy as np

from ....base.content import open_file
from ....base.errors import InputError, format_count
from ...tables import parse_number, read_rows
from ..feed import Feed
from ..match_arrays import PITCH_SIDES, is_pitch_size
from .cdf import parse_time
from .samples import MatchSamples, SampleCollector

_MOST_DEGREES = (90.0, 180.0)  # of latitude and longitude
_EARTH_RADIUS = 6_371_008.8  # metres, mean (IUGG)
_NAMES = {
    "latitude": ("lat", "latitude"), "longitude": ("lon", "long", "lng", "longitude"),
    "time": ("time", "timestamp", "time (s)", "time_s", "gps time"), "name": ("player display name", "player name"),
}  # fmt: skip
_COLUMNS = {variant: column for column, names in _NAMES.items() for name in names
            for variant in (name, name.capitalize(), name.title(), name.upper()) if variant != column}
_EXCEL_DAYS = (20_000.0, 80_000.0)  # 1954 to 2119
_EPOCH = (1e9, 1e11)  # seconds since 1970, 2001 to 5138; thousand times as much in milliseconds
_FARTHEST = 500.0  # metres from the players to the middle of their pitch
_RATE_RANGE = (0.5, 100.0)


@dataclass(frozen=True, eq=False)
class _Receiver:
    """One player's samples: name, times (N,) s, latitude and longitude (N, 2) in degrees, and how many the file has,
    of which those at a moment of another are left out.
    """

    name: str
    times: np.ndarray
    degrees: np.ndarray
    count: int


def read_gps(feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    """Read all receivers of a folder that ran at the time of the chosen one.

    Args:
        feed: the chosen file first, then all others beside it; the corners as metadata, if there are any.
        pitch: length and width in metres, where there are no corners; None: not known.
    Returns:
        The match, all in the home team.
    Raises:
        InputError: for a file of another form.
    """
    chosen = _read_receiver(feed.path)
    others, left_out = [], []
    found = SampleCollector(feed.path)
    for path in feed.tracking[1:]:
        try:
            other = _read_receiver(path)
        except InputError as error:  # another player's file
            found.lines.append(f"left out: {error}")
            continue
        (others if _overlap(chosen, other) else left_out).append(other)
    receivers = [chosen, *others]
    if len(feed.tracking) > 1:
        found.lines.append(f"{len(receivers)} of {len(feed.tracking)} files of "
                           f"{feed.path.parent.name or feed.path.parent} are used, a player each")
    if left_out:
        found.lines.append(f"{format_count(len(left_out), 'file')} of other times left out: "
                           f"{', '.join(one.name for one in left_out[:5])}")
    to_pitch, size = _find_pitch(feed, receivers, found.lines)
    step = 1.0 / _find_rate(feed.path, chosen)
    begin = min(one.times[0] for one in receivers)
    for receiver in receivers:
        found.add_person(receiver.name, "home", receiver.name)
        found.add_track(1, receiver.name, receiver.times - begin, to_pitch(receiver.degrees), step)
    return found.build(size or pitch, fps=1.0 / step)


def _read_receiver(path: Path) -> _Receiver:
    """Read one player's file, sorted by time, without samples where the receiver had no fix."""
    name, times, degrees = _read_gpx(path) if path.suffix.lower() == ".gpx" else _read_table(path)
    times, degrees = np.array(times, dtype=float), np.array(degrees, dtype=float).reshape(-1, 2)
    fixed = np.isfinite(times) & np.isfinite(degrees).all(axis=1) & np.any(degrees != 0.0, axis=1)
    good = fixed & (np.abs(degrees) <= _MOST_DEGREES).all(axis=1)
    times, order = np.unique(times[good], return_index=True)
    if len(times) < 2 and (fixed & ~good).any():
        latitude, longitude = degrees[fixed & ~good][0]
        raise InputError(path, f"latitude {latitude:.7g}, longitude {longitude:.7g}",
                         "degrees, -90 to 90 and -180 to 180", "export it in degrees, not in metres of a map")
    if len(times) < 2:
        raise InputError(path, format_count(len(times), "sample"), "at least two with a time and a place",
                         "export it again")
    return _Receiver(name, times, degrees[good][order], int(good.sum()))


def _read_table(path: Path) -> tuple[str, list[float], list[tuple[float, float]]]:
    """Read name, times and degrees of a CSV."""
    times, degrees, name = [], [], ""
    for place, row in read_rows(path, ("time", "latitude", "longitude"), others=_COLUMNS, separators=",;\t"):
        times.append(parse_clock(row["time"], place))
        degrees.append((parse_number(row["latitude"], "latitude", place, blank=True),
                        parse_number(row["longitude"], "longitude", place, blank=True)))
        name = name or row.get("name", "")
    return f"{name} ({path.stem})" if name else path.stem, times, degrees


def parse_clock(text: str, place: str) -> float:
    """Parse a time of any usual form to seconds: HH:MM:SS.s, days of a table program, seconds since 1970, ISO 8601.

    Args:
        text: the time.
        place: where it stands, for errors.
    Returns:
        Seconds.
    Raises:
        InputError: if it is none.
    """
    if re.fullmatch(r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?", text):
        hours, minutes, seconds = text.replace(",", ".").split(":")
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
    try:
        value = float(text)
    except ValueError:
        return (parse_time(text, place) - datetime(1970, 1, 1)).total_seconds()
    if not abs(value) < 1000.0 * _EPOCH[1]:
        raise InputError(place, f"time {text[:40]!r}", "seconds", "export it again")
    if _EXCEL_DAYS[0] <= value <= _EXCEL_DAYS[1] and "." in text:
        return 86_400.0 * value
    return value / 1000.0 if value > _EPOCH[1] else value


def _read_gpx(path: Path) -> tuple[str, list[float], list[tuple[float, float]]]:
    """Read name, times and degrees of the track points of a GPX file."""
    times: list[float] = []
    degrees: list[tuple[float, float]] = []
    text: list[str] = []
    is_open: list[str] = []

    def start(name, attributes):
        is_open.append(name.rpartition(":")[2])
        text.clear()
        if is_open[-1] == "trkpt":
            degrees.append((parse_number(attributes.get("lat", ""), "lat", str(path)),
                            parse_number(attributes.get("lon", ""), "lon", str(path))))
            times.append(np.nan)

    def end(_name):
        if is_open[-2:] == ["trkpt", "time"]:
            times[-1] = parse_clock("".join(text).strip(), str(path))
        is_open.pop()

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text.append
    try:
        with open_file(path, "a GPX file") as file:
            parser.ParseFile(file)
    except expat.ExpatError as error:
        raise InputError(f"{path}:{error.lineno}", expat.ErrorString(error.code), "GPX", "export it again") from None
    return path.stem, times, degrees


def _overlap(one: _Receiver, other: _Receiver) -> bool:
    """Return whether two receivers ran together for most of the shorter one's time."""
    common = min(one.times[-1], other.times[-1]) - max(one.times[0], other.times[0])
    return common >= 0.5 * min(np.ptp(one.times), np.ptp(other.times))


def _find_rate(path: Path, receiver: _Receiver) -> float:
    rate = round(1.0 / float(np.median(np.diff(receiver.times))), 2)
    if not _RATE_RANGE[0] <= rate <= _RATE_RANGE[1]:
        moments = f", {receiver.count} samples at {len(receiver.times)} different times"
        found = f"{rate:g} samples per second" + moments * (receiver.count > len(receiver.times))
        raise InputError(path, found, f"{_RATE_RANGE[0]:g} to {_RATE_RANGE[1]:g}",
                         "export at the receiver's own rate, with the time of each sample")
    return rate


def _find_pitch(feed: Feed, receivers: list[_Receiver], lines: list[str]):
    """Find the map (N, 2) degrees -> metres on the pitch, and the pitch's size, None without corners."""
    degrees = np.concatenate([one.degrees for one in receivers])
    middle = np.median(degrees, axis=0)
    across = np.cos(np.radians(middle[0]))

    def to_plane(points):
        east, north = (points[:, 1] - middle[1]) * across, points[:, 0] - middle[0]
        return np.radians(np.stack([east, north], axis=1)) * _EARTH_RADIUS

    corners = to_plane(_read_corners(feed.meta[0])) if feed.meta else None
    if corners is not None and (away := float(np.linalg.norm(corners.mean(axis=0)))) > _FARTHEST:
        found = f"corners of a pitch {away / 1000.0:.1f} km away from the players"
        if feed.is_meta_chosen:
            raise InputError(feed.meta[0], found, "those of the pitch they are on", "choose another file, or none")
        lines.append(f"{feed.meta[0].name} has the {found}: not used")
        corners = None
    if corners is not None:
        lines.append(f"the pitch is the one of {feed.meta[0].name}")
        centre, axis, size = _measure_corners(feed.meta[0], corners)
    else:
        places = to_plane(degrees)
        centre, size = np.median(places, axis=0), None
        axis = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)[2][0]
        axis = axis * (1.0 if axis[0] >= 0.0 else -1.0)
        lines.append("no corners of the pitch: it lies along the players' main direction, its centre where they are "
                     "most; add a CSV NAME_corners.csv with longitude,latitude of four corners")
    turn = np.array([axis, (-axis[1], axis[0])])
    return lambda points: (to_plane(points) - centre) @ turn.T, size


def _read_corners(path: Path) -> np.ndarray:
    """Read four corners as (4, 2) degrees of latitude and longitude."""
    rows = list(read_rows(path, ("latitude", "longitude"), others=_COLUMNS, separators=",;\t"))
    if len(rows) != 4:
        raise InputError(path, format_count(len(rows), "corner"), "4", "keep the pitch's four corners")
    corners = np.array([[parse_number(row[name], name, place) for name in ("latitude", "longitude")]
                        for place, row in rows])
    if (np.abs(corners) > _MOST_DEGREES).any():
        raise InputError(path, f"{np.abs(corners).max():.6g} degrees", "latitudes and longitudes", "export it again")
    return corners


def _measure_corners(path: Path, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Measure centre, direction of the longer sides, and size of a pitch with these corners (4, 2) in any order."""
    centre = places.mean(axis=0)
    around = places[np.argsort(np.arctan2(*(places - centre).T[::-1]))]
    sides = np.roll(around, -1, axis=0) - around
    lengths = np.linalg.norm(sides, axis=1)
    pairs = lengths[:2] + lengths[2:]
    longer = int(np.argmax(pairs))
    axis = sides[longer] - sides[longer + 2]
    axis = axis / np.linalg.norm(axis) * (1.0 if axis[0] >= 0.0 else -1.0)
    size = (float(pairs[longer] / 2), float(pairs[1 - longer] / 2))
    if not is_pitch_size(size):
        raise InputError(path, f"corners of a pitch of {size[0]:.0f} x {size[1]:.0f} m",
                         f"sides of {PITCH_SIDES[0]:g} to {PITCH_SIDES[1]:g} m", "check latitude and longitude")
    return centre, axis, size
