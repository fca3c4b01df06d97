"""Remove Reference Video: the scene lets go of it."""

from __future__ import annotations

import bpy

from ..scene import video
from .verb import Verb


class BEYOND_MOCAP_OT_remove_video(Verb, bpy.types.Operator):
    """Let go of the reference video; the movie clip itself stays in the file"""

    bl_idname = "beyond_mocap.remove_video"
    bl_label = "Remove Reference Video"

    @classmethod
    def poll(cls, context):
        """There is one."""
        cls.poll_message_set("There is no reference video")
        return context.scene.beyond_mocap.video.clip is not None

    def do(self, context):
        """Release it."""
        video.release(context.scene)
