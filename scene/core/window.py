"""Blender's windows: editors, selection, overlays, the line in the status bar, and timers of running operators.

Whatever is left when the extension is disabled is removed.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from .measure import units_per_metre

_draw_handlers: list[tuple[type, Callable, object]] = []  # type of space, function, Blender's handle
_timers: list[bpy.types.Timer] = []
_status: list[str] = []  # our line in the status bar


def add_overlay(space: type, function: Callable[[], None], when: str = "POST_PIXEL") -> None:
    """Call a function whenever the main region of such a space is drawn; never without a window."""
    if not bpy.app.background:
        _draw_handlers.append((space, function, space.draw_handler_add(function, (), "WINDOW", when)))


def remove_overlay(function: Callable[[], None]) -> None:
    """Remove a draw function from all spaces."""
    for one in [one for one in _draw_handlers if one[1] == function]:
        one[0].draw_handler_remove(one[2], "WINDOW")
        _draw_handlers.remove(one)


def redraw_editors(*kinds: str) -> None:
    """Redraw all editors of these kinds, 3D views by default; Blender does not watch the data of overlays."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in (kinds or ("VIEW_3D",)):
                area.tag_redraw()


def show_range(scene: bpy.types.Scene) -> None:
    """Show a scene's whole frame range in its timelines: their view stays where it is when a script sets the range."""
    for window in bpy.context.window_manager.windows if not bpy.app.background else ():
        for area in window.screen.areas if window.scene == scene else ():
            if area.type == "DOPESHEET_EDITOR" and area.spaces.active.mode == "TIMELINE":
                region = next(region for region in area.regions if region.type == "WINDOW")
                with bpy.context.temp_override(window=window, area=area, region=region):
                    bpy.ops.action.view_all()


def start_timer(context: bpy.types.Context) -> bpy.types.Timer:
    """Start timer events for an operator that polls a thread, and progress at the pointer; return the timer."""
    windows = context.window_manager
    timer = windows.event_timer_add(0.05, window=context.window)
    windows.progress_begin(0, 100)
    _timers.append(timer)
    return timer


def stop_timer(context: bpy.types.Context, timer: bpy.types.Timer) -> None:
    """Stop timer and progress, and clear the status bar."""
    if timer in _timers:
        _timers.remove(timer)
    context.window_manager.event_timer_remove(timer)
    context.window_manager.progress_end()
    clear_status()


def show_status(text: str) -> None:
    """Show a line in the status bar of all windows.

    Blender's own text belongs to the workspace of the present window, and is out of reach from another window or
    workspace; a function that draws the line belongs to none.
    """
    _status[:] = [text]
    _set_status(_draw_status)


def clear_status() -> None:
    """Clear our line from the status bar of all windows."""
    _status.clear()
    _set_status(None)


def clear_windows() -> None:
    """Remove everything."""
    while _timers:
        stop_timer(bpy.context, _timers[-1])
    for _, function, _ in list(_draw_handlers):
        remove_overlay(function)
    clear_status()
    for shown in bpy.context.window_manager.windows:
        shown.cursor_modal_restore()  # the end of a progress restores only that of the window in front


def _set_status(text: Callable | None) -> None:
    """Set what draws the status bar, and redraw it in each window; None for Blender's own."""
    for shown in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=shown):
            shown.workspace.status_text_set(text)


def _draw_status(header, _context) -> None:
    """Draw our line, then the reports and figures that Blender's own status bar has."""
    layout = header.layout
    layout.label(text="".join(_status))
    layout.separator_spacer()
    layout.template_reports_banner()
    layout.template_running_jobs()
    layout.separator_spacer()
    layout.template_status_info()


def show_bones() -> None:
    """Show bones in all 3D views of the open windows."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D":
                    space.overlay.show_bones = True


def select_only(context: bpy.types.Context, *things: bpy.types.Object) -> None:
    """Select these objects alone, and make the first one active."""
    for other in context.selected_objects:
        other.select_set(False)
    for thing in things:
        thing.select_set(True)
    context.view_layer.objects.active = things[0]


def find_view(context: bpy.types.Context) -> bpy.types.Area | None:
    """Return the 3D view in which a key or button was pressed, or the largest; None without a window."""
    window = context.window or next(iter(context.window_manager.windows), None)
    if bpy.app.background or window is None:
        return None
    if context.area is not None and context.area.type == "VIEW_3D":
        return context.area
    return find_largest_editor(window.screen, "VIEW_3D")


def look_through_camera(context: bpy.types.Context) -> None:
    """Look through the scene's camera in the 3D view, with its whole frame; nothing happens without a window."""
    area = find_view(context)
    if area is None:
        return
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.view3d.view_center_camera()


FRAME_SHARE = 0.62  # of the 3D view's height or width that framed objects fill


def frame_objects(context: bpy.types.Context, things: list[bpy.types.Object], least: float = 1.8) -> None:
    """Move the 3D view so that objects fill a good part of it; its direction stays.

    A view through a camera is left alone, and nothing happens without a window.

    Args:
        context: the context.
        things: armatures, with the meshes that they move, and other objects, as they are on the current frame.
        least: m, the smallest height that is shown, around a point for example.
    """
    area = find_view(context)
    corners = _list_corners(context, things) if area is not None else np.empty((0, 3))
    if not len(corners) or area.spaces.active.region_3d.view_perspective == "CAMERA":
        return
    view = area.spaces.active.region_3d
    region = next(region for region in area.regions if region.type == "WINDOW")
    left, bottom, right, top = find_free_region(area, region)
    share = FRAME_SHARE * np.array([(right - left) / region.width, (top - bottom) / region.height])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    up = np.array([0.0, 0.0, 0.5 * least * units_per_metre(context.scene)])
    view.view_location = middle
    seen = np.vstack([corners - middle, up, -up]) @ np.array(view.view_rotation.to_matrix())
    scale = np.abs([view.window_matrix[0][0], view.window_matrix[1][1]])
    if view.view_perspective == "PERSP":  # a corner fits where its offset is less than its depth by the scale
        view.view_distance = float(np.max(np.abs(seen[:, :2]) * scale / share + seen[:, 2:]))
    else:
        view.view_distance *= float(np.max(np.abs(seen[:, :2]) * scale / share))


def _list_corners(context: bpy.types.Context, things: list[bpy.types.Object]) -> np.ndarray:
    """List the corners (N, 3) of the boxes around evaluated objects and what they carry; of an empty its place."""
    depsgraph = context.evaluated_depsgraph_get()
    parts = {part for thing in things for part in (thing, *thing.children)}
    shown = [part.evaluated_get(depsgraph) for part in parts if part.name in context.view_layer.objects
             and part.visible_get()]
    found = [(np.array(part.matrix_world), _list_outer_points(part)) for part in shown]
    return np.concatenate([points @ place[:3, :3].T + place[:3, 3] for place, points in found] or [np.empty((0, 3))])


def _list_outer_points(part: bpy.types.Object) -> np.ndarray:
    """List the points (N, 3) in whose midst an object lies, in its own space: Blender's box around a curve has room
    for a radius that nothing shows.
    """
    if part.type == "ARMATURE" and not len(part.data.bones):
        return np.empty((0, 3))
    if part.type != "CURVE":
        return np.array(part.bound_box)
    points = [point.co[:3] for spline in part.data.splines for point in (*spline.bezier_points, *spline.points)]
    return np.array(points).reshape(-1, 3)


def find_middle(thing: bpy.types.Object) -> np.ndarray:
    """Find the middle (3,) of an evaluated object's box, in Blender units."""
    return (np.array(thing.matrix_world) @ np.append(np.mean(thing.bound_box, axis=0), 1.0))[:3]


def open_editor(context: bpy.types.Context, kind: str, direction: str, factor: float) -> bpy.types.Area | None:
    """Return the largest editor of a kind; without one, turn the left or lower part of the largest 3D view into one.

    Args:
        context: with a window.
        kind: type of the area.
        direction: "VERTICAL" splits into left and right, "HORIZONTAL" into below and above.
        factor: share of the new editor.
    Returns:
        The area; None without a window or a 3D view.
    """
    window = context.window
    if bpy.app.background or window is None:
        return None
    return find_largest_editor(window.screen, kind) or _split_view(context, window, kind, direction, factor)


def find_free_region(area: bpy.types.Area, region: bpy.types.Region) -> tuple[float, float, float, float]:
    """Find the part of a region that no toolbar, sidebar, header or redo panel covers, less a small margin.

    Returns:
        Left, bottom, right, top in its pixels.
    """
    left, bottom, right, top = 0.0, 0.0, float(region.width), float(region.height)
    for other in area.regions:
        x, y = other.x - region.x, other.y - region.y
        overlaps = x < region.width and y < region.height and x + other.width > 0 and y + other.height > 0
        if other.type == region.type or min(other.width, other.height) <= 1 or not overlaps:
            continue
        if other.type == "HUD":  # floats in the lower left corner: stay above it, or right of it where it is tall
            if y + other.height < 0.5 * region.height:
                bottom = max(bottom, y + other.height)
            else:
                left = max(left, x + other.width)
        elif other.height > other.width:
            left, right = (max(left, x + other.width), right) if x <= 0 else (left, min(right, x))
        else:
            bottom, top = (max(bottom, y + other.height), top) if y <= 0 else (bottom, min(top, y))
    return (left + 4, bottom + 4, max(right - 4, left + 40), max(top - 4, bottom + 20))


def find_largest_editor(screen: bpy.types.Screen, kind: str) -> bpy.types.Area | None:
    """Return the largest editor of a kind; None where there is none."""
    return max((area for area in screen.areas if area.type == kind), key=lambda a: a.width * a.height, default=None)


def _split_view(context, window, kind: str, direction: str, factor: float) -> bpy.types.Area | None:
    """Split the largest 3D view; return the new editor, or None without a 3D view."""
    view = find_largest_editor(window.screen, "VIEW_3D")
    if view is None:
        return None
    before = {area.as_pointer() for area in window.screen.areas}
    with context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.screen.area_split(direction=direction, factor=factor)
    halves = [area for area in window.screen.areas if area.as_pointer() not in before]
    new = min((*halves, view), key=lambda area: area.x if direction == "VERTICAL" else area.y)
    new.type = kind
    return new
