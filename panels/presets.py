"""Presets of Synthesize: a menu in the header of step 3."""

from __future__ import annotations

import bpy
from bl_ui.utils import PresetPanel


class BEYOND_MOCAP_MT_presets(bpy.types.Menu):
    """The presets as a menu."""

    bl_label = "Synthesis Presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class BEYOND_MOCAP_PT_presets(PresetPanel, bpy.types.Panel):
    """The presets, with buttons that add and remove one."""

    bl_label = "Synthesis Presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_operator = "script.execute_preset"
    preset_add_operator = "beyond_mocap.add_preset"
