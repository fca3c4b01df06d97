"""Add Player from Dot: a dot that was appended from another file brings its player along."""

from __future__ import annotations

import bpy

from ..scene import dots, strip_events
from .import_tracking import free_name
from .verb import Verb


class BEYOND_MOCAP_OT_player_from_dot(Verb, bpy.types.Operator):
    """Make players of the selected dots that no player in the list has, such as those appended from another file; their
strips come along"""

    bl_idname = "beyond_mocap.player_from_dot"
    bl_label = "Add Player from Dot"

    @classmethod
    def poll(cls, context):
        """A dot without a player is selected."""
        cls.poll_message_set("Select a dot that was appended from another file first")
        return bool(dots.orphans(context))

    def do(self, context):
        """A player for each; his strips are laid for this scene's clock."""
        settings = context.scene.beyond_mocap
        found = dots.orphans(context)
        if not settings.players:
            settings.start_time = min(dots.first_second(dot) for dot in found)
        for dot in found:
            name = free_name(dot.beyond_mocap_dot.player, {player.name for player in settings.players})
            dots.adopt(settings, dot, name)
        strip_events.put_in_order(context.scene)
        self.report({"INFO"}, f"players in the list: {len(settings.players)}")
