"""Remove Player: take one off the list with his dot and strips; what was made stays."""

from __future__ import annotations

import bpy

from ..scene import dots, pins, preview
from ..scene.settings import active_player
from .verb import Verb


class BEYOND_MOCAP_OT_remove_player(Verb, bpy.types.Operator):
    """Take the active player off the list, with his dot, his pins and the strips of his words; armature, action and
what his track is drawn by stay in the scene, and a preview that he shows is kept"""

    bl_idname = "beyond_mocap.remove_player"
    bl_label = "Remove Player"

    @classmethod
    def poll(cls, context):
        """There is one."""
        cls.poll_message_set("The list of players is empty")
        return active_player(context.scene.beyond_mocap) is not None

    def do(self, context):
        """Remove it and choose its neighbour."""
        settings = context.scene.beyond_mocap
        player = settings.players[settings.active_player]
        if player.result.state == "PREVIEW" and preview.shown(context.scene, player):
            preview.keep(context, player, "ACTION")  # else nobody would know any more what has been set aside
        elif player.result.state == "PREVIEW":
            preview.forget(player)
        pins.remove_all(player)
        dots.remove(context.scene, player)
        settings.players.remove(settings.active_player)
        settings.active_player = max(0, min(settings.active_player, len(settings.players) - 1))
