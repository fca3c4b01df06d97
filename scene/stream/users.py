"""Whose strikes a player of Play Live repeats: those of the user of their own stream, or of one without a player."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.errors import InputError
from . import follow

if TYPE_CHECKING:
    from .settings import StreamSettings


def check_players(scene: bpy.types.Scene) -> None:
    """Raise an InputError if the player of a stream that is received is not in the passing scene."""
    names = [row.name for row in scene.beyond_mocap_passes.players]
    for stream in follow.list_received(scene):
        if stream.player and stream.player not in names:
            raise InputError(f"stream {stream.number}", f"no player {stream.player!r} in the passing scene",
                             f"one of {', '.join(names)}", "press Stop Stream, and choose one under Player, or none")


def list_own_streams(scene: bpy.types.Scene, name: str) -> list[StreamSettings]:
    """List the streams whose strikes a player repeats: their own, otherwise those of no player, otherwise all."""
    received = follow.list_received(scene)
    own = [stream for stream in received if stream.player == name]
    return own or [stream for stream in received if not stream.player] or received


def find_main_stream(scene: bpy.types.Scene, name: str) -> StreamSettings:
    """Find the stream that says what counts as a player's strike: their own, or the scene's first one."""
    return next(iter(list_own_streams(scene, name)), scene.beyond_mocap_stream)
