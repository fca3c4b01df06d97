"""Step 5: the motion on the user's own rig, and in a file."""

from __future__ import annotations

import bpy

from .tab import TabPanel, create_value_column, draw_header, draw_paragraph


class BEYOND_MOCAP_UL_bones(bpy.types.UIList):
    """Parts of the body and the bones that move them."""

    def draw_item(self, context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.split(factor=0.42)
        row.label(text=item.name.replace("_", " ").title())
        target = context.scene.beyond_mocap.rig.target
        if target is not None:
            row.prop_search(item, "bone", target.data, "bones", text="", icon="BONE_DATA")


class BEYOND_MOCAP_PT_rig(TabPanel, bpy.types.Panel):
    """The rig, its bones, bake settings and export."""

    bl_label = "5  Rig & Export"
    bl_order = 5

    def draw(self, context):
        layout, rig = self.layout, context.scene.beyond_mocap.rig
        column = create_value_column(layout)
        row = column.row(align=True)
        row.prop(rig, "target")
        row.operator("beyond_mocap.use_selected_rig", text="", icon="EYEDROPPER")
        column.prop(rig, "source", placeholder="The active player's body")
        if rig.target is not None:
            self.draw_map(layout, rig)
        column = create_value_column(layout)
        for name in ("root", "steps", "ik", "plants", "reduces"):
            column.prop(rig, name)
        if rig.reduces:
            column.prop(rig, "tolerance")
            column.prop(rig, "turn_tolerance")
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.bake_to_rig", icon="ARMATURE_DATA").targets = "CHOSEN"
        row.operator("beyond_mocap.unbake", text="", icon="X")
        row.operator("beyond_mocap.reduce_keys", text="", icon="MOD_DECIM")
        row = layout.row(align=True)
        row.operator("beyond_mocap.bake_to_rig", text="Selected Rigs").targets = "SELECTED"
        row.operator("beyond_mocap.bake_to_rig", text="All Players").targets = "PLAYERS"
        for line in rig.messages.splitlines():
            draw_paragraph(layout, line, "INFO")
        self.draw_export(layout, rig)

    def draw_map(self, layout, rig) -> None:
        """Draw the bone map."""
        if body := draw_header(layout, "bone_map", "Bone Map"):
            body.template_list("BEYOND_MOCAP_UL_bones", "", rig, "bones", rig, active_propname="active_bone", rows=8)
            row = body.row(align=True)
            row.operator("beyond_mocap.map_bones", text="Map", icon="FILE_REFRESH")
            row.operator("beyond_mocap.keep_bone_map", text="Store", icon="PINNED")
            row.operator("beyond_mocap.load_bone_map", text="", icon="FILEBROWSER")
            row.operator("beyond_mocap.save_bone_map", text="", icon="FILE_TICK")

    def draw_export(self, layout, rig) -> None:
        """Draw the export settings."""
        if body := draw_header(layout, "export", "Export", closed=False):
            body.use_property_split, body.use_property_decorate = True, False
            for name in ("format", "engine", "who", "own_rate", "deform_only", "meshes"):
                body.prop(rig, name)
            row = body.row()
            row.scale_y = 1.3
            row.operator("beyond_mocap.export_motion", icon="EXPORT")
