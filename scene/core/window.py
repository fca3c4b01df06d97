"""Blender's windows: their editors, what is selected in them, and what is hung over them: drawing, the line in the
status bar, the clocks of operators that run. What is still there when the extension is switched off goes with it."""

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


def select_only(context: bpy.types.Context, *things: bpy.types.Object) -> None:
    """Let these objects be the selected ones, and the first of them active."""
    for other in context.selected_objects:
        other.select_set(False)
    for thing in things:
        thing.select_set(True)
    context.view_layer.objects.active = things[0]


def open_editor(context: bpy.types.Context, kind: str, direction: str, factor: float) -> bpy.types.Area | None:
    """The largest editor of a kind (an area's type); where there is none, the left or lower part of the largest 3D view
    becomes one.

    direction: "VERTICAL" splits into left and right, "HORIZONTAL" into below and above; factor: the new editor's share.
    None without a window, or where the screen has no 3D view to split."""
    window = context.window
    if bpy.app.background or window is None:
        return None
    return largest_editor(window.screen, kind) or _split(context, window, kind, direction, factor)


def free_region(area: bpy.types.Area, region: bpy.types.Region) -> tuple[float, float, float, float]:
    """The part of a region that no toolbar, sidebar, header or box of the last operator lies over, less a small margin:
    left, bottom, right, top in its pixels."""
    left, bottom, right, top = 0.0, 0.0, float(region.width), float(region.height)
    for other in area.regions:
        x, y = other.x - region.x, other.y - region.y
        over = x < region.width and y < region.height and x + other.width > 0 and y + other.height > 0
        if other.type == region.type or min(other.width, other.height) <= 1 or not over:
            continue
        if other.type == "HUD":  # stands free in the lower left corner: above it, or right of it where it is tall
            if y + other.height < 0.5 * region.height:
                bottom = max(bottom, y + other.height)
            else:
                left = max(left, x + other.width)
        elif other.height > other.width:
            left, right = (max(left, x + other.width), right) if x <= 0 else (left, min(right, x))
        else:
            bottom, top = (max(bottom, y + other.height), top) if y <= 0 else (bottom, min(top, y))
    return (left + 4, bottom + 4, max(right - 4, left + 40), max(top - 4, bottom + 20))


def largest_editor(screen: bpy.types.Screen, kind: str) -> bpy.types.Area | None:
    """The largest editor of a kind; None where there is none."""
    return max((area for area in screen.areas if area.type == kind), key=lambda a: a.width * a.height, default=None)


def _split(context, window, kind: str, direction: str, factor: float) -> bpy.types.Area | None:
    view = largest_editor(window.screen, "VIEW_3D")
    if view is None:
        return None
    before = {area.as_pointer() for area in window.screen.areas}
    with context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.screen.area_split(direction=direction, factor=factor)
    halves = [area for area in window.screen.areas if area.as_pointer() not in before]
    new = min((*halves, view), key=lambda area: area.x if direction == "VERTICAL" else area.y)
    new.type = kind
    return new
