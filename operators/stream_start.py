"""Start Stream: listen to a program on this machine that sends motion while it is made."""

from __future__ import annotations

import bpy

from ..scene.stream import follow, receiver
from .verb import Verb


class BEYOND_MOCAP_OT_stream_start(Verb, bpy.types.Operator):
    """Receive motion live from a suit's program on this machine, as BVH frames over UDP or TCP; a body shows it.
Nothing from other machines gets in, and nothing is sent"""

    bl_idname = "beyond_mocap.stream_start"
    bl_label = "Start Stream"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """One stream at a time."""
        cls.poll_message_set("A stream is listened to already: press Stop Stream first")
        return receiver.listener() is None

    def do(self, context):
        """Bind the port and begin to listen."""
        receiver.start(context.scene.beyond_mocap_stream)
        follow.began()
