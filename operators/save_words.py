"""Save Words: what the active clip's strips say, beside the clip or in the library's table."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..scene import clip_annotation, clips, proposals
from .verb import Verb


class BEYOND_MOCAP_OT_save_words(Verb, bpy.types.Operator):
    """Write the words of the active clip's strips to NAME.txt beside the clip, or into the annotations.csv that speaks
of it. What is written there already is overwritten only when you say so"""

    bl_idname = "beyond_mocap.save_words"
    bl_label = "Save Words"
    bl_options = {"REGISTER"}

    overwrite: BoolProperty(
        name="Overwrite", description="Replace what is written about this clip", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        """An armature that shows a clip."""
        cls.poll_message_set("Open a clip with Annotate Clip first, and keep its armature active")
        return bool(clip_annotation.shown(context.object))

    def invoke(self, context, event):
        """Ask before words are overwritten."""
        from ..beyond_mocap.errors import InputError
        from ..beyond_mocap.library.keep_words import has_words, place

        rig = context.object
        clip, folder = clip_annotation.clip_file(rig)
        try:
            there = has_words(clip, folder, rig.get(clip_annotation.RATE, 30.0))
            form, target = place(clip, folder)
        except (InputError, OSError):
            return self.execute(context)
        if not there:
            return self.execute(context)
        self.overwrite = True
        what = (
            f"Replace the words in {target.name}?" if form == "TEXT" else f"Replace this clip's rows in {target.name}?"
        )
        return context.window_manager.invoke_confirm(self, event, title=what, confirm_text="Replace", icon="WARNING")

    def do(self, context):
        """Read the strips, write the file, and show the words in the list."""
        from ..beyond_mocap.library.keep_words import keep

        rig = context.object
        rows = clip_annotation.said(rig)
        clip, folder = clip_annotation.clip_file(rig)
        target = keep(clip, folder, rows, rig[clip_annotation.RATE], self.overwrite, proposals.sources(rig))
        clips.say(context.window_manager, clip_annotation.shown(rig), rows)
        self.report({"INFO"}, f"{len(rows)} rows of words written to {target}; Build Library takes them in")
