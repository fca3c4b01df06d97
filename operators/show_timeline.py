"""Show Timeline: the NLA editor below the 3D view, with the players' strips in it."""

from __future__ import annotations

import bpy

from ..scene import areas
from ..scene.core.live import soon
from .verb import Verb


class BEYOND_MOCAP_OT_show_timeline(Verb, bpy.types.Operator):
    """Open the NLA editor below the 3D view, with the strips of all players in it and its Beyond Mocap tab"""

    bl_idname = "beyond_mocap.show_timeline"
    bl_label = "Show Timeline"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Somebody has a timeline."""
        cls.poll_message_set("Import tracking in step 2 first")
        return any(player.dot for player in context.scene.beyond_mocap.players)

    def do(self, context):
        """Find or open it, show its sidebar and all strips."""
        area = areas.editor(context, "NLA_EDITOR", "HORIZONTAL", 0.4)
        if area is None:
            return
        space = area.spaces.active
        space.show_region_ui = True
        if space.dopesheet is not None:
            space.dopesheet.show_only_selected = False
        uid = context.scene.session_uid
        soon(lambda: _settle(uid), 0.1)
        area.tag_redraw()


def _settle(scene: int) -> None:
    """What an editor takes only once it has been drawn: which tab is in front, and what it shows."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type != "NLA_EDITOR" or window.scene.session_uid != scene:
                continue
            regions = {region.type: region for region in area.regions}
            regions["UI"].active_panel_category = "Beyond Mocap"
            with bpy.context.temp_override(window=window, area=area, region=regions["WINDOW"]):
                bpy.ops.nla.view_all()
            area.tag_redraw()
