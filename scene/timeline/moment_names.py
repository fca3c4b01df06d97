"""The names of key moments in the NLA editor and the dope sheet, where Blender draws only ticks.

The same layout serves for drawing and for finding what was clicked, so that no state is kept in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..core import window
from ..core.live import Watcher
from . import label_tracks as lanes
from .strips import find_target

TEXT, ROW, PAD, GAP = 11, 18, 5, 4  # points: letters, height of a row, around the text, between two names
BOTTOM, TOP = 24, 26  # points left free for the scroll bar and the frame numbers
MOST_ROWS = 5
INK, PAPER = (0.92, 0.92, 0.92, 1.0), (0.21, 0.21, 0.21, 0.95)
PICKED_INK, PICKED_PAPER = (0.05, 0.05, 0.05, 1.0), (1.0, 0.62, 0.15, 1.0)
OFF_INK, WRONG_PAPER = (0.55, 0.55, 0.55, 1.0), (0.5, 0.12, 0.1, 0.95)
LINE = (1.0, 0.62, 0.15, 0.35)


@dataclass(frozen=True)
class DrawnName:
    """A drawn name.

    Attributes:
        text: the name.
        target: name of the object.
        strip: name of the strip.
        index: of the marker.
        frame: scene frame.
        x: pixels, of the marker.
        box: left, bottom, right, top, pixels of the region.
        is_selected: whether the moment is selected.
        is_muted: whether its strip is muted.
        has_problem: whether its labels have a problem.
    """

    text: str
    target: str
    strip: str
    index: int
    frame: int
    x: float
    box: tuple[float, float, float, float]
    is_selected: bool
    is_muted: bool
    has_problem: bool


def list_names(context: bpy.types.Context, region: bpy.types.Region) -> list[DrawnName]:
    """Compute all names to draw in a region, without overlaps; the selected one always has a place."""
    import blf

    scale = context.preferences.system.ui_scale
    blf.size(0, TEXT * scale)
    problem_frames = {(one.target, one.frame) for one in context.window_manager.beyond_mocap_problems.lines}
    rows: list[list[tuple[float, float]]] = [[] for _ in range(_count_rows(region, scale))]
    found = []
    for text, moment in sorted(_iter_moments(context), key=lambda one: (not one[1][4], one[1][3])):
        target, strip, index, frame, is_selected, is_muted = moment
        x = region.view2d.view_to_region(frame, 0, clip=False)[0]
        width = blf.dimensions(0, text)[0] + 2 * PAD * scale
        if not (0 <= x < region.width) or width > region.width - 2 * GAP * scale:
            continue
        left = min(max(x - PAD * scale, GAP * scale), region.width - width - GAP * scale)
        row = next((n for n, held in enumerate(rows) if all(left > b or left + width < a for a, b in held)), None)
        if row is None:
            continue
        rows[row].append((left - GAP * scale, left + width + GAP * scale))
        bottom = (BOTTOM + row * ROW) * scale
        box = (left, bottom, left + width, bottom + (ROW - 2) * scale)
        found.append(DrawnName(text, target, strip, index=index, frame=frame, x=x, box=box, is_selected=is_selected,
                               is_muted=is_muted, has_problem=(target, frame) in problem_frames))
    return found


def find_name_at(context: bpy.types.Context, region: bpy.types.Region, x: float, y: float) -> DrawnName | None:
    """Find the name at a place of the region in pixels."""
    if not is_visible(context):
        return None
    return next((one for one in list_names(context, region)
                 if one.box[0] <= x <= one.box[2] and one.box[1] <= y <= one.box[3]), None)


def is_visible(context: bpy.types.Context) -> bool:
    """Return whether the names are switched on and this editor has room for them."""
    space = context.space_data
    tiny = getattr(space, "mode", "") == "TIMELINE" or context.region is None or context.region.height < 90
    return context.scene.beyond_mocap.show_moment_names and not tiny


def draw():
    """Draw all names; the draw handler."""
    import blf
    import gpu

    context = bpy.context
    if not is_visible(context):
        return
    region, scale = context.region, context.preferences.system.ui_scale
    found = list_names(context, region)
    gpu.state.blend_set("ALPHA")
    for one in found:
        _draw_rectangle(one.x - 0.5 * scale, one.box[3], one.x + 0.5 * scale, region.height - TOP * scale, LINE)
    for one in found:
        _draw_rectangle(*one.box, PICKED_PAPER if one.is_selected else WRONG_PAPER if one.has_problem else PAPER)
    for one in found:  # after all boxes, since drawing text ends blending
        blf.size(0, TEXT * scale)
        blf.color(0, *(PICKED_INK if one.is_selected else OFF_INK if one.is_muted else INK))
        blf.position(0, one.box[0] + PAD * scale, one.box[1] + 4.5 * scale, 0)
        blf.draw(0, one.text)
    gpu.state.blend_set("NONE")


def _count_rows(region: bpy.types.Region, scale: float) -> int:
    """Count the rows of names that fit into the lower half of a region."""
    return max(1, min(MOST_ROWS, int((0.5 * region.height - BOTTOM * scale) / (ROW * scale))))


def _iter_moments(context: bpy.types.Context):
    """Iterate over (text, (object, strip, index, frame, selected, muted)) of the key moments of the active player and
    of selected dots.

    Names as they are written, since drawing has no time to parse labels.
    """
    chosen = {target.name: target for target in context.selected_objects if lanes.has_label_tracks(target)}
    target_object = find_target(context)
    if target_object is not None:
        chosen[target_object.name] = target_object
    for target in chosen.values():
        whose = f"{target.beyond_mocap_dot.player or target.name}: " if len(chosen) > 1 else ""
        for track, strip in lanes.iter_strips(target):
            for index, marker in enumerate(strip.action.pose_markers):
                if lanes.is_marker_visible(strip, marker):
                    frame, is_muted = lanes.compute_marker_frame(strip, marker), track.mute or strip.mute
                    yield whose + (marker.name or "?"), (target.name, strip.name, index, frame, marker.select, is_muted)


def _draw_rectangle(left: float, bottom: float, right: float, top: float, rgba) -> None:
    import gpu
    from gpu_extras.batch import batch_for_shader

    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    corners = ((left, bottom), (right, bottom), (right, top), (left, top))
    shader.uniform_float("color", rgba)
    batch_for_shader(shader, "TRIS", {"pos": corners}, indices=((0, 1, 2), (0, 2, 3))).draw(shader)


def redraw_editors() -> None:
    """Redraw the editors that show names."""
    window.redraw_editors("NLA_EDITOR", "DOPESHEET_EDITOR")


WATCHER = Watcher(
    name="Names of key moments",
    draws=tuple((space, draw, "POST_PIXEL") for space in (bpy.types.SpaceNLA, bpy.types.SpaceDopeSheetEditor)),
)
