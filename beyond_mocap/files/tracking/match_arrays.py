"""Convert kloppy's dataset to arrays in core coordinates: all players, the ball, and one clock for all periods."""

from __future__ import annotations

import re

import numpy as np

from ...base.errors import InputError
from ...motion.track.match_data import REFEREE

USUAL_PITCH = (105.0, 68.0)
PERIOD_BREAK = 10.0
"""Seconds inserted between the periods of a match."""
_FARTHEST = 1e7  # of any unit from the origin; anything beyond is no place
_LONGEST = 86_400.0  # seconds of a match
MAX_OUTSIDE = 12.0
"""Metres beyond the lines where no player is."""
PITCH_SIDES = (10.0, 400.0)
"""Metres: the shortest and the longest side of a pitch."""


def list_records(dataset) -> list:
    """List the frames with a player or a ball.

    Args:
        dataset: kloppy's dataset.
    Returns:
        kloppy's frames.
    """
    return [frame for frame in dataset.records if frame.players_data or frame.ball_coordinates is not None]


def list_players(records) -> list:
    """List the players of any frame, the away team's first, by shirt number.

    Args:
        records: kloppy's frames.
    Returns:
        kloppy's players.
    """
    return sorted({player for frame in records for player in frame.players_data}, key=_sort_key)


def build_player_samples(records, players) -> np.ndarray:
    """Build the players' samples.

    Args:
        records: N of kloppy's frames.
        players: P of kloppy's players.
    Returns:
        (P, N, 2) in the provider's coordinates, NaN where a player is absent.
    """
    row = {player.player_id: index for index, player in enumerate(players)}
    out = np.full((len(players), len(records), 2), np.nan)
    for index, frame in enumerate(records):
        for player, data in frame.players_data.items():
            if data.coordinates is not None:
                out[row[player.player_id], index] = data.coordinates.x, data.coordinates.y
    return _drop_absurd(out)


def build_ball_samples(records) -> np.ndarray:
    """Build the ball's samples; many feeds have no height.

    Args:
        records: N of kloppy's frames.
    Returns:
        (N, 3) in the provider's coordinates, NaN where unknown.
    """
    out = np.full((len(records), 3), np.nan)
    for index, frame in enumerate(records):
        point = frame.ball_coordinates
        if point is not None:
            height = getattr(point, "z", None)
            out[index] = point.x, point.y, np.nan if height is None else height
    return _drop_absurd(out)


def _drop_absurd(places: np.ndarray) -> np.ndarray:
    """Return places with NaN for numbers that no unit explains."""
    return np.where(np.abs(places) < _FARTHEST, places, np.nan)


def build_clock(records) -> tuple[np.ndarray, list[tuple[float, float, int, float]]]:
    """Build one clock for all periods.

    Args:
        records: N of kloppy's frames.
    Returns:
        (N,) seconds of every frame; and for each period its start and end on that clock, its number, and the seconds
        that had passed at its first frame.
    """
    return lay_periods(np.array([frame.period.id for frame in records]),
                       np.array([frame.timestamp.total_seconds() for frame in records]))


def lay_periods(period: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, list[tuple[float, float, int, float]]]:
    """Lay periods one after the other on one clock, with a break between them.

    Args:
        period: (N,) the number of each moment's period.
        seconds: (N,) on the clock of that period.
    Returns:
        As `build_clock`.
    """
    times, spans = np.empty(len(period)), []
    for number_ in dict.fromkeys(period.tolist()):
        members = period == number_
        begin = spans[-1][1] + PERIOD_BREAK if spans else 0.0
        times[members] = seconds[members] - seconds[members].min() + begin
        spans.append((begin, float(times[members].max()), number_, float(seconds[members].min())))
    return times, spans


def check_clock(path, times: np.ndarray) -> None:
    """Raise an error where the times (N,) s of a match cannot be: unknown, all the same, or of more than a day."""
    if not np.isfinite(times).all() or not 0.0 < np.ptp(times) < _LONGEST:
        raise InputError(path, f"times from {times.min():.6g} to {times.max():.6g} s", "the times of one match",
                         "export it again")


def is_pitch_size(size: tuple[float, float]) -> bool:
    """Return whether length and width, m, can be those of a pitch."""
    return all(PITCH_SIDES[0] <= side <= PITCH_SIDES[1] for side in size)


def check_size(path, size: tuple[float, float]) -> None:
    """Raise an error where a pitch's length and width, m, cannot be."""
    if not is_pitch_size(size):
        raise InputError(path, f"a pitch of {size[0]:.6g} x {size[1]:.6g} m",
                         f"sides of {PITCH_SIDES[0]:g} to {PITCH_SIDES[1]:g} m",
                         "correct its metadata")


def _sort_key(player) -> tuple[str, int, str]:
    return str(player.team.ground), int(player.jersey_no or 0), str(player.player_id)


def describe_player(player) -> tuple[str, str, str, str, str]:
    """Describe one of kloppy's players.

    Args:
        player: the player.
    Returns:
        Id, team, name, number and position.
    """
    id_, shirt = str(player.player_id), str(-1 if player.jersey_no is None else int(player.jersey_no))
    ground = str(player.team.ground)
    return id_, ground if ground in ("home", "away") else REFEREE, player.name or id_, shirt, _format_position(player)


def _format_position(player) -> str:
    """Format the position in words: "left center back"."""
    position = getattr(player, "starting_position", None)
    text = re.sub(r"\s+", " ", str(position or "")).strip().lower()
    return "" if text in ("unknown", "none") or "." in text else text


def find_pitch_size(dataset, pitch: tuple[float, float] | None, in_feed: bool) -> tuple[float, float, bool]:
    """Find the pitch's size.

    Args:
        dataset: kloppy's dataset.
        pitch: length and width in metres set by the user, or None.
        in_feed: whether the provider's files contain the size.
    Returns:
        Length and width in metres, and whether they are a default because neither the feed nor the user gives them.
    """
    size = dataset.metadata.pitch_dimensions
    length, width = size.pitch_length, size.pitch_width
    is_kloppy_default = size.unit.name == "NORMED" and (length, width) == USUAL_PITCH
    if length and width and not is_kloppy_default and in_feed:
        return float(length), float(width), False
    return (*(pitch or USUAL_PITCH), pitch is None)


def find_height_unit(dataset) -> float:
    """Find the unit of heights; feeds that scale the pitch to 0..1 have no heights, or metres.

    Args:
        dataset: kloppy's dataset.
    Returns:
        Metres per unit.
    """
    return 0.01 if dataset.metadata.coordinate_system.pitch_dimensions.unit.name == "CENTIMETERS" else 1.0


def build_metre_map(system, length: float, width: float, upward: bool):
    """Build the map from a provider's plane coordinates to metres.

    kloppy's own transformations pass through its standard pitch and bend positions between the lines; this one is
    linear.

    Args:
        system: kloppy's coordinate system.
        length, width: m, of the pitch.
        upward: whether y grows upward whatever the system says. kloppy flips the y of Metrica's CSV while reading but
            still calls it downward; Metrica's documentation (and the same match in TRACAB's format) shows that the
            file's own y is.
    Returns:
        A function of (..., 2) coordinates: metres from the pitch's centre, y to the left of +x.
    """
    size = system.pitch_dimensions
    x, y = size.x_dim, size.y_dim
    scale = {"METERS": (1.0, 1.0), "CENTIMETERS": (0.01, 0.01)}.get(size.unit.name)
    if scale is None:
        scale = length / (x.max - x.min), width / (y.max - y.min)
    ranges = ((0.0, length), (0.0, width)) if x.max is None or y.max is None else ((x.min, x.max), (y.min, y.max))
    middle = np.mean(ranges, axis=1)
    sign = -1.0 if system.vertical_orientation.name == "TOP_TO_BOTTOM" and not upward else 1.0
    return lambda points: (points - middle) * (scale[0], scale[1] * sign)
