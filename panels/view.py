"""Overlays of the 3D view: a switch for each of them, and the error curves."""

from __future__ import annotations

import bpy

from ..scene.core.settings import find_active_player
from .tab import TabPanel, draw_paragraph

ICONS = {"track": "CURVE_PATH", "footprints": "MOD_DYNAMICPAINT", "contacts": "PIVOT_CURSOR", "seams": "SEQUENCE",
         "moments": "KEYTYPE_KEYFRAME_VEC", "speed": "DRIVER_DISTANCE", "heading": "ORIENTATION_LOCAL",
         "ghosts": "GHOST_ENABLED", "shots": "CON_TRACKTO", "momentum": "PHYSICS"}


class BEYOND_MOCAP_PT_view(TabPanel, bpy.types.Panel):
    """Overlays and error curves."""

    bl_label = "View"
    bl_order = 14
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
        self.draw_momentum(context)
        row = layout.row(align=True)
        row.operator("beyond_mocap.error_curves", icon="GRAPH")
        player = find_active_player(settings)
        shown = player is not None and player.body is not None and player.body.type == "ARMATURE"
        if shown and "Root Error (cm)" in player.body.data:
            row.operator("beyond_mocap.error_curves", text="", icon="X").remove = True

    def draw_momentum(self, context):
        """Draw the button that shows the momentum of the selected armatures, and why it cannot be drawn."""
        row = self.layout.row(align=True)
        row.operator("beyond_mocap.show_momentum", icon="PHYSICS")
        active = context.view_layer.objects.active
        momentum = active.beyond_mocap_momentum if active is not None and active.type == "ARMATURE" else None
        if momentum is not None and momentum.show:
            row.operator("beyond_mocap.show_momentum", text="", icon="X").remove = True
            if momentum.message:
                draw_paragraph(self.layout, momentum.message, "ERROR")
