"""Error Curves: a take's figures on its armature, shown or taken away."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..beyond_mocap.errors import InputError
from ..scene import error_curves, session
from ..scene.settings import active_player
from .verb import Verb


class BEYOND_MOCAP_OT_error_curves(Verb, bpy.types.Operator):
    """Show the active player's errors over time as curves in the Graph Editor: root error, slide of both feet, foot
corrections, jerk, speed, cuts. They are custom properties of the armature and go with the take"""

    bl_idname = "beyond_mocap.error_curves"
    bl_label = "Error Curves"

    remove: BoolProperty(name="Remove", options={"SKIP_SAVE"}, description="Take the curves away instead")

    @classmethod
    def poll(cls, context):
        """A player with a body."""
        cls.poll_message_set("Synthesize first: the active player has no body with a take")
        player = active_player(context.scene.beyond_mocap)
        return player is not None and player.body is not None and bool(player.take or error_curves.there(player.body))

    def do(self, context):
        """Write or remove them."""
        player = active_player(context.scene.beyond_mocap)
        if player is None or player.body is None:
            raise InputError("error curves", "no player with a body", "one", "synthesize first")
        if player.body.library is not None or player.body.data.library is not None:
            raise InputError(f"body {player.body.name}", "linked from another file", "an armature of this file")
        if self.remove:
            error_curves.remove(player.body)
        elif session.made(player.take) is None:
            raise InputError(f"player {player.name}", "no take in this session", "a take", "synthesize again")
        else:
            error_curves.write(context.scene, player)
