"""Throws & Kicks: an armature throws or kicks a ball at a target."""

from __future__ import annotations

import bpy

from ..scene.throws.settings import find_thrower
from .tab import TabPanel, create_value_column, draw_paragraph, draw_section, draw_table, draw_values, with_progress


class BEYOND_MOCAP_PT_throws(TabPanel, bpy.types.Panel):
    """Settings, preview and figures of a throw or kick."""

    bl_label = "Throws & Kicks"
    task = "BALL"
    bl_order = 9
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context):
        """Draw ball speed and target error, which are seen while the panel is closed."""
        body = find_thrower(context)
        figures = dict(line.split(": ", 1) for line in body.beyond_mocap_throw.figures.splitlines()) if body else {}
        if "Ball speed" in figures:
            self.layout.label(text=f"{figures['Ball speed']}, {figures['Target error']} off")

    def draw(self, context):
        """Draw the armature, its settings, the two buttons and the figures."""
        layout, body = self.layout, find_thrower(context)
        if body is None:
            draw_paragraph(layout, "Select the armature that throws or kicks", "INFO")
            return
        settings = body.beyond_mocap_throw
        layout.label(text=body.name, icon="ARMATURE_DATA")
        layout.row().prop(settings, "side", expand=True)
        column = create_value_column(layout)
        draw_values(column, settings, ("target", "frame", "speed", "ball", "kind", "library"),
                    {"frame": context.scene.frame_current, "speed": 15.0})
        if settings.target is None:
            draw_paragraph(layout, "Without a target the 3D cursor is used", "CURSOR")
        with_progress(layout, context, ("throw", "kick"), draw_buttons)
        draw_preview(layout, settings)
        draw_section(layout, "throw_models", "Models", lambda opened: draw_models(opened, settings))


def draw_buttons(row) -> None:
    """Draw the two main buttons."""
    row.operator("beyond_mocap.throw_at_target", text="Throw", icon="VIEW_PAN")
    row.operator("beyond_mocap.kick_at_target", text="Kick", icon="MOD_DYNAMICPAINT")


def draw_preview(layout, settings) -> None:
    """Draw the buttons to apply or revert the preview, and its figures."""
    if not settings.made:
        return
    row = layout.row(align=True)
    row.scale_y = 1.3
    row.operator("beyond_mocap.keep_throw", text="Apply", icon="CHECKMARK")
    row.operator("beyond_mocap.leave_throw", text="Revert", icon="X")
    layout.prop(settings, "live")
    draw_table(layout, settings.figures.splitlines())
    for line in settings.messages.splitlines():
        draw_paragraph(layout, line, "INFO")


def draw_models(layout, settings) -> None:
    """Draw the choice of networks."""
    column = create_value_column(layout)
    for name in ("throw_model", "kick_model", "seed"):
        column.prop(settings, name)
