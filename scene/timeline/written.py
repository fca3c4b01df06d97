"""A player's words as a text or file has them, before they become strips."""

from __future__ import annotations

from ...beyond_mocap.annotation import Timeline, parse_timeline, read_timeline
from ...beyond_mocap.motion.track import Track
from ..core.settings import BeyondMocapPlayer, absolute


def written_words(player: BeyondMocapPlayer, fps: float, track: Track) -> Timeline:
    """The words of the player's text or file, as they are before they become strips; fps: of times in frames."""
    start = float(track.times[0])
    if player.annotation_text is not None:
        return parse_timeline(player.annotation_text.as_string(), written_in(player), fps, start)
    if player.annotation_file:
        return read_timeline(written_in(player), fps, start)
    return Timeline()


def written_in(player: BeyondMocapPlayer) -> str:
    """The text or file with the player's words, for messages."""
    if player.annotation_text is not None:
        return f"text {player.annotation_text.name}"
    return absolute(player.annotation_file) or f"player {player.name}"
