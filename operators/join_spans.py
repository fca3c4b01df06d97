"""Join Spans: the selected strips become one."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import lanes, lay_strips
from ..scene.strip_lines import words_of
from ..scene.subject import name_of, subject
from .timeline_verb import TimelineVerb, selected_spans


class BEYOND_MOCAP_OT_join_spans(TimelineVerb, bpy.types.Operator):
    """Join the selected spans into one, from the first one's start to the last one's end, with the first one's words"""

    bl_idname = "beyond_mocap.join_spans"
    bl_label = "Join Spans"

    @classmethod
    def poll(cls, context):
        """Two strips are selected."""
        if not super().poll(context):
            return False
        cls.poll_message_set("Select two or more strips of one player first")
        chosen = [strip for _, strip in lanes.strips(subject(context)) if strip.select]
        return sum(strip.action.beyond_mocap.kind != "moments" for strip in chosen) > 1

    def do(self, context):
        """The first one is lengthened, the others go; their key moments stay."""
        target = subject(context)
        chosen = selected_spans(target)
        if len(chosen) < 2:
            raise InputError(name_of(target), "fewer than two spans are selected", "two or more", "select their strips")
        inner = [moment.key for moment in lanes.moments(target) if moment.strip in {span.strip for span in chosen[1:]}]
        for placed in chosen[1:]:
            lay_strips.remove_span(target, placed.strip)
        end = max(placed.span.end for placed in chosen)
        lay_strips.change_span(target, chosen[0].strip, replace(chosen[0].span, end=end))
        for key in inner:
            lay_strips.add_moment(target, key, lanes.written_for(target))
        words = {words_of(placed.span) for placed in chosen}
        if len(words) > 1:
            self.report({"WARNING"}, f"joined as '{words_of(chosen[0].span)}'")
