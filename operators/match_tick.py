"""Ticks of the match's list: everybody, nobody, one team, or the chosen player alone."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ..scene.match.settings import active_of
from .verb import Verb

WHOM = (
    ("ALL", "All", "Tick everybody"), ("NONE", "None", "Tick nobody"), ("home", "Home", "Tick the home team alone"),
    ("away", "Away", "Tick the away team alone"), ("ONE", "Chosen", "Tick the chosen player alone"),
)


class BEYOND_MOCAP_OT_tick_match(Verb, bpy.types.Operator):
    """Choose whom the match is made of"""

    bl_idname = "beyond_mocap.tick_match"
    bl_label = "Tick Players"

    whom: EnumProperty(name="Whom", items=WHOM, default="ALL", description="Who is ticked")

    @classmethod
    def poll(cls, context):
        """There is a list."""
        cls.poll_message_set("Press Read Match first")
        return len(context.scene.beyond_mocap_match.players) > 0

    @classmethod
    def description(cls, _context, properties):
        """What this button does."""
        return next(item[2] for item in WHOM if item[0] == properties.whom)

    def do(self, context):
        """Set the ticks."""
        match = context.scene.beyond_mocap_match
        chosen = active_of(match)
        for player in match.players:
            alone = player == chosen if self.whom == "ONE" else player.team == self.whom
            player.use = self.whom == "ALL" or (self.whom != "NONE" and alone)
