"""Resynthesize Stretch: some seconds of a take are searched anew with other clips; the rest stays as it is."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty

from ..beyond_mocap.errors import InputError
from ..scene import orders, stretch
from .turns import TurnsVerb


class BEYOND_MOCAP_OT_resynthesize_stretch(TurnsVerb, bpy.types.Operator):
    """Search these seconds anew, without the clips that are shown there where that can be: those of the selected strip
of an accepted result, of a selected span of words, or the preview range. All else stays to the last bit"""

    bl_idname = "beyond_mocap.resynthesize_stretch"
    bl_label = "Resynthesize Stretch"

    start: FloatProperty(
        name="From", options={"SKIP_SAVE"}, unit="TIME_ABSOLUTE", description="Second on the track's clock",
    )
    end: FloatProperty(
        name="To", options={"SKIP_SAVE"}, unit="TIME_ABSOLUTE",
        description="Second on the track's clock; 0: as selected",
    )

    @classmethod
    def poll(cls, context):
        """A take."""
        cls.poll_message_set("Synthesize first")
        return any(player.take for player in context.scene.beyond_mocap.players)

    def wanted(self, context):
        """The seconds that were named, or those of what is selected."""
        settings = context.scene.beyond_mocap
        if self.end > self.start:
            player = settings.players.get(self.player) if self.player else stretch.player_shown(context.scene)
            if player is None:
                raise InputError("a stretch made anew", f"no player {self.player!r}", "a player with a take")
            return [(player, orders.How("stretch", self.start, self.end))]
        player, start, end = stretch.selected(context.scene)
        return [(player, orders.How("stretch", start, end))]
