"""Import Clip: the clip chosen in the library's list, as an armature with a body, to be looked at."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import clips, recordings
from .verb import Verb


class BEYOND_MOCAP_OT_import_clip(Verb, bpy.types.Operator):
    """Bring this clip of the library into the scene as it was recorded: an armature with a body and the clip's action"""

    bl_idname = "beyond_mocap.import_clip"
    bl_label = "Import Clip"

    path: StringProperty(name="Clip", description="Below the library's folder; empty: the one chosen in the list")
    dressed: BoolProperty(name="Body", default=True, description="With a low-poly body, not only bones")

    @classmethod
    def poll(cls, context):
        """A clip in the list."""
        cls.poll_message_set("No clip is listed; press Build Library first")
        return clips.active(context.window_manager) is not None

    def do(self, context):
        """Read the file, then make the armature."""
        settings = context.scene.beyond_mocap
        chosen = clips.active(context.window_manager)
        path = self.path or (chosen.path if chosen else "")
        if not path:
            raise InputError("import", "no clip chosen", "a clip of the library's list")
        clip, notes = recordings.read(settings, path)
        body = recordings.show(context, clip, path, self.dressed)
        for note in notes:
            self.report({"INFO"}, f"{body.name}: {note}")
        self.report({"INFO"}, f"{body.name}: {clip.duration:.1f} s, {len(clip)} frames at {clip.fps:g} per second")
