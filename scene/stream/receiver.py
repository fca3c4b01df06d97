"""The one listener of the session: begun and ended by the user, ended too when a file is loaded or the add-on goes."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.errors import InputError
from ...beyond_mocap.stream.bvh_stream import hierarchy_of
from ...beyond_mocap.stream.listener import Listener
from ...beyond_mocap.stream.live_hits import LiveHits

_held: dict[str, object] = {}


def start(settings) -> Listener:
    """Listen as the settings say. InputError where the port is taken or the suit's file is none; then nothing has
    changed."""
    clip = bpy.path.abspath(settings.clip) if settings.clip else ""
    hierarchy = hierarchy_of(clip) if clip else None
    before = listener()
    if before is not None:
        raise InputError(f"port {before.port}", "a stream is listened to already", "one at a time", "press Stop Stream")
    one = Listener(settings.port, settings.protocol, hierarchy, settings.unit or None).start()
    _held["listener"] = one
    _held["hits"] = LiveHits(
        one, settings.part, "" if settings.side == "either" else settings.side, settings.threshold or None
    )
    return one


def stop() -> None:
    """Listen no more."""
    one = _held.pop("listener", None)
    _held.clear()
    if one is not None:
        one.stop()


def listener() -> Listener | None:
    """The listener, where there is one."""
    return _held.get("listener")


def hits() -> LiveHits | None:
    """What watches it for strikes."""
    return _held.get("hits")


@persistent
def _before_load(*_):
    from . import play

    play.stop()
    stop()


def register():
    """End with the file."""
    bpy.app.handlers.load_pre.append(_before_load)


def unregister():
    """End with the add-on."""
    stop()
    if _before_load in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.remove(_before_load)
