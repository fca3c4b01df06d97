"""What the settings ask for, as the core's plans."""

from __future__ import annotations

from ...beyond_mocap.annotation import Timeline
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion.track import Track, clean
from ...beyond_mocap.synthesis.plan import Plan
from ..core.properties import property_values
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, absolute
from ..player import pins
from ..player.tracks import read_track
from ..timeline import strips
from ..timeline.strips import written_in, written_words


def chosen(settings: BeyondMocapSettings) -> list[BeyondMocapPlayer]:
    """The players that are switched on; InputError where there is none."""
    players = [player for player in settings.players if player.use]
    if not players:
        raise InputError("players", "none is ticked", "at least one", "import tracking in step 2 and tick a player")
    return players


def plan_of(
    settings: BeyondMocapSettings, player: BeyondMocapPlayer, still: bool = False
) -> tuple[Plan, tuple[str, ...]]:
    """The plan of one player, and what in the track asks for attention; still: see `drawn_track.read`."""
    track, found = clean(read_track(settings, player, still))
    plan = Plan(
        track=track,
        timeline=timeline_of(player, settings.rate, track),
        library=absolute(settings.library_folder),
        pins=pins.read(player.id_data, player),
        **property_values(Plan, settings, "synthesis"),
        **property_values(Plan, player, "player"),
    )
    return plan, found.warnings


def timeline_of(player: BeyondMocapPlayer, fps: float, track: Track) -> Timeline:
    """The player's words: from his strips, else from the text of this file, else from the file on disk, else none (all
    automatic)."""
    asked = strips.read(player, player.id_data)
    return written_words(player, fps, track) if asked is None else asked


def words_from(player: BeyondMocapPlayer) -> str:
    """Where the words that count are written, for messages."""
    return written_in(player) if strips.dot_of(player, player.id_data) is None else strips.where(player)
