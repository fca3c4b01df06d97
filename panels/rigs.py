"""Step 5: the motion on the user's own rig, and in a file."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .tab import StepPanel, create_value_column, draw_paragraph, draw_section


class BEYOND_MOCAP_UL_bones(bpy.types.UIList):
    """Parts of the body and the bones that move them."""

    def draw_item(self, context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.split(factor=0.42)
        row.label(text=item.name.replace("_", " ").title())
        target = context.scene.beyond_mocap.rig.target
        if target is not None:
            row.prop_search(item, "bone", target.data, "bones", text="", icon="BONE_DATA")


class BEYOND_MOCAP_PT_rig(StepPanel, bpy.types.Panel):
    """Step 5: the rig, its bones, bake settings and export."""

    bl_label = "5  Rig & Export"
    task = "PLAYER"
    rooms = ("rigs",)
    bl_order = 6

    def find_state(self, context):
        """Return whether there is a result to bring to a rig, or a rig is chosen."""
        settings = context.scene.beyond_mocap
        player = find_active_player(settings)
        is_accepted = player is not None and player.result.state == "ACCEPTED"
        return ("next" if is_accepted or settings.rig.target is not None else "later"), ""

    def draw_step(self, layout, context):
        """Draw rig and buttons, and below them what depends on the rig."""
        rig = context.scene.beyond_mocap.rig
        column = create_value_column(layout)
        column.prop(rig, "target")
        column.operator("beyond_mocap.use_selected_rig", icon="ARMATURE_DATA")
        column.prop(rig, "source", placeholder="Active Player")
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("beyond_mocap.bake_to_rig", icon="ARMATURE_DATA").targets = "CHOSEN"
        row.operator("beyond_mocap.unbake", text="Remove", icon="X")
        row = layout.row(align=True)
        row.operator("beyond_mocap.bake_to_rig", text="Selected Rigs").targets = "SELECTED"
        row.operator("beyond_mocap.bake_to_rig", text="All Players").targets = "PLAYERS"
        draw_section(layout, "rig_bake", "Bake Settings", lambda opened: draw_bake_settings(opened, rig))
        draw_section(layout, "bone_map", "Bone Map", lambda opened: draw_map(opened, rig))
        draw_section(layout, "export", "Export", lambda opened: draw_export(opened, rig), closed=False)
        for line in rig.messages.splitlines():
            draw_paragraph(layout, line, "INFO")


def draw_bake_settings(layout, rig) -> None:
    """Draw how a motion is baked, and the button that simplifies keys."""
    column = create_value_column(layout)
    for name in ("root", "steps", "ik", "plants", "reduces"):
        column.prop(rig, name)
    tolerances = column.column()
    tolerances.active = rig.reduces
    for name in ("tolerance", "turn_tolerance"):
        tolerances.prop(rig, name)
    layout.operator("beyond_mocap.reduce_keys", icon="MOD_DECIM")


def draw_map(layout, rig) -> None:
    """Draw the bone map; without a rig it is greyed out."""
    layout.active = rig.target is not None
    layout.template_list("BEYOND_MOCAP_UL_bones", "", rig, "bones", rig, active_propname="active_bone", rows=8)
    row = layout.row(align=True)
    row.operator("beyond_mocap.map_bones", text="Map", icon="FILE_REFRESH")
    row.operator("beyond_mocap.keep_bone_map", text="Store", icon="PINNED")
    row = layout.row(align=True)
    row.operator("beyond_mocap.load_bone_map", text="Load", icon="FILEBROWSER")
    row.operator("beyond_mocap.save_bone_map", text="Save", icon="FILE_TICK")


def draw_export(layout, rig) -> None:
    """Draw the export settings."""
    column = create_value_column(layout)
    for name in ("format", "engine", "who", "own_rate", "deform_only", "meshes", "keep_root"):
        column.prop(rig, name)
    row = layout.row()
    row.scale_y = 1.3
    row.operator("beyond_mocap.export_motion", icon="EXPORT")
    row.operator("beyond_mocap.deliver", text="Deliver to Engine", icon="FILE_FOLDER")
