"""What is hung over Blender's windows: drawing, the line in the status bar, the clocks of operators that run. Whatever
is still there when the extension is switched off goes with it."""

from __future__ import annotations

from collections.abc import Callable

import bpy

_drawn: list[tuple[type, Callable, object]] = []  # type of space, function, Blender's handle
_clocks: list[bpy.types.Timer] = []


def draw(space: type, function: Callable[[], None], when: str = "POST_PIXEL") -> None:
    """Call `function` from now on whenever the main region of such a space is drawn; never without a window."""
    if not bpy.app.background:
        _drawn.append((space, function, space.draw_handler_add(function, (), "WINDOW", when)))


def undraw(function: Callable[[], None]) -> None:
    """Call it no more, in no space."""
    for one in [one for one in _drawn if one[1] == function]:
        one[0].draw_handler_remove(one[2], "WINDOW")
        _drawn.remove(one)


def redraw(*kinds: str) -> None:
    """Let all editors of these kinds be drawn again, 3D views where none is given: what is drawn over them is no data
    that Blender watches."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in (kinds or ("VIEW_3D",)):
                area.tag_redraw()


def start_clock(context: bpy.types.Context) -> bpy.types.Timer:
    """Events of a timer for an operator that polls a thread, and progress at the pointer. Returns the timer."""
    windows = context.window_manager
    clock = windows.event_timer_add(0.05, window=context.window)
    windows.progress_begin(0, 100)
    _clocks.append(clock)
    return clock


def stop_clock(context: bpy.types.Context, clock: bpy.types.Timer) -> None:
    """End both, and clear the status bar."""
    if clock in _clocks:
        _clocks.remove(clock)
    context.window_manager.event_timer_remove(clock)
    context.window_manager.progress_end()
    clear_status()


def clear_status() -> None:
    """Take our line off the status bar of every workspace: the user may have gone to another one meanwhile."""
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(None)


def clear() -> None:
    """Take everything away."""
    while _clocks:
        stop_clock(bpy.context, _clocks[-1])
    for _, function, _ in list(_drawn):
        undraw(function)
    clear_status()
