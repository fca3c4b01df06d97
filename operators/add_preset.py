"""Add Preset: the settings of Synthesize under a name, kept where Blender keeps all presets."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase

from ..beyond_mocap.base.settings import rows_of


class BEYOND_MOCAP_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Keep the settings of Synthesize (method, weights, windows) under a name, for this and all other files"""

    bl_idname = "beyond_mocap.add_preset"
    bl_label = "Add Synthesis Preset"
    preset_menu = "BEYOND_MOCAP_MT_presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_defines = ["settings = bpy.context.scene.beyond_mocap"]
    preset_values = [f"settings.{row.identifier}" for row in rows_of("synthesis") if row.in_preset]
