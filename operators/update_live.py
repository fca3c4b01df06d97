"""What Live does: one player updated, quickly or as a whole. Not meant to be pressed."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import orders, session
from .turns import TurnsVerb


class BEYOND_MOCAP_OT_update_live(TurnsVerb, bpy.types.Operator):
    """Update one player, quickly or as a whole; Live does it by itself"""

    bl_idname = "beyond_mocap.update_live"
    bl_label = "Live Update"
    bl_options = {"UNDO", "INTERNAL"}

    player: bpy.props.StringProperty(name="Player", description="Name of the player in the list", options={"SKIP_SAVE"})
    kind: bpy.props.EnumProperty(
        name="Kind", items=(("quick", "Quick", "By a narrow search"),
                            ("whole", "Whole", "As well as can be, with figures")),
        description="How it is made",
    )

    def wanted(self, context):
        """The one player, from his take."""
        found = context.scene.beyond_mocap.players.get(self.player)
        if found is None:
            raise InputError("Live Update", f"no player {self.player!r}", "a player of the list")
        if self.kind == "whole":  # what was quick and yet as good as it can be only lacks its figures
            made = session.made(found.take)
            return [(found, orders.How("whole" if made is None or made.take.cut_short else "update"))]
        return [(found, orders.How(self.kind))]
