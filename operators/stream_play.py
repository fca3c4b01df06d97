"""Play Live: the players of the passing scene answer what the user does."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..scene.passes import make
from ..scene.stream import play
from .verb import BackgroundVerb


class BEYOND_MOCAP_OT_stream_play(BackgroundVerb, bpy.types.Operator):
    """Let who has the ball do what you do: each strike of the streamed body becomes a pass of the passing scene.
The library's most alike motion is played, to whom you choose by the keys 1 to 9 or by a click;
the scene plays on meanwhile"""

    bl_idname = "beyond_mocap.stream_play"
    bl_label = "Play Live"
    kind = "live"

    holder: StringProperty(name="Holder", description="Who has the ball first; empty: the first one of the list")

    @classmethod
    def poll(cls, context):
        """Players."""
        cls.poll_message_set("Add players and passes, or take a sample, under Passing Scene")
        settings = context.scene.beyond_mocap_passes
        return len(settings.players) > 1 and len(settings.passes) > 0

    def order(self, context):
        """The passing scene, and who has the ball."""
        settings = context.scene.beyond_mocap_passes
        return make.order_of(context.scene), self.holder or settings.players[0].name, play.seconds(context.scene)

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        """Everybody stands."""
        return play.begin(*order, progress, cancelled)

    def apply(self, scene, result):
        """Bodies and ball; from now on strikes are answered."""
        play.show(scene, result)
