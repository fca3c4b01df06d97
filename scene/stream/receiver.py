"""The one listener of the session: begun and ended by the user, ended too when a file is loaded or the add-on goes."""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.passes.stream.bvh_stream import hierarchy_of
from ...beyond_mocap.passes.stream.listener import Listener
from ...beyond_mocap.passes.stream.live_hits import LiveHits
from ..core.live import Watcher

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


WATCHER = Watcher(name="Stream's listener", closing=stop, ends=stop)
