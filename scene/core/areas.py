"""Editors of the window: one that is open, or a part of the largest 3D view made into one."""

from __future__ import annotations

import bpy


def editor(context: bpy.types.Context, kind: str, direction: str, factor: float) -> bpy.types.Area | None:
    """The largest editor of a kind (an area's type); where there is none, the left or lower part of the largest 3D view
    becomes one.

    direction: "VERTICAL" splits into left and right, "HORIZONTAL" into below and above; factor: the new editor's share.
    None without a window, or where the screen has no 3D view to split.
    """
    window = context.window
    if bpy.app.background or window is None:
        return None
    return largest(window.screen, kind) or _split(context, window, kind, direction, factor)


def free_part(area: bpy.types.Area, region: bpy.types.Region) -> tuple[float, float, float, float]:
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


def _split(context, window, kind: str, direction: str, factor: float) -> bpy.types.Area | None:
    view = largest(window.screen, "VIEW_3D")
    if view is None:
        return None
    before = {area.as_pointer() for area in window.screen.areas}
    with context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.screen.area_split(direction=direction, factor=factor)
    halves = [area for area in window.screen.areas if area.as_pointer() not in before]
    new = min((*halves, view), key=lambda area: area.x if direction == "VERTICAL" else area.y)
    new.type = kind
    return new


def largest(screen: bpy.types.Screen, kind: str) -> bpy.types.Area | None:
    """The largest editor of a kind; None where there is none."""
    return max((area for area in screen.areas if area.type == kind), key=lambda a: a.width * a.height, default=None)
