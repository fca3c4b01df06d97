"""Variants: several takes of one player, each another solution, to choose from."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

from ..beyond_mocap.errors import InputError
from ..scene import orders
from ..scene.settings import active_player
from .turns import TurnsVerb


class BEYOND_MOCAP_OT_variants(TurnsVerb, bpy.types.Operator):
    """Make several takes of the active player, each without the footage of those before where that can be.
They are switched by the row of numbers; Accept keeps the one that is shown, the others go"""

    bl_idname = "beyond_mocap.variants"
    bl_label = "Variants"

    count: IntProperty(name="How Many", default=3, min=2, max=9, description="How many takes to choose from")

    @classmethod
    def poll(cls, context):
        """A library and an active player."""
        if not context.scene.beyond_mocap.library_folder:
            cls.poll_message_set("Choose the library's folder in step 1 first")
            return False
        cls.poll_message_set("Import tracking and choose a player in step 2 first")
        return active_player(context.scene.beyond_mocap) is not None

    def wanted(self, context):
        """The active player."""
        player = active_player(context.scene.beyond_mocap)
        if player is None:
            raise InputError("variants", "no player is chosen", "a player", "choose one in step 2")
        return [(player, orders.How("variants", count=self.count))]
