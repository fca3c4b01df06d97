"""Annotate Clip: a clip of the library on an armature, its words as strips in the NLA editor."""

from __future__ import annotations

import bpy

from ..scene import clip_annotation, proposals, recordings
from .clip_verb import ClipVerb


class BEYOND_MOCAP_OT_annotate_clip(ClipVerb, bpy.types.Operator):
    """Open this clip of the library for annotation: an armature that plays it, with its words as strips and markers in
the NLA editor. Change them there, or have words proposed, then press Save Words"""

    bl_idname = "beyond_mocap.annotate_clip"
    bl_label = "Annotate Clip"

    def do(self, context):
        """Read clip and words, then make armature and strips."""
        from ..beyond_mocap.library.keep_words import as_timeline, read_sources, read_words

        settings, path = context.scene.beyond_mocap, self.clip(context)
        motion, _ = recordings.read(settings, path)
        folder = recordings.folder_of(settings)
        rows = read_words(folder / path, folder, motion.fps)
        timeline = as_timeline(rows, motion.fps)
        said = read_sources(folder / path, folder, rows, motion.fps)
        rig = recordings.show(context, motion, path, self.dressed)
        clip_annotation.lay(rig, context.scene, motion, timeline)
        for row, (source, confidence) in said.items():
            proposals.add(rig, row, source, confidence, "ACCEPTED")
        self.report({"INFO"}, f"{rig.name}: {len(rows)} {'row' if len(rows) == 1 else 'rows'} of words")
