"""Act: a strike of an armature's own motion, in place of a streamed one."""

from __future__ import annotations

import bpy

from ..scene.passes.settings import subject
from ..scene.stream import play
from .verb import Verb


class BEYOND_MOCAP_OT_stream_act(Verb, bpy.types.Operator):
    """Let who has the ball do what the selected armature does: its strike nearest to the present frame is the example,
as if you had just done it yourself"""

    bl_idname = "beyond_mocap.stream_act"
    bl_label = "Do as Selected"

    @classmethod
    def poll(cls, context):
        """A rally, and an armature that shows how."""
        cls.poll_message_set("Press Play Live, and select an armature whose motion has a strike")
        return play.rally() is not None and subject(context) is not None

    def do(self, context):
        """Find the strike; in a window the answer comes as soon as it is worked out."""
        hit = play.shown_by(context.scene, subject(context))
        if bpy.app.background:
            play.answer_now(context.scene, hit)
        else:
            play.struck(context.scene, hit, 0.0)
