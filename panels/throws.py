"""Throws & Kicks: an armature throws or kicks a ball at a target."""

from __future__ import annotations

import bpy

from ..scene.throws.settings import thrower
from .tab import Step, paragraph, section, split, table


class BEYOND_MOCAP_PT_throws(Step, bpy.types.Panel):
    """Settings, preview and figures of a throw or kick."""

    bl_label = "Throws & Kicks"
    bl_order = 9
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the armature, its settings, the two buttons and the figures."""
        layout, body = self.layout, thrower(context)
        if body is None:
            paragraph(layout, "Select the armature that throws or kicks", "INFO")
            return
        wish = body.beyond_mocap_throw
        layout.label(text=body.name, icon="ARMATURE_DATA")
        layout.row().prop(wish, "side", expand=True)
        column = split(layout)
        for name in ("target", "frame", "speed", "ball", "kind", "library"):
            column.prop(wish, name)
        if wish.target is None:
            paragraph(layout, "Without a target the 3D cursor is used", "CURSOR")
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.throw_at_target", text="Throw", icon="VIEW_PAN")
        row.operator("beyond_mocap.kick_at_target", text="Kick", icon="MOD_DYNAMICPAINT")
        for kind in ("throw", "kick"):
            self.progress(context, kind)
        shown(layout, wish)
        section(layout, "throw_models", "Models", lambda opened: models(opened, wish))


def shown(layout, wish) -> None:
    """Draw the figures of the preview, and the buttons to apply or revert it."""
    if not wish.made:
        return
    table(layout, wish.figures.splitlines())
    for line in wish.told.splitlines():
        paragraph(layout, line, "INFO")
    layout.prop(wish, "live")
    row = layout.row(align=True)
    row.operator("beyond_mocap.keep_throw", text="Apply", icon="CHECKMARK")
    row.operator("beyond_mocap.leave_throw", text="Revert", icon="X")


def models(layout, wish) -> None:
    """Draw the choice of networks."""
    column = split(layout)
    for name in ("throw_model", "kick_model", "seed"):
        column.prop(wish, name)
