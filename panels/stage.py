"""The stage: pitch, light and cameras, at the foot of every task."""

from __future__ import annotations

import bpy

from .tab import TabPanel


class BEYOND_MOCAP_PT_stage(TabPanel, bpy.types.Panel):
    """Pitch, light and cameras."""

    bl_label = "Stage"
    bl_order = 13
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the buttons that add the stage and render pictures of it."""
        self.layout.operator("beyond_mocap.add_stage", icon="VIEW_CAMERA")
        row = self.layout.row(align=True)
        row.operator("beyond_mocap.preview_movie", icon="FILE_MOVIE")
        row.operator("beyond_mocap.contact_sheet", icon="IMGDISPLAY")
        self.draw_progress(context, "pictures")
