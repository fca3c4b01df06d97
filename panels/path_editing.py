"""Path editing: the armature, its curve, how the motion follows it, its figures, cameras and overlays."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import lru_cache

import bpy

from ..scene.core.settings import find_active_player
from ..scene.path_editing.settings import list_target_bodies
from .tab import TabPanel, create_value_column, draw_figures, draw_paragraph, draw_section, draw_values

OVERLAYS = {"path_source": "CURVE_PATH", "path_new": "CURVE_NCURVE", "path_trackers": "EMPTY_SINGLE_ARROW",
            "path_residuals": "TRACKING_REFINE_BACKWARDS", "path_ghost": "GHOST_ENABLED"}
CAMERAS = (("ABOVE", "Above"), ("SIDE", "Side"), ("QUARTER", "Quarter"), ("BEHIND", "Behind"))
CAMERA_MARK = "beyond_mocap_path_camera"  # custom property of the extension's cameras: which one it is
NUDGES = (
    ("LEFT", "TRIA_LEFT"), ("RIGHT", "TRIA_RIGHT"), ("FORTH", "TRIA_UP"), ("BACK", "TRIA_DOWN"), ("UP", "SORT_DESC"),
    ("DOWN", "SORT_ASC"),
)
FRAME_NOTES = {  # the effect of each frame
    "path": "Offsets turn with the path, seen from above: recommended",
    "tangent": "Offsets turn with the full tangent: the body tilts on hills and lies flat on steep paths",
    "absolute": "Offsets do not turn with the path: in a bend the sway of the steps has the wrong direction",
}

FIGURES = (  # name, key path in the figures, factor, format, unit; target: a number, the key path of the recording's
    # own figure, or the larger of both
    ("Length", "metres", 1.0, "{:.1f}", " m", None),
    ("Time", "seconds", 1.0, "{:.1f}", " s", None),
    ("Distance to path", "root_error_m.mean", 100.0, "{:.2f}", " cm", ("root_error_own_m.mean", 0.005)),
    ("Speed error", "kept_speed.path.p95", 100.0, "{:.2f}", " %", 0.01),
    ("Foot slide", "skate.contact_cm_s", 1.0, "{:.1f}", " cm/s", "skate.source_contact_cm_s"),
    ("Slide unplanted", "skate.before_contact_cm_s", 1.0, "{:.1f}", " cm/s", None),
    ("Slide per step", "skate.stance_mm_median", 1.0, "{:.1f}", " mm", 5.0),
    ("Foot correction", "foot_correction_m.p95", 100.0, "{:.1f}", " cm", 0.10),
    ("Feet out of reach", "ik_miss_share", 100.0, "{:.1f}", " %", 0.0),
    ("Worst transition", "seam_jerk.max", 1.0, "{:.2f}", " x", 1.3),
)
SLACK = 1.02  # factor on a target: a difference that the displayed digits do not show


class BEYOND_MOCAP_PT_path(TabPanel, bpy.types.Panel):
    """The armature, its curve, and how its motion follows the curve."""

    bl_label = "Path Editing"
    task = "PATH"
    bl_order = 7

    def draw(self, context):
        """Draw the armature, its path, its figures, cameras and overlays."""
        layout, body = self.layout, find_subject(context)
        if body is None:
            draw_paragraph(layout, "Select an armature with a motion", "INFO")
        else:
            edit = body.beyond_mocap_ride
            draw_armature(layout, body, edit)
            if edit.on:
                for line in edit.messages.splitlines():
                    draw_paragraph(layout, line, "INFO")
                draw_section(layout, "path_curve", "New Curve",
                             lambda opened: draw_new_curve(opened, context.scene.beyond_mocap))
                draw_section(layout, "path_following", "Path Following", lambda opened: draw_following(opened, edit))
                draw_section(layout, "path_body", "Body", lambda opened: draw_body(opened, edit))
                if figure_text := describe_figures(edit.figures):
                    draw_section(layout, "path_figures", "Figures", lambda opened: draw_figures(opened, figure_text))
        draw_section(layout, "path_cameras", "Cameras & Nudging", lambda opened: draw_cameras(opened, context))
        draw_section(layout, "path_overlays", "Overlays",
                     lambda opened: draw_overlays(opened, context.scene.beyond_mocap.view))


def find_subject(context) -> bpy.types.Object | None:
    """Find the active armature, the armature on the active curve, or else the active player's body."""
    active = context.view_layer.objects.active
    if active is not None and active.type == "ARMATURE":
        return active
    if active is not None and active.type == "CURVE" and (edited := list_target_bodies(context)):
        return edited[0]
    player = find_active_player(context.scene.beyond_mocap)
    body = player.body if player is not None else None
    return body if body is not None and body.type == "ARMATURE" else None


def draw_armature(layout, body, edit) -> None:
    """Draw the armature, its curve and the buttons to start, apply and revert."""
    layout.label(text=f"{body.name} on Path" if edit.on else body.name, icon="ARMATURE_DATA")
    create_value_column(layout).prop(edit, "curve", placeholder="Fitted")
    row = layout.row(align=True)
    row.scale_y = 1.3
    if not edit.on:
        row.operator("beyond_mocap.edit_path", icon="CURVE_BEZCURVE")
    else:
        row.operator("beyond_mocap.bake_path", text="Apply", icon="CHECKMARK")
        row.operator("beyond_mocap.leave_path", text="Revert", icon="X")
        layout.prop(edit, "live")
        layout.operator("beyond_mocap.update_path", text="Update", icon="FILE_REFRESH")


def draw_new_curve(layout, settings) -> None:
    """Draw the settings and buttons of a new curve."""
    column = create_value_column(layout)
    draw_values(column, settings, ("curve_kind", "curve_points"), {"curve_points": 6})
    if settings.curve_kind == "NURBS":
        column.prop(settings, "curve_degree")
    row = layout.column(align=True)
    for shape, text in (("FITTED", "Original"), ("STRAIGHT", "Straight"), ("PRESENT", "As It Is")):
        button = row.operator("beyond_mocap.path_curve", text=text)
        button.shape, button.kind = shape, settings.curve_kind
        button.count, button.degree = settings.curve_points, settings.curve_degree


def draw_following(layout, edit) -> None:
    """Draw how the motion follows its path."""
    column = create_value_column(layout)
    column.prop(edit, "fit")
    if edit.fit == "polynomial":
        column.prop(edit, "degree")
    for name in ("by_arc_length", "speed", "delay", "end", "cycle", "bends", "climbs"):
        column.prop(edit, name)
    row = layout.row(align=True)
    row.operator("beyond_mocap.path_apart", icon="MOD_PHYSICS")
    row.operator("beyond_mocap.path_apart", text="Clear", icon="X").clear = True


def draw_body(layout, edit) -> None:
    """Draw what the body does on the path."""
    column = create_value_column(layout)
    for name in ("plant", "lean", "slopes", "ground"):
        column.prop(edit, name)
    draw_section(layout, "path_paper", "As in the Paper", lambda opened: draw_frame_choice(opened, edit))


def draw_frame_choice(layout, edit) -> None:
    """Draw the alternatives for the frame of the offsets, with their effects."""
    create_value_column(layout).prop(edit, "frame")
    draw_paragraph(layout, FRAME_NOTES[edit.frame], "INFO")


def draw_cameras(layout, context) -> None:
    """Draw the four cameras, and the step and directions of nudging; both only where they can be used."""
    column = layout.column(align=True)
    column.operator("beyond_mocap.path_cameras", icon="VIEW_CAMERA")
    if bpy.ops.beyond_mocap.path_camera.poll():
        row, camera = column.grid_flow(columns=2, even_columns=True, align=True), context.scene.camera
        active_camera = camera.get(CAMERA_MARK) if camera is not None else ""
        for kind, text in CAMERAS:
            row.operator("beyond_mocap.path_camera", text=text, depress=kind == active_camera).which = kind
    elif not bpy.ops.beyond_mocap.path_cameras.poll():
        draw_paragraph(layout, "Cameras look at an edited path: press Edit Path first", "INFO")
    if context.mode != "EDIT_CURVE":
        draw_paragraph(layout, "Nudging moves points: enter the curve's Edit Mode first (Tab)", "INFO")
        return
    create_value_column(layout).prop(context.scene.beyond_mocap, "nudge_step", text="Nudge")
    row = layout.row(align=True)
    for direction, icon in NUDGES:
        row.operator("beyond_mocap.nudge_points", text="", icon=icon).direction = direction


def draw_overlays(layout, view) -> None:
    """Draw the switches of the path overlays."""
    grid = layout.grid_flow(columns=2, even_columns=True, align=True)
    grid.active = view.show
    for name, icon in OVERLAYS.items():
        grid.prop(view, name, icon=icon, toggle=True)


@lru_cache(maxsize=64)
def describe_figures(figures: str) -> str:
    """Describe figures given as JSON text, "" without any; cached, since panels ask at every redraw."""
    try:
        table = json.loads(figures) if figures else {}
    except ValueError:
        table = {}
    found = []
    for name, path, factor, form, unit, aim in FIGURES:
        value = _find_figure(table, path)
        if value is None:
            continue
        most = _compute_target(table, aim)
        status = "" if most is None else ("met" if value * factor <= most * factor * SLACK + 0.05 else "missed")
        target_text = "" if most is None else f"≤ {form.format(factor * most)}"
        found.append(f"{name}: {form.format(factor * value)}{unit}\t{target_text}\t{status}")
    return "\n".join(found)


def _compute_target(table: Mapping, aim) -> float | None:
    """Compute the target of a figure, see FIGURES."""
    if isinstance(aim, tuple):
        own = _find_figure(table, aim[0])
        return max(own, aim[1]) if own is not None else aim[1]
    return _find_figure(table, aim) if isinstance(aim, str) else aim


def _find_figure(table: Mapping, path: str) -> float | None:
    for part in path.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    return float(table) if isinstance(table, (int, float)) and math.isfinite(table) else None
