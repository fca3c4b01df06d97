"""Discard: put the takes that are shown away; what was there before is there again."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import preview
from .accept import ResultVerb
from .written import show_automatic


class BEYOND_MOCAP_OT_discard(ResultVerb, bpy.types.Operator):
    """Put the preview away: what the body played before is played again, and what was made for the preview goes"""

    bl_idname = "beyond_mocap.discard"
    bl_label = "Discard"

    @classmethod
    def poll(cls, context):
        """There is a preview."""
        cls.poll_message_set("No preview is shown: Synthesize shows one")
        return any(player.use and player.result.state == "PREVIEW" for player in context.scene.beyond_mocap.players)

    def do(self, context):
        """Every chosen player's preview."""
        players = [player for player in self.chosen(context) if player.result.state == "PREVIEW"]
        if not players:
            raise InputError("discard", "no preview is shown", "a preview", "synthesize first")
        for player in players:
            for line in preview.off_path(player):
                self.report({"INFO"}, line)
            preview.discard(context, player)
            show_automatic(context, player)
        self.report({"INFO"}, f"discarded: {', '.join(player.name for player in players)}")
