"""Pass To: who gets the next pass of a rally that is played live."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

from ..beyond_mocap.errors import InputError
from ..scene.stream import play
from .verb import Verb


class BEYOND_MOCAP_OT_stream_target(Verb, bpy.types.Operator):
    """Let the next pass of Play Live go to this player"""

    bl_idname = "beyond_mocap.stream_target"
    bl_label = "Pass To"

    number: IntProperty(name="Number", default=1, min=1, max=99, description="Of the player in the list, from 1")

    @classmethod
    def poll(cls, context):
        """Something that is played."""
        cls.poll_message_set("Nothing is played live: press Play Live first")
        return play.rally() is not None

    def do(self, context):
        """Remember who."""
        names = [row.name for row in context.scene.beyond_mocap_passes.players]
        if self.number > len(names):
            raise InputError("player", f"number {self.number}", f"1 to {len(names)}")
        if names[self.number - 1] == play.rally().holder:
            raise InputError("player", f"{names[self.number - 1]} has the ball", "another one")
        context.scene.beyond_mocap_stream.target = names[self.number - 1]
