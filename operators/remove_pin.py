"""Remove Pin: take one of the active player's pins away."""

from __future__ import annotations

import bpy

from ..scene import linked, pins
from ..scene.settings import active_player
from .verb import Verb


class BEYOND_MOCAP_OT_remove_pin(Verb, bpy.types.Operator):
    """Take the pin that is chosen in the list away, with its Empty"""

    bl_idname = "beyond_mocap.remove_pin"
    bl_label = "Remove Pin"

    @classmethod
    def poll(cls, context):
        """A pin."""
        player = active_player(context.scene.beyond_mocap)
        cls.poll_message_set("The active player has no pins")
        return player is not None and len(player.pins) > 0

    def do(self, context):
        """Remove it and choose its neighbour."""
        linked.refuse(context.scene)
        player = active_player(context.scene.beyond_mocap)
        pins.remove(player, min(player.active_pin, len(player.pins) - 1))
