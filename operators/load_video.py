"""Load Reference Video: a movie or image sequence beside the match, at its own rate."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..beyond_mocap.errors import InputError
from ..scene import video
from .show_video import beside
from .verb import Verb

FILES = "*.mp4;*.mov;*.avi;*.mkv;*.webm;*.m4v;*.mpg;*.mpeg;*.mts;*.png;*.jpg;*.jpeg;*.tif;*.tiff;*.bmp;*.exr"


class BEYOND_MOCAP_OT_load_video(Verb, ImportHelper, bpy.types.Operator):
    """Load a movie, or the first picture of an image sequence, to watch beside the match while annotating. It plays at
its own speed whatever the scene's frame rate"""

    bl_idname = "beyond_mocap.load_video"
    bl_label = "Load Reference Video"

    filter_glob: StringProperty(default=FILES, options={"HIDDEN"})
    rate: FloatProperty(
        name="Frames per Second", default=0.0, min=0.0, max=1000.0, precision=3,
        description="Of the video; 0 takes what a movie file says, and for an image sequence the scene's own rate",
    )
    show: BoolProperty(name="Show", default=True, description="Open an editor beside the 3D view for it")

    def invoke(self, context, event):
        """The file browser."""
        return ImportHelper.invoke(self, context, event)

    def do(self, context):
        """Load it and drive it; then make room for it."""
        if not self.filepath:
            raise InputError("video", "no file given", "a movie, or the first picture of a sequence", "choose one")
        clip, scene = video.load(bpy.path.abspath(self.filepath)), context.scene
        video.show(scene, clip, self.rate or None)
        if self.show:
            beside(context, clip)
        rate = scene.beyond_mocap.video.rate
        self.report({"INFO"}, f"{clip.name}: {clip.frame_duration} frames at {rate:.6g} per second")
