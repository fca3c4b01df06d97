"""Tracking files as players: the players of a file, and the samples of one of them, or of the drawn track instead."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.files.joints.joint_readers import is_joint_file
from ...beyond_mocap.files.tracking import tracking
from ...beyond_mocap.files.tracking.feed import is_track_csv
from ...beyond_mocap.motion.track import clean_track
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, to_absolute_path
from . import drawn_track

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track import Track


class PlayerInFile(NamedTuple):
    """One player in a file.

    Attributes:
        name: for the list.
        feed_id: empty in a file about one player.
        team: "home", "away" or "referee".
        start, end: seconds on the file's clock.
    """

    name: str
    feed_id: str
    team: str
    start: float
    end: float


def list_players(path: str, metadata: str = "", provider: str = "") -> tuple[list[PlayerInFile], tuple[str, ...]]:
    """List the players of a tracking file, and notes on assumptions; InputError where it cannot be read."""
    if is_track_csv(Path(path)):
        track, _ = clean_track(_read_plain_track(path))  # refuses what is not a player's, such as centimetres
        return [PlayerInFile(Path(path).stem, "", "home", float(track.times.min()), float(track.times.max()))], ()
    match = read_match(path, metadata, provider)
    start, end = float(match.times[0]), float(match.times[-1])
    found = [PlayerInFile(_build_player_name(player), player.id, player.team, start, end) for player in match.players]
    return found, match.notes


def read_track(settings: BeyondMocapSettings, player: BeyondMocapPlayer, still: bool = False) -> "Track":
    """Read the samples of one player, within the settings' section for a whole match; still: see `read_drawn_track`."""
    if player.drawn_track is not None:
        return drawn_track.read_drawn_track(player.id_data, player.drawn_track, player.drawn_start, still)
    path = to_absolute_path(player.tracking_file)
    if not path:
        step = "choose one in step 2 or draw a track"
        raise InputError(f"player {player.name}", "no tracking file", "a file with positions", step,
                         fixes=(Fix("add_track"),))
    if not player.feed_id:
        return _read_plain_track(path)
    match = read_match(path, to_absolute_path(player.metadata_file), player.provider)
    end = settings.section_end if settings.section_end > settings.section_start else None
    return match.track(player.feed_id, settings.section_start, end)


def _read_plain_track(path: str) -> "Track":
    return _read_plain_cached(path, _read_stamp(path))


@lru_cache(maxsize=32)
def _read_plain_cached(path: str, _changed: tuple[int, int]) -> "Track":
    return tracking.read_track_csv(path)


def read_match(path: str, metadata: str = "", provider: str = "",
               pitch: tuple[float, float] | None = None) -> tracking.Match:
    """Read a whole match as its feed has it, once; InputError where it cannot be read.

    Args:
        path: the tracking file.
        metadata: the provider's second file; "" searches it.
        provider: its form; "" detects it.
        pitch: length and width, m, for a feed without them; None: those of a football pitch.
    Returns:
        The match.
    """
    return _read_match_cached(path, metadata or None, provider or None, _read_stamp(path), pitch)


def _read_stamp(path: str) -> tuple[int, int]:
    """Return a value that changes when a file is written again."""
    found = os.stat(path) if os.path.exists(path) else None
    return (found.st_mtime_ns, found.st_size) if found else (0, 0)


@lru_cache(maxsize=1)
def _read_match_cached(path: str, metadata: str | None, provider: str | None, _changed,
                       pitch: tuple[float, float] | None) -> tracking.Match:
    if not provider and is_joint_file(path):
        from ...beyond_mocap.match.known_bodies import read_joint_match  # imports scipy, which is slow

        return read_joint_match(path, pitch)[0]
    return tracking.read_match(path, metadata, provider, pitch=pitch)


def _build_player_name(player: tracking.MatchPlayer) -> str:
    return player.name or f"{player.team} {player.number if player.number >= 0 else player.id}"
