"""What looks for changes: Blender's handlers and a timer, put on and taken off together."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable

import bpy

Handlers = Iterable[tuple[str, Callable]]
"""(name in `bpy.app.handlers`, function) pairs."""


def put_on(handlers: Handlers, tick: Callable, first: float, with_window: Container[str] = ()) -> None:
    """Call handlers from now on, and `tick` from a timer, for the first time in `first` seconds. Under -b there is no
    timer, nor are there the handlers that `with_window` names."""
    for name, handler in handlers:
        if name not in with_window or not bpy.app.background:
            getattr(bpy.app.handlers, name).append(handler)
    if not bpy.app.background:
        bpy.app.timers.register(tick, first_interval=first, persistent=True)


def take_off(handlers: Handlers, tick: Callable) -> None:
    """Call none of them any more."""
    for name, handler in handlers:
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
