"""The extension's page in Blender's preferences (cache folder, threads, keys), and its menu entries.

The displayed keys are those of the user's configuration, found by the operators' names, so that Blender stores changes.
"""

from __future__ import annotations

import bpy
import rna_keymap_ui

from ..scene.core.preferences import EXTENSION, Preferences
from .tab import part


def draw_keys(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw a row for every key of the extension, under the name of its editor."""
    configurations = context.window_manager.keyconfigs
    for keymap in _with_our_keys(configurations.addon):
        own = configurations.user.keymaps.find(keymap.name, space_type=keymap.space_type,
                                               region_type=keymap.region_type)
        if own is None:
            continue
        column = layout.column()
        column.context_pointer_set("keymap", own)
        column.label(text=keymap.name)
        for item in own.keymap_items:
            if item.idname.startswith("beyond_mocap."):
                rna_keymap_ui.draw_kmi(["ADDON", "USER", "DEFAULT"], configurations.user, own, item, column, level=0)


class BeyondMocapPreferences(Preferences, bpy.types.AddonPreferences):
    """Cache folder, threads and keys of the extension."""

    bl_idname = EXTENSION

    def draw(self, context):
        """Draw the settings, then the keys."""
        layout = self.layout
        column = layout.column()
        column.use_property_split = True
        column.prop(self, "cache_folder", placeholder="Beside each library")
        column.prop(self, "threads", text="Threads (0: all)")
        if body := part(layout, "keys", "Keys", closed=False):
            draw_keys(body, context)


def draw_import(self, _context):
    """Draw the entries of File > Import."""
    self.layout.operator("beyond_mocap.import_clips", text="Beyond Mocap Clips (.bvh, .fbx ...)")
    self.layout.operator("beyond_mocap.import_tracking", text="Beyond Mocap Tracking (.csv ...)")
    self.layout.operator("beyond_mocap.import_markers", text="Beyond Mocap Optical Markers (.c3d, .trc)")


def draw_export(self, _context):
    """Draw the entries of File > Export."""
    self.layout.operator("beyond_mocap.export_bvh", text="Beyond Mocap Motion (.bvh)")
    self.layout.operator("beyond_mocap.study_render", text="Beyond Mocap Study Clips (.mp4)")


def draw_strip(self, _context):
    """Draw the entries of the strips' context menu in the NLA editor."""
    self.layout.separator()
    self.layout.operator("beyond_mocap.resynthesize_stretch", icon="UV_SYNC_SELECT")


def register():
    """Add the menu entries."""
    bpy.types.NLA_MT_context_menu.append(draw_strip)
    bpy.types.TOPBAR_MT_file_import.append(draw_import)
    bpy.types.TOPBAR_MT_file_export.append(draw_export)


def unregister():
    """Remove the menu entries."""
    bpy.types.NLA_MT_context_menu.remove(draw_strip)
    bpy.types.TOPBAR_MT_file_import.remove(draw_import)
    bpy.types.TOPBAR_MT_file_export.remove(draw_export)


def _with_our_keys(configuration: bpy.types.KeyConfig | None) -> list[bpy.types.KeyMap]:
    keymaps = configuration.keymaps if configuration is not None else ()
    return [k for k in keymaps if any(item.idname.startswith("beyond_mocap.") for item in k.keymap_items)]
