"""Step 4: what was made is kept or put away."""

from __future__ import annotations

import bpy

from .tab import Step


class BEYOND_MOCAP_PT_result(Step, bpy.types.Panel):
    """Accept or discard."""

    bl_label = "4  Result"
    bl_order = 4

    def draw(self, context):
        """Button, what is made."""
        layout, settings = self.layout, context.scene.beyond_mocap
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.accept", icon="CHECKMARK").form = settings.accept_as
        row.operator("beyond_mocap.discard", icon="X")
        row = layout.row(align=True)
        row.prop(settings, "accept_as", expand=True)
        row = layout.row(align=True)
        for name in ("make_bodies", "make_ball", "make_paths"):
            row.prop(settings, name, toggle=True)
        header, body = layout.panel("beyond_mocap_result_more", default_closed=True)
        header.label(text="Time & Stage")
        if body:
            body.use_property_split, body.use_property_decorate = True, False
            body.prop(settings, "start_frame")
            body.prop(settings, "start_time")
            body.operator("beyond_mocap.add_stage", icon="VIEW_CAMERA")
