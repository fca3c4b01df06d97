"""The stage: pitch, light and cameras, at the foot of every task."""

from __future__ import annotations

import bpy

from ..scene.stage.settings import VIEWS
from .tab import TabPanel, create_value_column, with_progress

MARK = "beyond_mocap_view"  # custom property of the stage's cameras: their view


class BEYOND_MOCAP_PT_stage(TabPanel, bpy.types.Panel):
    """Pitch, light and cameras."""

    bl_label = "Stage"
    bl_order = 13
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the button that adds the stage, its light, buttons for views, looks and pictures."""
        layout, settings, scene = self.layout, context.scene.beyond_mocap_stage, context.scene
        layout.operator("beyond_mocap.add_stage", icon="VIEW_CAMERA")
        create_value_column(layout).prop(settings, "sport")
        layout.row().prop(settings, "light", expand=True)
        layout.prop(settings, "stands")
        shown = scene.camera.get(MARK) if scene.camera is not None else None
        grid = layout.grid_flow(columns=2, even_columns=True, align=True)
        for view, name, _, icon, _ in VIEWS:
            grid.operator("beyond_mocap.stage_view", text=name, icon=icon, depress=view == shown).view = view
        layout.operator("beyond_mocap.change_look", icon="MOD_CLOTH")
        with_progress(layout, context, ("pictures",), draw_pictures)


def draw_pictures(row) -> None:
    """Draw the buttons that render pictures."""
    row.operator("beyond_mocap.preview_movie", icon="FILE_MOVIE")
    row.operator("beyond_mocap.contact_sheet", icon="IMGDISPLAY")
