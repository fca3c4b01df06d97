"""The only listener to Blender: its handlers, timers, undo and redo, files, and the end of the extension.

A feature creates one `Watcher` at the top of its module, with what it watches and what it does then. Blender calls one
handler for each kind of event, and one timer for each watcher that polls. An exception is reported once; everything
else, and the next poll, continues, and the panel shows the failure until the same action succeeds. `unregister` removes
everything.

Without a window Blender calls no timer, and edits of scripts are not watched: scripts call what they need. Undo, redo
and files are watched there too.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...beyond_mocap.base.errors import BeyondMocapError
from . import window

TICK, IDLE = 0.05, 0.4  # seconds between two polls: usually, and without a window or after a failure
RESTED = 0.15  # seconds without a change after which the user is idle
HOLDING = ("TRANSFORM_OT", "CURVE_OT", "VIEW3D_OT_cursor3d")  # operators during which the user is not idle
# Seconds between two polls up to so many seconds after a change, for watchers that follow a drag.
BUSY_TICK, BUSY = 0.01, 0.5
SHARE = 0.3  # share of the time taken by an update that is left to the window before the next poll
EVENTS = {  # Blender's handler -> the watcher's callback, and how many of Blender's arguments it gets
    "depsgraph_update_post": ("changed", 2), "frame_change_post": ("framed", 1), "undo_post": ("restored", 0),
    "redo_post": ("restored", 0), "load_post": ("loaded", 0), "load_pre": ("closing", 0), "save_pre": ("saving", 0),
}
WITH_WINDOW = {"changed", "framed"}
ANOTHER_STATE = {"restored", "loaded"}

_watchers: list[Watcher] = []
_handlers: list[tuple[str, Callable]] = []
_timers: dict[Callable, Callable] = {}  # action -> the function that Blender calls for it
_reported: set[tuple] = set()


@dataclass(eq=False, kw_only=True)
class Watcher:
    """What one feature watches, and what it does then. It has at most one of `follow`, `settle` and `look`.

    Attributes:
        name: shown to the user if it fails.
        watched_types: types of data; a change of such data marks the watcher.
        changed: (scene, depsgraph), after each change; only with a window.
        framed: (scene), after each change of frame; only with a window.
        restored: after undo or redo, which also marks the watcher, as does opening a file.
        loaded: after a file was opened.
        closing: before a file is closed.
        saving: before a file is saved.
        follow: (scene), once marked, updates each window's scene, also while the user drags.
        settle: (scene), once marked and the user is idle; returns whether to call it again without a change.
        dragged: (scene), replaces `settle` while the user is not idle.
        busy_operators: names of further operators during which the user is not idle.
        look: called continuously; returns the seconds until the next call.
        draws: (type of space, function, "POST_VIEW" or "POST_PIXEL") of overlays in its main regions.
        ends: called when the extension is disabled: stop what runs, clear what was stored.
        dirty: whether it is marked.
        changed_at: time of the last change.
    """

    name: str
    matters: tuple[type, ...] = ()
    changed: Callable[[bpy.types.Scene, bpy.types.Depsgraph], None] | None = None
    framed: Callable[[bpy.types.Scene], None] | None = None
    restored: Callable[[], None] | None = None
    loaded: Callable[[], None] | None = None
    closing: Callable[[], None] | None = None
    saving: Callable[[], None] | None = None
    follow: Callable[[bpy.types.Scene], None] | None = None
    settle: Callable[[bpy.types.Scene], bool | None] | None = None
    dragged: Callable[[bpy.types.Scene], None] | None = None
    held_by: tuple[str, ...] = ()
    look: Callable[[], float] | None = None
    draws: tuple[tuple[type, Callable, str], ...] = ()
    ends: Callable[[], None] | None = None
    dirty: bool = field(default=True, init=False)
    since: float = field(default=0.0, init=False)

    def __post_init__(self):
        if self.matters:
            self.changed = self._mark_what_matters
        _watchers.append(self)

    def mark(self) -> None:
        """Mark the watcher: something that may matter has changed."""
        self.dirty, self.since = True, perf_counter()

    def hear(self, what: str, *arguments) -> None:
        """Handle an event.

        Args:
            event: one of the values of EVENTS.
            arguments: passed on.
        """
        action = getattr(self, what)
        if action is not None:
            guard(self.name, lambda: action(*arguments), counts=not (self.look or self.follow or self.settle))
        if what in ANOTHER_STATE:
            self.mark()

    def tick(self) -> float:
        """Poll once; return the seconds until the next poll."""
        act = self.look or (self._follow if self.follow else self._settle)
        return guard(self.name, act, IDLE, counts=bool(self.look))  # the others clear failures after work

    def _mark_what_matters(self, _scene, depsgraph) -> None:
        if any(isinstance(update.id, self.matters) for update in depsgraph.updates):
            self.mark()

    def _follow(self) -> float:
        """Call `follow` for the scene of each window if the watcher is marked; return the seconds until the next
        poll.
        """
        if not self.dirty or bpy.app.is_job_running("RENDER"):
            return BUSY_TICK if perf_counter() - self.since < BUSY else TICK
        self.dirty, begun, scenes = False, perf_counter(), set()
        for shown in bpy.context.window_manager.windows:
            if shown.scene.session_uid not in scenes:
                scenes.add(shown.scene.session_uid)
                with bpy.context.temp_override(window=shown):
                    self.follow(shown.scene)
        _take_back(f"{self.name} has failed")
        return max(BUSY_TICK, SHARE * (perf_counter() - begun))

    def _settle(self) -> float:
        """Call `settle` if the watcher is marked and the user is idle; return the seconds until the next poll."""
        shown = next(iter(bpy.context.window_manager.windows), None)
        if not self.dirty or shown is None or bpy.app.is_job_running("RENDER"):
            return TICK
        if is_running(HOLDING + self.held_by):
            if self.dragged:
                self.dragged(shown.scene)
        elif perf_counter() - self.since > RESTED:
            self.dirty = False
            with bpy.context.temp_override(window=shown):
                again = self.settle(shown.scene)  # may mark it again
            _take_back(f"{self.name} has failed")
            self.dirty = self.dirty or bool(again)
        return TICK


def mark(name: str) -> None:
    """Mark the watcher of this name, for modules that the watcher's own module imports."""
    next(watcher for watcher in _watchers if watcher.name == name).mark()


def is_running(prefixes: tuple[str, ...]) -> bool:
    """Return whether an operator whose name begins with one of these runs in any window."""
    windows = bpy.context.window_manager.windows
    return any(one.bl_idname.startswith(prefixes) for shown in windows for one in shown.modal_operators)


def is_playing() -> bool:
    """Return whether the animation plays in any window."""
    return any(shown.screen.is_animation_playing for shown in bpy.context.window_manager.windows)


def guard(name: str, action: Callable[[], Any], otherwise: Any = None, counts: bool = True) -> Any:
    """Call an action; report an exception once under this name.

    Args:
        name: of what runs.
        action: the function.
        fallback: returned after an exception.
        clears_failure: whether success clears an earlier failure from the panel.
    Returns:
        What the action returns.
    """
    try:
        result = action()
    except Exception as error:  # a timer that raises is never called again
        _report(f"{name} has failed", error)
        return otherwise
    if counts:
        _take_back(f"{name} has failed")
    return result


def attempt(action: Callable[[], Any], tell: Callable[[str], Any], failed: str) -> Any:
    """Call an action; describe an exception.

    Args:
        action: the function.
        describe: called with the reason of a BeyondMocapError, or with `failed` for any other exception, which is also
            reported.
        failed: message for an exception that is no BeyondMocapError.
    Returns:
        What the action returns, or after an exception what `describe` returns.
    """
    try:
        result = action()
    except BeyondMocapError as error:
        return tell(str(error))
    except Exception as error:  # one failure must not stop the others
        _report(failed, error)
        return tell(_message(failed))
    _take_back(failed)
    return result


def soon(action: Callable[[], float | None], seconds: float) -> None:
    """Call an action in so many seconds, and again as long as it returns seconds.

    Nothing happens if it is scheduled already, or without a window.
    """
    def call() -> float | None:
        del _timers[action]  # it may be scheduled again while it runs
        wait = guard(getattr(action, "__name__", "timer"), action)
        if wait is not None and action not in _timers:
            _timers[action] = call
            return wait
        return None

    if not bpy.app.background and action not in _timers:
        _timers[action] = call
        bpy.app.timers.register(call, first_interval=seconds, persistent=True)


def start_watching() -> None:
    """Start handlers, overlays and timers for all watchers."""
    for handler, (what, count) in EVENTS.items():
        if not (bpy.app.background and what in WITH_WINDOW):
            _handlers.append((handler, _handler(what, count)))
            getattr(bpy.app.handlers, handler).append(_handlers[-1][1])
    for watcher in _watchers:
        for drawing in watcher.draws:
            window.draw(*drawing)
        if watcher.look or watcher.follow or watcher.settle:
            soon(watcher.tick, 1.0)


def stop_watching() -> None:
    """Stop all handlers and timers, remove overlays from the windows, and end each watcher."""
    while _handlers:
        handler, function = _handlers.pop()
        if function in getattr(bpy.app.handlers, handler):
            getattr(bpy.app.handlers, handler).remove(function)
    while _timers:
        _, call = _timers.popitem()
        if bpy.app.timers.is_registered(call):
            bpy.app.timers.unregister(call)
    for watcher in reversed(_watchers):
        if watcher.ends:
            guard(watcher.name, watcher.ends, counts=False)
        watcher.dirty = True
    window.clear()
    _reported.clear()


def _handler(what: str, count: int) -> Callable:
    """Build the handler that passes an event to all watchers."""
    @persistent
    def call(*arguments):
        for watcher in _watchers:
            watcher.hear(what, *arguments[:count])

    return call


def _report(failed: str, error: Exception) -> None:
    """Show in the panel that something failed, and print the traceback; the same one is printed only once."""
    places = traceback.extract_tb(error.__traceback__)
    seen = (failed, type(error), places[-1].filename, places[-1].lineno)
    if seen not in _reported:
        _reported.add(seen)
        traceback.print_exception(error)
    bpy.context.window_manager.beyond_mocap_work.trouble = _message(failed)


def _take_back(failed: str) -> None:
    """Clear a failure from the panel once the action succeeds."""
    work = bpy.context.window_manager.beyond_mocap_work
    if work.trouble == _message(failed):
        work.trouble = ""
        window.redraw()


def _message(failed: str) -> str:
    return f"{failed}; see the system console"
