"""Move Reference Video: earlier or later against the track by single frames of the video."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

from .verb import Verb


class BEYOND_MOCAP_OT_move_video(Verb, bpy.types.Operator):
    """Move the reference video against the track by frames of the video: earlier, it shows later pictures now"""

    bl_idname = "beyond_mocap.move_video"
    bl_label = "Move Reference Video"

    frames: IntProperty(name="Frames", default=1, description="Frames of the video by which it begins later")

    @classmethod
    def poll(cls, context):
        """There is a video."""
        cls.poll_message_set("Load a reference video first")
        return context.scene.beyond_mocap.video.clip is not None

    def do(self, context):
        """Add to its begin."""
        video = context.scene.beyond_mocap.video
        video.begins += self.frames / video.rate
