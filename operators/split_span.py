"""Split Span: the selected strips under the playhead become two."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import lanes, lay_strips
from ..scene.subject import name_of, subject
from .timeline_verb import TimelineVerb, playhead


class BEYOND_MOCAP_OT_split_span(TimelineVerb, bpy.types.Operator):
    """Split the spans under the playhead there; where strips are selected, only those. Both parts keep the words"""

    bl_idname = "beyond_mocap.split_span"
    bl_label = "Split Span at Playhead"

    def do(self, context):
        """Each becomes two."""
        target = subject(context)
        time, clock = playhead(context, target), lanes.written_for(target)
        frame = clock.whole(time)
        there = [span for span in lanes.spans(target) if span.first < frame < span.last and not span.automatic]
        there = [span for span in there if span.selected] or there
        if not there:
            raise InputError(name_of(target), "no span is under the playhead", "one", "put the playhead into a strip")
        for placed in there:
            lay_strips.change_span(target, placed.strip, replace(placed.span, end=time))
            lay_strips.add_span(target, replace(placed.span, start=time), clock)
