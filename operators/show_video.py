"""Show Reference Video: a clip editor beside the 3D view, with the scene's video in it."""

from __future__ import annotations

import bpy

from ..scene import areas
from ..scene.video import drive
from .verb import Verb


class BEYOND_MOCAP_OT_show_video(Verb, bpy.types.Operator):
    """Open a movie clip editor beside the 3D view, with the reference video in it"""

    bl_idname = "beyond_mocap.show_video"
    bl_label = "Show Beside the 3D View"

    @classmethod
    def poll(cls, context):
        """There is a video, and a screen to show it on."""
        cls.poll_message_set("Load a reference video first")
        return context.scene.beyond_mocap.video.clip is not None

    def do(self, context):
        """Drive it anew, where that was lost, and show it."""
        drive(context.scene)
        beside(context, context.scene.beyond_mocap.video.clip)


def beside(context: bpy.types.Context, clip: bpy.types.MovieClip) -> None:
    """Show the clip in a clip editor: one that is open, else the left half of the largest 3D view, else nowhere."""
    area = areas.editor(context, "CLIP_EDITOR", "VERTICAL", 0.45)
    if area is None:
        return
    space = area.spaces.active
    space.mode, space.view = "TRACKING", "CLIP"
    space.clip = clip
    for part in ("show_region_toolbar", "show_region_ui", "show_region_hud"):
        if hasattr(space, part):
            setattr(space, part, False)
    space.lock_selection = False
    area.tag_redraw()
