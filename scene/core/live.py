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
IDLE_SECONDS = 0.15  # seconds without a change after which the user is idle
DRAG_OPERATORS = ("TRANSFORM_OT", "CURVE_OT", "VIEW3D_OT_cursor3d")  # operators during which the user is not idle
# Seconds between two polls up to so many seconds after a change, for watchers that follow a drag.
BUSY_TICK, BUSY_SECONDS = 0.01, 0.5
PAUSE_SHARE = 0.3  # share of the time taken by an update that is left to the window before the next poll
EVENTS = {  # Blender's handler -> the watcher's callback, and how many of Blender's arguments it gets
    "depsgraph_update_post": ("changed", 2), "frame_change_pre": ("framing", 1), "frame_change_post": ("framed", 1),
    "undo_post": ("restored", 0), "redo_post": ("restored", 0), "load_post": ("loaded", 0), "load_pre": ("closing", 0),
    "save_pre": ("saving", 0),
}
WINDOW_EVENTS = {"changed", "framing", "framed"}
STATE_EVENTS = {"restored", "loaded"}

_watchers: list[Watcher] = []
_handlers: list[tuple[str, Callable]] = []
_timers: dict[Callable, Callable] = {}  # action -> the function that Blender calls for it
_reported: set[tuple] = set()


@dataclass(eq=False, repr=False, kw_only=True)
class Watcher:
    """What one feature watches, and what it does then. It has at most one of `follow`, `settle` and `look`.

    A function of a module that enabling need not load is given as a lambda: `restored=lambda: shots.clear_strikes()`.

    Attributes:
        name: shown to the user if it fails.
        watched_types: types of data; a change of such data marks the watcher.
        changed: (scene, depsgraph), after each change; only with a window.
        framing: (scene), after each change of frame and before it is evaluated; only with a window.
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
    watched_types: tuple[type, ...] = ()
    changed: Callable[[bpy.types.Scene, bpy.types.Depsgraph], None] | None = None
    framing: Callable[[bpy.types.Scene], None] | None = None
    framed: Callable[[bpy.types.Scene], None] | None = None
    restored: Callable[[], None] | None = None
    loaded: Callable[[], None] | None = None
    closing: Callable[[], None] | None = None
    saving: Callable[[], None] | None = None
    follow: Callable[[bpy.types.Scene], None] | None = None
    settle: Callable[[bpy.types.Scene], bool | None] | None = None
    dragged: Callable[[bpy.types.Scene], None] | None = None
    busy_operators: tuple[str, ...] = ()
    look: Callable[[], float] | None = None
    draws: tuple[tuple[type, Callable, str], ...] = ()
    ends: Callable[[], None] | None = None
    dirty: bool = field(default=True, init=False)
    changed_at: float = field(default=0.0, init=False)

    def __post_init__(self):
        if self.watched_types:
            self.changed = self._mark_if_watched
        _watchers.append(self)

    def mark_dirty(self) -> None:
        """Mark the watcher: something that may matter has changed."""
        self.dirty, self.changed_at = True, perf_counter()

    def handle_event(self, event: str, *arguments) -> None:
        """Handle an event.

        Args:
            event: one of the values of EVENTS.
            arguments: passed on.
        """
        action = getattr(self, event)
        if action is not None:
            call_guarded(self.name, lambda: action(*arguments),
                         clears_failure=not (self.look or self.follow or self.settle))
        if event in STATE_EVENTS:
            self.mark_dirty()

    def run_tick(self) -> float:
        """Poll once; return the seconds until the next poll."""
        act = self.look or (self._run_follow if self.follow else self._run_settle)
        return call_guarded(self.name, act, IDLE,
                            clears_failure=bool(self.look))  # the others clear failures after work

    def _mark_if_watched(self, _scene, depsgraph) -> None:
        if any(isinstance(update.id, self.watched_types) for update in depsgraph.updates):
            self.mark_dirty()

    def _run_follow(self) -> float:
        """Call `follow` for the scene of each window if the watcher is marked; return the seconds until the next
        poll.
        """
        if not self.dirty or bpy.app.is_job_running("RENDER"):
            return BUSY_TICK if perf_counter() - self.changed_at < BUSY_SECONDS else TICK
        self.dirty, began, scenes = False, perf_counter(), set()
        for displayed in bpy.context.window_manager.windows:
            if displayed.scene.session_uid not in scenes:
                scenes.add(displayed.scene.session_uid)
                with bpy.context.temp_override(window=displayed):
                    self.follow(displayed.scene)
        _clear_failure(f"{self.name} has failed")
        return max(BUSY_TICK, PAUSE_SHARE * (perf_counter() - began))

    def _run_settle(self) -> float:
        """Call `settle` if the watcher is marked and the user is idle; return the seconds until the next poll."""
        displayed = next(iter(bpy.context.window_manager.windows), None)
        if not self.dirty or displayed is None or bpy.app.is_job_running("RENDER"):
            return TICK
        if is_running(DRAG_OPERATORS + self.busy_operators):
            if self.dragged:
                self.dragged(displayed.scene)
        elif perf_counter() - self.changed_at > IDLE_SECONDS:
            self.dirty = False
            with bpy.context.temp_override(window=displayed):
                again = self.settle(displayed.scene)  # may mark it again
            _clear_failure(f"{self.name} has failed")
            self.dirty = self.dirty or bool(again)
        return TICK


def mark_watcher(name: str) -> None:
    """Mark the watcher of this name, for modules that the watcher's own module imports."""
    next(watcher for watcher in _watchers if watcher.name == name).mark_dirty()


def is_running(prefixes: tuple[str, ...]) -> bool:
    """Return whether an operator whose name begins with one of these runs in any window."""
    windows = bpy.context.window_manager.windows
    return any(one.bl_idname.startswith(prefixes) for displayed in windows for one in displayed.modal_operators)


def is_playing() -> bool:
    """Return whether the animation plays in any window."""
    return any(displayed.screen.is_animation_playing for displayed in bpy.context.window_manager.windows)


def call_guarded(name: str, action: Callable[[], Any], fallback: Any = None, clears_failure: bool = True) -> Any:
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
        _report_failure(f"{name} has failed", error)
        return fallback
    if clears_failure:
        _clear_failure(f"{name} has failed")
    return result


def call_or_describe(action: Callable[[], Any], describe: Callable[[str], Any], failed: str) -> Any:
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
        return describe(str(error))
    except Exception as error:  # one failure must not stop the others
        _report_failure(failed, error)
        return describe(_format_failure(failed))
    _clear_failure(failed)
    return result


def call_soon(action: Callable[[], float | None], seconds: float) -> None:
    """Call an action in so many seconds, and again as long as it returns seconds.

    Nothing happens if it is scheduled already, or without a window.
    """
    def call() -> float | None:
        del _timers[action]  # it may be scheduled again while it runs
        wait = call_guarded(getattr(action, "__name__", "timer"), action)
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
        if not (bpy.app.background and what in WINDOW_EVENTS):
            _handlers.append((handler, _build_handler(what, count)))
            getattr(bpy.app.handlers, handler).append(_handlers[-1][1])
    for watcher in _watchers:
        for drawing in watcher.draws:
            window.add_overlay(*drawing)
        if watcher.look or watcher.follow or watcher.settle:
            call_soon(watcher.run_tick, 1.0)


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
            call_guarded(watcher.name, watcher.ends, clears_failure=False)
        watcher.dirty = True
    window.clear_windows()
    _reported.clear()


def _build_handler(event: str, count: int) -> Callable:
    """Build the handler that passes an event to all watchers."""
    @persistent
    def call(*arguments):
        for watcher in _watchers:
            watcher.handle_event(event, *arguments[:count])

    return call


def _report_failure(failed: str, error: Exception) -> None:
    """Show in the panel that something failed, and print the traceback; the same one is printed only once."""
    places = traceback.extract_tb(error.__traceback__)
    seen = (failed, type(error), places[-1].filename, places[-1].lineno)
    if seen not in _reported:
        _reported.add(seen)
        traceback.print_exception(error)
    bpy.context.window_manager.beyond_mocap_work.trouble = _format_failure(failed)


def _clear_failure(failed: str) -> None:
    """Clear a failure from the panel once the action succeeds."""
    work = bpy.context.window_manager.beyond_mocap_work
    if work.trouble == _format_failure(failed):
        work.trouble = ""
        window.redraw_editors()


def _format_failure(failed: str) -> str:
    return f"{failed}; see the system console"
