"""kloppy's dataset as arrays in our own coordinates: everybody's samples, the ball's, and one clock for all periods."""

from __future__ import annotations

import re

import numpy as np

from ...motion.track.match_data import REFEREE

USUAL_PITCH = (105.0, 68.0)
_PERIOD_BREAK = 10.0  # seconds put between the periods of a match


def records_of(dataset) -> list:
    """The frames in which there is anybody, or a ball."""
    return [frame for frame in dataset.records if frame.players_data or frame.ball_coordinates is not None]


def tracked_players(records) -> list:
    """kloppy's players who are in some frame, the away team's first, by shirt number."""
    return sorted({player for frame in records for player in frame.players_data}, key=_shirt)


def player_samples(records, players) -> np.ndarray:
    """(P, N, 2) in the provider's coordinates, NaN where a player is not there."""
    row = {player.player_id: index for index, player in enumerate(players)}
    out = np.full((len(players), len(records), 2), np.nan)
    for index, frame in enumerate(records):
        for player, data in frame.players_data.items():
            if data.coordinates is not None:
                out[row[player.player_id], index] = data.coordinates.x, data.coordinates.y
    return out


def ball_samples(records) -> np.ndarray:
    """(N, 3) in the provider's coordinates, NaN where unknown; many feeds have no height."""
    out = np.full((len(records), 3), np.nan)
    for index, frame in enumerate(records):
        point = frame.ball_coordinates
        if point is not None:
            height = getattr(point, "z", None)
            out[index] = point.x, point.y, np.nan if height is None else height
    return out


def clock(records) -> tuple[np.ndarray, list[tuple[float, float, int, float]]]:
    """Seconds of every frame (N,) on one clock for all periods; and of each period its start and end on it, its number
    and the seconds that had passed at its first frame."""
    period = np.array([frame.period.id for frame in records])
    seconds = np.array([frame.timestamp.total_seconds() for frame in records])
    times, spans = np.empty(len(records)), []
    for number_ in dict.fromkeys(period.tolist()):
        members = period == number_
        begin = spans[-1][1] + _PERIOD_BREAK if spans else 0.0
        times[members] = seconds[members] - seconds[members].min() + begin
        spans.append((begin, float(times[members].max()), number_, float(seconds[members].min())))
    return times, spans


def _shirt(player) -> tuple[str, int, str]:
    return str(player.team.ground), int(player.jersey_no or 0), str(player.player_id)


def described(player) -> tuple[str, str, str, str, str]:
    """Id, team, name, number and position of one of kloppy's players."""
    id_, shirt = str(player.player_id), str(-1 if player.jersey_no is None else int(player.jersey_no))
    ground = str(player.team.ground)
    return id_, ground if ground in ("home", "away") else REFEREE, player.name or id_, shirt, _position(player)


def _position(player) -> str:
    """The position as words: "left center back"."""
    position = getattr(player, "starting_position", None)
    said = re.sub(r"\s+", " ", str(position or "")).strip().lower()
    return "" if said in ("unknown", "none") or "." in said else said


def pitch_of(dataset, pitch: tuple[float, float] | None, in_feed: bool) -> tuple[float, float, bool]:
    """Length, width in metres, and whether they are a default because neither the feed nor `pitch` has them.
    in_feed: whether the provider has them."""
    size = dataset.metadata.pitch_dimensions
    length, width = size.pitch_length, size.pitch_width
    kloppys_guess = size.unit.name == "NORMED" and (length, width) == USUAL_PITCH
    if length and width and not kloppys_guess and in_feed:
        return float(length), float(width), False
    return (*(pitch or USUAL_PITCH), pitch is None)


def height_unit(dataset) -> float:
    """Metres per unit of height; feeds that scale the pitch to 0..1 have none, or metres."""
    return 0.01 if dataset.metadata.coordinate_system.pitch_dimensions.unit.name == "CENTIMETERS" else 1.0


def to_metres(system, length: float, width: float, upward: bool):
    """The map from a provider's plane coordinates (..., 2) to metres from the pitch's centre, y to the left of +x.

    kloppy's own transformations pass through its standard pitch and bend positions between the lines; this one is
    linear. upward: y grows upward whatever the system says. kloppy turns the y of Metrica's CSV over while reading and
    still calls it downward; Metrica says (and the same match in TRACAB's form agrees) that the file's own y does."""
    size = system.pitch_dimensions
    x, y = size.x_dim, size.y_dim
    scale = {"METERS": (1.0, 1.0), "CENTIMETERS": (0.01, 0.01)}.get(size.unit.name)
    if scale is None:
        scale = length / (x.max - x.min), width / (y.max - y.min)
    ranges = ((0.0, length), (0.0, width)) if x.max is None or y.max is None else ((x.min, x.max), (y.min, y.max))
    middle = np.mean(ranges, axis=1)
    sign = -1.0 if system.vertical_orientation.name == "TOP_TO_BOTTOM" and not upward else 1.0
    return lambda points: (points - middle) * (scale[0], scale[1] * sign)
