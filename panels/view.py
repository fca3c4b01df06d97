"""Overlays of the 3D view: a switch for each of them, and the error curves."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .tab import TabPanel

ICONS = {"track": "CURVE_PATH", "footprints": "MOD_DYNAMICPAINT", "contacts": "PIVOT_CURSOR", "seams": "SEQUENCE",
         "moments": "KEYTYPE_KEYFRAME_VEC", "speed": "DRIVER_DISTANCE", "heading": "ORIENTATION_LOCAL",
         "ghosts": "GHOST_ENABLED", "shots": "CON_TRACKTO"}


class BEYOND_MOCAP_PT_view(TabPanel, bpy.types.Panel):
    """Overlays and error curves."""

    bl_label = "View"
    bl_order = 12
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.beyond_mocap.view, "show", text="")

    def draw(self, context):
        layout, settings = self.layout, context.scene.beyond_mocap
        view = settings.view
        layout.row().prop(view, "players", expand=True)
        column = layout.grid_flow(columns=2, even_columns=True, align=True)
        column.active = view.show
        for name, icon in ICONS.items():
            column.prop(view, name, icon=icon, toggle=True)
        more = layout.column()
        more.active = view.show
        more.use_property_split, more.use_property_decorate = True, False
        more.prop(view, "reach")
        if view.ghosts:
            more.prop(view, "ghosts_at")
            if view.ghosts_at == "STEP":
                more.prop(view, "ghost_step")
        more.prop(view, "in_front")
        row = layout.row(align=True)
        row.operator("beyond_mocap.error_curves", icon="GRAPH")
        player = find_active_player(settings)
        shown = player is not None and player.body is not None and player.body.type == "ARMATURE"
        if shown and "Root Error (cm)" in player.body.data:
            row.operator("beyond_mocap.error_curves", text="", icon="X").remove = True
