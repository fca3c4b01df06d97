"""Stop Playing: the user's strikes are answered no more."""

from __future__ import annotations

import bpy

from ..scene.stream import play
from .verb import Verb


class BEYOND_MOCAP_OT_stream_end(Verb, bpy.types.Operator):
    """Answer no more strikes; what was played stays as it is and can be played back"""

    bl_idname = "beyond_mocap.stream_end"
    bl_label = "Stop Playing"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Something that is played."""
        cls.poll_message_set("Nothing is played live: press Play Live first")
        return play.rally() is not None

    def do(self, context):
        """No more."""
        play.stop()
        told = context.window_manager.beyond_mocap_streaming
        told.playing, told.played = False, ""
