"""Step 2: the dots and the words."""

from __future__ import annotations

import bpy

from ..scene.settings import active_player
from .tab import Step, paragraph


class BEYOND_MOCAP_UL_players(bpy.types.UIList):
    """Players with their shirts; a tick for those that the next steps are about."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        """One player."""
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        row.prop(item, "name", text="", emboss=False)
        shirt = row.row()
        shirt.ui_units_x = 1.0
        shirt.prop(item, "shirt", text="")
        row.label(text="", icon="CHECKMARK" if item.take else "BLANK1")


class BEYOND_MOCAP_PT_players(Step, bpy.types.Panel):
    """Who plays, where they run, and what is said about it."""

    bl_label = "2  Track & Words"
    bl_order = 2

    def draw(self, context):
        """List of players, and the files of the active one."""
        layout, settings = self.layout, context.scene.beyond_mocap
        layout.operator("beyond_mocap.import_tracking", icon="IMPORT")
        row = layout.row()
        row.template_list("BEYOND_MOCAP_UL_players", "", settings, "players", settings, "active_player", rows=3)
        row.column(align=True).operator("beyond_mocap.remove_player", text="", icon="REMOVE")
        if any(player.dot is None for player in settings.players):
            layout.operator("beyond_mocap.place_players", icon="NLA")
        player = active_player(settings)
        if player is None:
            paragraph(layout, "Import a file with positions, or drop it into the view", "INFO")
            return
        column = layout.column()
        column.use_property_split, column.use_property_decorate = True, False
        column.prop(player, "tracking_file")
        if player.feed_id:
            column.prop(player, "feed_id")
            column.prop(settings, "section_start")
            column.prop(settings, "section_end")
        file = column.column()
        file.active = player.annotation_text is None  # the text counts more
        file.prop(player, "annotation_file")
        column.prop(player, "annotation_text")
        column.prop(player, "body")
