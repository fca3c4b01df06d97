"""Choose Player: his strips are shown in the NLA editor."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.errors import InputError
from ..scene.subject import show
from .verb import Verb


class BEYOND_MOCAP_OT_choose_player(Verb, bpy.types.Operator):
    """Make this player the active one and select his dot; pressed in the NLA editor, that shows the selected only"""

    bl_idname = "beyond_mocap.choose_player"
    bl_label = "Show Player's Strips"

    player: StringProperty(
        name="Player", options={"SKIP_SAVE"}, description="The player's name; empty is the active one"
    )

    @classmethod
    def poll(cls, context):
        """There is a player, and objects can be selected."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the mode that you are in first")
            return False
        cls.poll_message_set("Import tracking in step 2 first")
        return len(context.scene.beyond_mocap.players) > 0

    def do(self, context):
        """Select the dot."""
        settings = context.scene.beyond_mocap
        active = settings.players[min(settings.active_player, len(settings.players) - 1)]
        player = settings.players.get(self.player) if self.player else active
        if player is None:
            raise InputError("player", f"{self.player!r} is not in the list", "a player in the list")
        show(context, player)
        if context.area is not None and context.area.type == "NLA_EDITOR":
            context.space_data.dopesheet.show_only_selected = True
