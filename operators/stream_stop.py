"""Stop Stream: listen no more."""

from __future__ import annotations

import bpy

from ..scene.stream import follow, receiver
from .verb import Verb


class BEYOND_MOCAP_OT_stream_stop(Verb, bpy.types.Operator):
    """Stop listening and close the port; the streamed body stays as it stands"""

    bl_idname = "beyond_mocap.stream_stop"
    bl_label = "Stop Stream"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Something to stop."""
        cls.poll_message_set("No stream is listened to: press Start Stream first")
        return receiver.listener() is not None

    def do(self, context):
        """Close."""
        receiver.stop()
        follow.tell()
