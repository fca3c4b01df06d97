"""Make Scene: players pass the ball as the lists say. Clear Scene: what was made for it goes."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..beyond_mocap.errors import InputError
from ..scene.passes import examples, make
from .verb import BackgroundVerb, Verb


class BEYOND_MOCAP_OT_passes_make(BackgroundVerb, bpy.types.Operator):
    """Let the players of the list pass the ball as the passes say: bodies and ball are made where there are none. Each
flight leaves one body at its strike and arrives at the next one at his"""

    bl_idname = "beyond_mocap.passes_make"
    bl_label = "Make Scene"
    kind = "passes"

    live: BoolProperty(
        name="Live", options={"HIDDEN", "SKIP_SAVE"},
        description="Whether an edit asked for it: what is wrong is told in the panel",
    )

    @classmethod
    def poll(cls, context):
        """Players and passes."""
        cls.poll_message_set("Add players and passes, or take a sample")
        settings = context.scene.beyond_mocap_passes
        return len(settings.players) > 1 and len(settings.passes) > 0

    def order(self, context):
        """What is to be made."""
        if not self.live:
            examples.forget()
        return make.order_of(context.scene)

    @staticmethod
    def work(order, progress, cancelled, hurry):
        """Play the scene."""
        return make.work(order, progress, cancelled, hurry)

    def apply(self, scene, result):
        """Bodies and ball; what is shown is what was ordered."""
        rows = {row.name for row in scene.beyond_mocap_passes.players}
        if missing := [one.name for one in result.passes.players if one.name not in rows]:
            raise InputError(
                "players", f"{missing[0]} is gone from the list meanwhile", "the same players", "press Make Scene again"
            )
        make.show(scene, result)
        self.report({"INFO"}, ", ".join(scene.beyond_mocap_passes.figures.splitlines()[:3]))

    def modal(self, context, event):
        """One that an edit asked for makes way for the next edit's without a word."""
        if self.live and self.job.stale:
            self.ended(context)
            return {"CANCELLED"}
        return super().modal(context, event)

    def failed(self, message):
        """A live edit that makes no sense just now is told in the panel; the scene shown stays."""
        if not self.live:
            return super().failed(message)
        bpy.context.scene.beyond_mocap_passes.told = message
        return {"CANCELLED"}


class BEYOND_MOCAP_OT_passes_clear(Verb, bpy.types.Operator):
    """Take away what Make Scene has made: bodies, ball and net. Bodies that were yours play their own motion again; the
lists stay"""

    bl_idname = "beyond_mocap.passes_clear"
    bl_label = "Clear Scene"

    @classmethod
    def poll(cls, context):
        """A scene is shown."""
        cls.poll_message_set("Nothing has been made")
        return bool(context.scene.beyond_mocap_passes.made_of)

    def do(self, context):
        """Take it away."""
        make.clear(context.scene)
