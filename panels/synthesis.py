"""Panel of Synthesize: the step's button, its progress, its settings and presets."""

from __future__ import annotations

import bpy
from bl_ui.utils import PresetPanel

from .tab import TabPanel, draw_header


class BEYOND_MOCAP_MT_presets(bpy.types.Menu):
    """Menu of the synthesis presets."""

    bl_label = "Synthesis Presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class BEYOND_MOCAP_PT_presets(PresetPanel, bpy.types.Panel):
    """Popover of the synthesis presets, with buttons that add and remove one."""

    bl_label = "Synthesis Presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_operator = "script.execute_preset"
    preset_add_operator = "beyond_mocap.add_preset"


class BEYOND_MOCAP_PT_synthesis(TabPanel, bpy.types.Panel):
    """Synthesize button, progress and settings."""

    bl_label = "3  Synthesize"
    bl_order = 3

    def draw_header_preset(self, _context):
        BEYOND_MOCAP_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        layout, settings = self.layout, context.scene.beyond_mocap
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.synthesize", icon="ARMATURE_DATA")
        row.operator("beyond_mocap.update", icon="FILE_REFRESH")
        row.prop(settings, "live", text="", icon="UV_SYNC_SELECT")
        self.draw_queue(context)
        if body := draw_header(layout, "synthesis_more", "Settings"):
            body.use_property_split, body.use_property_decorate = True, False
            body.prop(settings, "method")
            if settings.method == "distance":
                body.prop(settings, "catch_up")
            for name in ("solve_touches", "mirror", "nearest", "rate"):
                body.prop(settings, name)
            self.draw_fine_tuning(body, settings)

    def draw_queue(self, context):
        """Draw the running job, its progress, and the waiting players."""
        running = context.window_manager.beyond_mocap_work
        if running.trouble:
            self.layout.label(text=running.trouble, icon="ERROR")
        if running.kind != "synthesis":
            return
        box = self.layout.box().column(align=True)
        box.progress(factor=running.fraction, text=running.text)
        row = box.row(align=True)
        early = row.row(align=True)
        early.enabled = not running.ending
        early.operator("beyond_mocap.cancel", text="Finish Early", icon="CHECKMARK").keep = True
        row.operator("beyond_mocap.cancel", text="Cancel", icon="X")
        for name in running.waiting.splitlines():
            row = box.row(align=True)
            row.label(text=f"{name} (waiting)", icon="TIME")
            row.operator("beyond_mocap.cancel", text="", icon="X", emboss=False).player = name

    def draw_fine_tuning(self, layout, settings):
        """Draw the settings that seldom need another value, closed at first."""
        body = draw_header(layout, "synthesis_tuning", "Fine-Tuning")
        if not body:
            return
        for name in settings.list_tuning():
            body.prop(settings, name, slider=name in ("alpha", "watch"))
