"""Step 1: which clips we choose from."""

from __future__ import annotations

import bpy

from .tab import Step, table


class BEYOND_MOCAP_PT_library(Step, bpy.types.Panel):
    """The library's folder, what it holds, and single clips."""

    bl_label = "1  Library"
    bl_order = 1

    def draw(self, context):
        """Folder, button, what was found."""
        layout, settings = self.layout, context.scene.beyond_mocap
        layout.prop(settings, "library_folder", text="")
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.build_library", icon="ASSET_MANAGER")
        self.progress(context, "library")
        first, *held = settings.library_holds.splitlines() or ("",)
        if held:
            header, body = layout.panel("beyond_mocap_library_holds", default_closed=True)
            header.label(text=first)
            if body:
                table(body, held)
        header, body = layout.panel("beyond_mocap_library_more", default_closed=True)
        header.label(text="Clips")
        if body:
            body.use_property_split, body.use_property_decorate = True, False
            body.prop(settings, "library_unit")
            body.operator("beyond_mocap.build_library", text="Build from Scratch", icon="FILE_REFRESH").rebuild = True
            body.operator("beyond_mocap.import_clips", icon="IMPORT")
            body.operator("beyond_mocap.mirror", icon="MOD_MIRROR")
            body.operator("beyond_mocap.export_bvh", icon="EXPORT")
