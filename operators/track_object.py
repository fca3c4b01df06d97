"""Track from Object: a player who goes where the active curve or moving object leads."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import drawn_track, linked
from ..scene.settings import active_player, is_track
from .draw_track import add_player
from .import_tracking import free_name
from .verb import Verb


class BEYOND_MOCAP_OT_track_object(Verb, bpy.types.Operator):
    """Take the active object as a track: a curve with speeds at its points, or anything that moves (an Empty, a mesh,
another armature's hips), by keys or constraints. It becomes a new player's, or the active player's"""

    bl_idname = "beyond_mocap.track_object"
    bl_label = "Track from Object"

    for_active: bpy.props.BoolProperty(
        name="Active Player", description="Give it to the active player in the list instead of adding one",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        """An object that may be one."""
        cls.poll_message_set("Choose a curve or a moving object first")
        return context.object is not None and is_track(None, context.object)

    def do(self, context):
        """Read it, so that what is wrong is told, and take it."""
        scene, chosen = context.scene, context.object
        linked.refuse(scene)
        player = active_player(scene.beyond_mocap)
        if self.for_active and player is None:
            raise InputError("players", "none in the list", "a player", "switch Active Player off to add one")
        track = drawn_track.read(scene, chosen)
        if self.for_active:
            player.drawn_track = chosen
        else:
            names = {player.name for player in scene.beyond_mocap.players}
            player = add_player(context, chosen, free_name(chosen.name, names))
        seconds = track.times[-1] - track.times[0]
        self.report({"INFO"}, f"{player.name}: {seconds:.1f} s along {chosen.name}")
