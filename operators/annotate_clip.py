"""Annotate Clip: a clip of the library on an armature, its words as strips in the NLA editor."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import clip_annotation, clips, recordings
from .verb import Verb


class BEYOND_MOCAP_OT_annotate_clip(Verb, bpy.types.Operator):
    """Open this clip of the library for annotation: an armature that plays it, with its words as strips and markers in
the NLA editor. Change them there, or have words proposed, then press Save Words"""

    bl_idname = "beyond_mocap.annotate_clip"
    bl_label = "Annotate Clip"

    path: StringProperty(name="Clip", description="Below the library's folder; empty: the one chosen in the list")
    dressed: BoolProperty(name="Body", default=True, description="With a low-poly body, not only bones")

    @classmethod
    def poll(cls, context):
        """A clip in the list."""
        cls.poll_message_set("No clip is listed; press Build Library or List Clips first")
        return clips.active(context.window_manager) is not None

    def do(self, context):
        """Read clip and words, then make armature and strips."""
        from ..beyond_mocap.library.keep_words import as_timeline, read_words

        settings = context.scene.beyond_mocap
        chosen = clips.active(context.window_manager)
        path = self.path or (chosen.path if chosen else "")
        if not path:
            raise InputError("annotate", "no clip chosen", "a clip of the library's list")
        motion, _ = recordings.read(settings, path)
        folder = recordings.folder_of(settings)
        rows = read_words(folder / path, folder, motion.fps)
        rig = recordings.show(context, motion, path, self.dressed)
        clip_annotation.lay(rig, context.scene, motion, as_timeline(rows, motion.fps))
        self.report({"INFO"}, f"{rig.name}: {len(rows)} {'row' if len(rows) == 1 else 'rows'} of words")
