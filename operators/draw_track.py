"""Draw Track: a player whose track is a curve, drawn in the view."""

from __future__ import annotations

import bpy

from ..scene import dots, drawn_track, linked
from .import_tracking import free_name, shirt_for
from .verb import Verb


class BEYOND_MOCAP_OT_draw_track(Verb, bpy.types.Operator):
    """Add a player whose track is a curve from the 3D cursor on, to be bent in edit mode. Each point has its speed in
m/s: Set Speed, or its Radius in the Item tab (Alt-S). At a point of speed 0 he waits"""

    bl_idname = "beyond_mocap.draw_track"
    bl_label = "Draw Track"

    @classmethod
    def poll(cls, context):
        """Object mode, since something is added."""
        cls.poll_message_set("Leave edit mode first (Tab)")
        return context.mode == "OBJECT"

    def do(self, context):
        """Curve, player, dot."""
        scene = context.scene
        linked.refuse(scene)
        name = free_name("Drawn", {player.name for player in scene.beyond_mocap.players})
        drawn = drawn_track.create(context, f"{name} curve", context.collection)
        add_player(context, drawn, name)
        for other in context.selected_objects:
            other.select_set(False)
        drawn.select_set(True)
        context.view_layer.objects.active = drawn
        self.report({"INFO"}, f"{name}: bend the curve in edit mode (Tab), set speeds of its points, then Synthesize")


def add_player(context, drawn: bpy.types.Object, name: str):
    """One more player in the list, who goes where `drawn` leads; his dot is in the scene."""
    settings = context.scene.beyond_mocap
    player = settings.players.add()
    player.name, player.drawn_track = name, drawn
    player.shirt = shirt_for(len(settings.players) - 1)
    settings.active_player = len(settings.players) - 1
    dots.ensure(context, player)
    return player
