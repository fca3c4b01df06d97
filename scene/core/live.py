"""The one listener to Blender: its handlers, its timers, undo and redo, files, and the end of the extension.

A feature makes one `Watcher` at the top of its module: what it watches, and what it does then. Blender calls one
handler for each kind of event, and one timer for each watcher that looks for itself. What raises is reported once, and
everything else, and the next look too, goes on; the panel says so until the same succeeds. `unregister` takes all of it
away.

Without a window Blender calls no timer, and what scripts edit is not watched: they ask for what they want. Undo, redo
and files are followed there too.
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

TICK, IDLE = 0.05, 0.4  # seconds between two looks: usually, and where there is no window or a look has failed
RESTED = 0.15  # seconds without a change after which the user's hand rests
HOLDING = ("TRANSFORM_OT", "CURVE_OT", "VIEW3D_OT_cursor3d")  # operators during which it does not
BUSY_TICK, BUSY = 0.01, 0.5  # seconds between two looks until so many seconds after a change, where one follows a drag
SHARE = 0.3  # of the time that following has taken is left to the window before the next look
EVENTS = {  # Blender's handler -> what of a watcher it calls, with how many of Blender's arguments
    "depsgraph_update_post": ("changed", 2), "frame_change_post": ("framed", 1), "undo_post": ("restored", 0),
    "redo_post": ("restored", 0), "load_post": ("loaded", 0), "load_pre": ("closing", 0), "save_pre": ("saving", 0),
}
WITH_WINDOW = {"changed", "framed"}
ANOTHER_STATE = {"restored", "loaded"}

_watchers: list[Watcher] = []
_handlers: list[tuple[str, Callable]] = []
_timers: dict[Callable, Callable] = {}  # what is to be done -> the function that Blender calls for it
_reported: set[tuple] = set()


@dataclass(eq=False, kw_only=True)
class Watcher:
    """What one feature watches, and what it does then. Of `follow`, `settle` and `look` it has one at most.

    name: what the user calls it, where it fails
    matters: types of data; a change of such data marks the watcher
    changed(scene, depsgraph), framed(scene): after each change, each change of frame; only with a window
    restored(): undo or redo has brought back another state; it marks the watcher too, as a file that is opened does
    loaded(), closing(), saving(): a file has been opened, is about to be closed, to be saved
    follow(scene): once marked, brings each window's scene up to date, also while the user drags
    settle(scene): once marked and the user's hand rests; whether to call it again though nothing changes
    dragged(scene): in place of `settle` while the hand does not rest
    held_by: names of operators, beside HOLDING, during which the hand does not rest
    look(): called all the time; seconds until the next time
    draws: (type of space, function, "POST_VIEW" or "POST_PIXEL") of what is drawn over its main regions
    ends(): the extension is switched off: stop what runs, forget what was made"""

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
        """Something has changed that may matter."""
        self.dirty, self.since = True, perf_counter()

    def hear(self, what: str, *arguments) -> None:
        """Take in an event: `what` is one of the values of EVENTS."""
        action = getattr(self, what)
        if action is not None:
            guard(self.name, lambda: action(*arguments), counts=not (self.look or self.follow or self.settle))
        if what in ANOTHER_STATE:
            self.mark()

    def tick(self) -> float:
        """One look by the timer; seconds until the next."""
        act = self.look or (self._follow if self.follow else self._settle)
        return guard(self.name, act, IDLE, counts=bool(self.look))  # the others count where there was something to do

    def _mark_what_matters(self, _scene, depsgraph) -> None:
        if any(isinstance(update.id, self.matters) for update in depsgraph.updates):
            self.mark()

    def _follow(self) -> float:
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
        shown = next(iter(bpy.context.window_manager.windows), None)
        if not self.dirty or shown is None or bpy.app.is_job_running("RENDER"):
            return TICK
        if is_running(HOLDING + self.held_by):
            if self.dragged:
                self.dragged(shown.scene)
        elif perf_counter() - self.since > RESTED:
            self.dirty = False
            with bpy.context.temp_override(window=shown):
                again = self.settle(shown.scene)  # which may mark it meanwhile
            _take_back(f"{self.name} has failed")
            self.dirty = self.dirty or bool(again)
        return TICK


def mark(name: str) -> None:
    """Mark the watcher of this name. For modules that the watcher's own module imports."""
    next(watcher for watcher in _watchers if watcher.name == name).mark()


def is_running(prefixes: tuple[str, ...]) -> bool:
    """Whether an operator whose name begins with one of these runs in any window."""
    windows = bpy.context.window_manager.windows
    return any(one.bl_idname.startswith(prefixes) for shown in windows for one in shown.modal_operators)


def is_playing() -> bool:
    """Whether the scene plays in any window."""
    return any(shown.screen.is_animation_playing for shown in bpy.context.window_manager.windows)


def guard(name: str, action: Callable[[], Any], otherwise: Any = None, counts: bool = True) -> Any:
    """What `action` returns; `otherwise` where it raises, which is reported once under this name. counts: whether the
    panel stops saying so where it does not raise."""
    try:
        result = action()
    except Exception as error:  # a timer that raises is never called again
        _report(f"{name} has failed", error)
        return otherwise
    if counts:
        _take_back(f"{name} has failed")
    return result


def attempt(action: Callable[[], Any], tell: Callable[[str], Any], failed: str) -> Any:
    """What `action` returns. Where it raises, `tell` is called with the reason, or with `failed` where that is no
    BeyondMocapError, which is reported too; then what `tell` returns."""
    try:
        result = action()
    except BeyondMocapError as error:
        return tell(str(error))
    except Exception as error:  # one that fails must not keep the others from being looked at
        _report(failed, error)
        return tell(_message(failed))
    _take_back(failed)
    return result


def soon(action: Callable[[], float | None], seconds: float) -> None:
    """Call `action` in so many seconds, and again as long as it returns seconds. Nothing happens where it is to be
    called already, or without a window."""
    def call() -> float | None:
        del _timers[action]  # it may be asked for again while it runs
        wait = guard(getattr(action, "__name__", "timer"), action)
        if wait is not None and action not in _timers:
            _timers[action] = call
            return wait
        return None

    if not bpy.app.background and action not in _timers:
        _timers[action] = call
        bpy.app.timers.register(call, first_interval=seconds, persistent=True)


def start_watching() -> None:
    """Listen, draw and look from now on, for all watchers."""
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
    """Nothing is called any more, and nothing of ours is left in the windows; each watcher ends."""
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
    @persistent
    def call(*arguments):
        for watcher in _watchers:
            watcher.hear(what, *arguments[:count])

    return call


def _report(failed: str, error: Exception) -> None:
    """Tell the panel that something `failed`, and print where; the same is printed once."""
    places = traceback.extract_tb(error.__traceback__)
    seen = (failed, type(error), places[-1].filename, places[-1].lineno)
    if seen not in _reported:
        _reported.add(seen)
        traceback.print_exception(error)
    bpy.context.window_manager.beyond_mocap_work.trouble = _message(failed)


def _take_back(failed: str) -> None:
    """The panel says no more that something `failed`, since it has succeeded."""
    work = bpy.context.window_manager.beyond_mocap_work
    if work.trouble == _message(failed):
        work.trouble = ""
        window.redraw()


def _message(failed: str) -> str:
    return f"{failed}; see the system console"
