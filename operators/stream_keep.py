"""Keep Recording: the last seconds of the stream as a body with an action."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty

from ..beyond_mocap.errors import InputError
from ..beyond_mocap.stream.live_hits import recorded
from ..scene.stream import receiver, streamed
from .verb import Verb


class BEYOND_MOCAP_OT_stream_keep(Verb, bpy.types.Operator):
    """Make a body that plays the last seconds of the stream, from the present frame on"""

    bl_idname = "beyond_mocap.stream_keep"
    bl_label = "Keep Recording"

    seconds: FloatProperty(
        name="Seconds", default=10.0, min=0.1, max=20.0, description="How much of what has just been seen is kept"
    )

    @classmethod
    def poll(cls, context):
        """Something to keep."""
        cls.poll_message_set("No stream is listened to: press Start Stream first")
        return receiver.listener() is not None

    def do(self, context):
        """Read the ring, write an action."""
        motion = recorded(receiver.listener(), self.seconds)
        if motion is None:
            raise InputError("stream", "nothing has arrived yet", "frames", "start the sender")
        streamed.keep(context, motion)
