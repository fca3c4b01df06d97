"""Export Words: a player's strips as a file in the text form."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.annotation import format_timeline
from ..beyond_mocap.errors import InputError
from ..scene import lanes
from ..scene.subject import name_of, subject
from .timeline_verb import TimelineVerb


class BEYOND_MOCAP_OT_export_words(TimelineVerb, ExportHelper, bpy.types.Operator):
    """Write what the strips and key moments say into a file, a line each: 'START END words' and 'TIME words',
seconds"""

    bl_idname = "beyond_mocap.export_words"
    bl_label = "Export Words"
    bl_options = {"REGISTER"}
    filename_ext = ".txt"

    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    def do(self, context):
        """Write the file."""
        if not self.filepath:
            raise InputError("export", "no file given", "a place to write", "choose one")
        target = subject(context)
        words = format_timeline(lanes.read(target, name_of(target)))
        with open(bpy.path.abspath(self.filepath), "w", encoding="utf-8", newline="\n") as file:
            file.write(words)
        self.report({"INFO"}, f"{words.count(chr(10))} lines in {self.filepath}")
