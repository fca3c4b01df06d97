"""Import Clip: the clip chosen in the library's list, as an armature with a body, to be looked at."""

from __future__ import annotations

import bpy

from ..scene import recordings
from .clip_verb import ClipVerb


class BEYOND_MOCAP_OT_import_clip(ClipVerb, bpy.types.Operator):
    """Bring this clip of the library into the scene as it was recorded: an armature with a body and the clip's
action"""

    bl_idname = "beyond_mocap.import_clip"
    bl_label = "Import Clip"

    def do(self, context):
        """Read the file, then make the armature."""
        path = self.clip(context)
        clip, notes = recordings.read(context.scene.beyond_mocap, path)
        body = recordings.show(context, clip, path, self.dressed)
        for note in notes:
            self.report({"INFO"}, f"{body.name}: {note}")
        self.report({"INFO"}, f"{body.name}: {clip.duration:.1f} s, {len(clip)} frames at {clip.fps:g} per second")
