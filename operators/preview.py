"""Preview: show another one of the variants that were made."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

from ..beyond_mocap.errors import InputError
from ..scene import variants
from ..scene.settings import active_player
from .accept import ResultVerb
from .written import show_automatic


class BEYOND_MOCAP_OT_preview(ResultVerb, bpy.types.Operator):
    """Show this one of the variants that were made; Accept keeps the one that is shown"""

    bl_idname = "beyond_mocap.preview"
    bl_label = "Preview"

    number: IntProperty(name="Variant", default=1, min=1, description="Which one, from 1")

    @classmethod
    def poll(cls, context):
        """There are variants."""
        cls.poll_message_set("No variants: press Variants first")
        return any(player.result.variants for player in context.scene.beyond_mocap.players)

    def do(self, context):
        """Show it on the named player, or the active one."""
        player = self.chosen(context)[0] if self.player else active_player(context.scene.beyond_mocap)
        if player is None:
            raise InputError("preview", "no player is chosen", "a player with variants", "choose one in step 2")
        variants.show(context, player, self.number - 1)
        show_automatic(context, player)
