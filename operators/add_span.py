"""Add Span: a stretch with words, over the preview range or from the playhead on."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import lay_strips, word_checks
from ..scene.strip_lines import said
from ..scene.subject import clock, subject, with_lanes
from .timeline_verb import WritingVerb


class BEYOND_MOCAP_OT_add_span(WritingVerb, bpy.types.Operator):
    """Add a stretch with words: over the preview range where one is set (P in the editor), else one second from the
playhead on"""

    bl_idname = "beyond_mocap.add_span"
    bl_label = "Add Span"

    words: StringProperty(name="Words", default="running", description="What is done there; -word for what must not be")
    start: FloatProperty(
        name="From", default=0.0, unit="TIME_ABSOLUTE", precision=3, options={"SKIP_SAVE"},
        description="Seconds on the track's clock; where From and To are equal, the preview range or the playhead",
    )
    end: FloatProperty(
        name="To", default=0.0, unit="TIME_ABSOLUTE", precision=3, options={"SKIP_SAVE"},
        description="Seconds on the track's clock",
    )

    def invoke(self, context, _event):
        """Ask for the words."""
        return context.window_manager.invoke_props_dialog(self, width=420)

    def draw(self, context):
        """The words, and what is wrong with them."""
        self.layout.prop(self, "words")
        try:
            lines = word_checks.lines_for(context.scene, said(self.words, 0.0, 1.0))
        except InputError as error:
            lines = [str(error)]
        for line in lines:
            self.layout.label(text=line, icon="ERROR")

    def do(self, context):
        """Lay the strip."""
        given = round(self.start, 4), round(self.end, 4)  # Blender's numbers are not finer
        start, end = given if self.end != self.start else self.stretch(context)
        if end <= start:
            raise InputError("span", f"the end {end:g} is not after the start {start:g}", "START < END")
        span = said(self.words, start, end)
        target = with_lanes(context)
        lay_strips.add_span(target, span, clock(context, target))

    @staticmethod
    def stretch(context) -> tuple[float, float]:
        """The preview range, or a second from the playhead on."""
        scene, there = context.scene, subject(context) or with_lanes(context)
        time = clock(context, there)
        if scene.use_preview_range:
            return time.seconds(scene.frame_preview_start), time.seconds(scene.frame_preview_end)
        return time.seconds(scene.frame_current), time.seconds(scene.frame_current) + 1.0
