"""Add Key Moment: at the playhead."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import lay_strips, word_checks
from ..scene.strip_lines import said
from ..scene.subject import clock, with_lanes
from .timeline_verb import WritingVerb, playhead


class BEYOND_MOCAP_OT_add_moment(WritingVerb, bpy.types.Operator):
    """Add a key moment at the playhead: a kick, a header, a catch, met to half a frame"""

    bl_idname = "beyond_mocap.add_moment"
    bl_label = "Add Key Moment"

    words: StringProperty(name="Words", default="kick", description="What happens there; -word for what must not be")

    def invoke(self, context, _event):
        """Ask for the words."""
        return context.window_manager.invoke_props_dialog(self, width=420)

    def draw(self, context):
        """The words, and what is wrong with them."""
        self.layout.prop(self, "words")
        try:
            lines = word_checks.lines_for(context.scene, said(self.words, 0.0))
        except InputError as error:
            lines = [str(error)]
        for line in lines:
            self.layout.label(text=line, icon="ERROR")

    def do(self, context):
        """Set the marker, picked."""
        said(self.words, 0.0)
        target = with_lanes(context)
        lay_strips.add_moment(target, said(self.words, playhead(context, target)), clock(context, target))
