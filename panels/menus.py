"""Entries of Blender's own menus."""

from __future__ import annotations

import bpy


def draw_import(self, _context):
    """File > Import."""
    self.layout.operator("beyond_mocap.import_clips", text="Beyond Mocap Clips (.bvh, .fbx ...)")
    self.layout.operator("beyond_mocap.import_tracking", text="Beyond Mocap Tracking (.csv ...)")
    self.layout.operator("beyond_mocap.import_markers", text="Beyond Mocap Optical Markers (.c3d, .trc)")


def draw_export(self, _context):
    """File > Export."""
    self.layout.operator("beyond_mocap.export_bvh", text="Beyond Mocap Motion (.bvh)")
    self.layout.operator("beyond_mocap.study_render", text="Beyond Mocap Study Clips (.mp4)")


def draw_strip(self, _context):
    """The context menu of strips in the NLA editor."""
    self.layout.separator()
    self.layout.operator("beyond_mocap.resynthesize_stretch", icon="UV_SYNC_SELECT")


def register():
    """Append ours."""
    bpy.types.NLA_MT_context_menu.append(draw_strip)
    bpy.types.TOPBAR_MT_file_import.append(draw_import)
    bpy.types.TOPBAR_MT_file_export.append(draw_export)


def unregister():
    """Take ours away."""
    bpy.types.NLA_MT_context_menu.remove(draw_strip)
    bpy.types.TOPBAR_MT_file_import.remove(draw_import)
    bpy.types.TOPBAR_MT_file_export.remove(draw_export)
