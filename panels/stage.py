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
        """Draw the buttons of stage and characters."""
        self.layout.operator("beyond_mocap.add_stage", icon="VIEW_CAMERA")
        self.layout.operator("beyond_mocap.change_look", icon="MOD_CLOTH")
