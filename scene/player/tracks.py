"""Tracking files as players: the players of a file, and the samples of one of them, or of the drawn track instead."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.files.tracking import tracking
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, absolute
from . import drawn_track

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track import Track


class Found(NamedTuple):
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


def players_in(path: str, metadata: str = "", provider: str = "") -> tuple[list[Found], tuple[str, ...]]:
    """List the players of a tracking file, and notes on assumptions; InputError where it cannot be read."""
    if is_plain(path):
        track = _plain(path)
        return [Found(Path(path).stem, "", "home", float(track.times.min()), float(track.times.max()))], ()
    match = match_of(path, metadata, provider)
    start, end = float(match.times[0]), float(match.times[-1])
    found = [Found(_spoken(player), player.id, player.team, start, end) for player in match.players]
    return found, match.notes


def read_track(settings: BeyondMocapSettings, player: BeyondMocapPlayer, still: bool = False) -> "Track":
    """Read the samples of one player, within the settings' section for a whole match; still: see `read_drawn_track`."""
    if player.drawn_track is not None:
        return drawn_track.read(player.id_data, player.drawn_track, player.drawn_start, still)
    path = absolute(player.tracking_file)
    if not path:
        step = "choose one in step 2 or draw a track"
        raise InputError(f"player {player.name}", "no tracking file", "a file with positions", step)
    if not player.feed_id:
        return _plain(path)
    match = match_of(path, absolute(player.metadata_file), player.provider)
    end = settings.section_end if settings.section_end > settings.section_start else None
    return match.track(player.feed_id, settings.section_start, end)


def is_plain(path: str) -> bool:
    """Whether this is a file of one player in our own form: its first line names the column time_s."""
    try:
        with open(path, "rb") as file:
            return b"time_s" in file.readline(4096)
    except OSError as error:
        raise InputError(path, error.strerror or "cannot be read", "a tracking file", "check the path") from None


def _plain(path: str) -> "Track":
    return _read_plain(path, _stamp(path))


@lru_cache(maxsize=32)
def _read_plain(path: str, _changed: tuple[int, int]) -> "Track":
    return tracking.read_track_csv(path)


def match_of(path: str, metadata: str = "", provider: str = "") -> tracking.Match:
    """Read a whole match as its feed has it, once; InputError where it cannot be read."""
    return _read_match(path, metadata or None, provider or None, _stamp(path))


def _stamp(path: str) -> tuple[int, int]:
    """Return a value that changes when a file is written again."""
    found = os.stat(path) if os.path.exists(path) else None
    return (found.st_mtime_ns, found.st_size) if found else (0, 0)


@lru_cache(maxsize=1)
def _read_match(path: str, metadata: str | None, provider: str | None, _changed) -> tracking.Match:
    return tracking.read_match(path, metadata, provider)


def _spoken(player: tracking.MatchPlayer) -> str:
    return player.name or f"{player.team} {player.number if player.number >= 0 else player.id}"
