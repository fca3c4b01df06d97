"""Which seconds of whose take are meant: by a selected strip, a selected span of words, or the preview range."""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import InputError
from ..core.measure import scene_clock
from ..core.settings import BeyondMocapPlayer, active_player
from ..timeline import lanes, strips
from . import blocks


def selected(scene: bpy.types.Scene) -> tuple[BeyondMocapPlayer, float, float]:
    """Player and seconds on the track's clock; InputError where nothing says which."""
    clock = scene_clock(scene)
    for player in scene.beyond_mocap.players:
        frames = _of_result(player) or _of_words(player, scene)
        if frames is not None:
            return player, clock.seconds(frames[0]), clock.seconds(frames[1])
    player = player_shown(scene)
    if player is not None and scene.use_preview_range:
        return player, clock.seconds(scene.frame_preview_start), clock.seconds(scene.frame_preview_end)
    raise InputError("a stretch made anew", "nothing says which seconds", "a selected strip or a preview range",
                     "select a strip in the NLA editor, or press P in the timeline and draw a range")


def player_shown(scene: bpy.types.Scene) -> BeyondMocapPlayer | None:
    """The active player, where it has a take; else None."""
    player = active_player(scene.beyond_mocap)
    return player if player is not None and player.take else None


def _of_result(player: BeyondMocapPlayer) -> tuple[float, float] | None:
    """The frames of the selected strips of an accepted result."""
    track = blocks.track_of(player.body) if player.body is not None else None
    chosen = [strip for strip in track.strips if strip.select] if track is not None and player.body.select_get() else []
    if not chosen or len(chosen) == len(track.strips) > 1:
        return None
    return min(strip.frame_start for strip in chosen), max(strip.frame_end for strip in chosen)


def _of_words(player: BeyondMocapPlayer, scene: bpy.types.Scene) -> tuple[float, float] | None:
    """The frames of the selected spans of words on a player's selected dot."""
    dot = strips.dot_of(player, scene)
    if dot is None or not player.take or not dot.select_get():
        return None
    chosen = [strip for _, strip in lanes.strips(dot) if strip.select and strip.action.beyond_mocap.kind != "moments"]
    if not chosen:
        return None
    return min(strip.frame_start for strip in chosen), max(strip.frame_end for strip in chosen)
