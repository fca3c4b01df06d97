"""The reference video: what it is, where it begins, and how fast it goes."""

from __future__ import annotations

import bpy

from .tab import Step


class BEYOND_MOCAP_PT_video(Step, bpy.types.Panel):
    """A movie or image sequence beside the match."""

    bl_label = "Reference Video"
    bl_parent_id = "BEYOND_MOCAP_PT_players"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Load it, or where it is."""
        layout, video = self.layout, context.scene.beyond_mocap.video
        row = layout.row(align=True)
        row.operator("beyond_mocap.load_video", icon="FILE_MOVIE", text=video.clip.name if video.clip else None)
        if video.clip is None:
            return
        row.operator("beyond_mocap.remove_video", text="", icon="X")
        layout.operator("beyond_mocap.show_video", icon="WINDOW")
        column = layout.column(align=True)
        column.use_property_split, column.use_property_decorate = True, False
        row = column.row(align=True)
        row.prop(video, "begins")
        row.operator("beyond_mocap.move_video", text="", icon="TRIA_LEFT").frames = -1
        row.operator("beyond_mocap.move_video", text="", icon="TRIA_RIGHT").frames = 1
        column.prop(video, "rate")
