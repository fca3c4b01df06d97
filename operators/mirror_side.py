"""Mirror Side: left and right change places in the words of what is selected."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..beyond_mocap.annotation import swap_sides
from ..beyond_mocap.errors import InputError
from ..scene import lanes, lay_strips
from ..scene.subject import name_of, subject
from .timeline_verb import TimelineVerb, selected_spans


class BEYOND_MOCAP_OT_mirror_side(TimelineVerb, bpy.types.Operator):
    """Exchange left and right in the words of the picked key moment and of the selected spans"""

    bl_idname = "beyond_mocap.mirror_side"
    bl_label = "Mirror Side"

    def do(self, context):
        """Change all whose words have a side."""
        target = subject(context)
        moments = [moment for moment in lanes.moments(target) if moment.selected]
        sided = [placed for placed in moments if _mirrored(placed.key) != placed.key]
        spans = [placed for placed in selected_spans(target) if _mirrored(placed.span) != placed.span]
        if not (sided or spans):
            found = "nothing with left or right is selected"
            raise InputError(name_of(target), found, "a span or key moment with a side", "select one")
        for placed in sided:
            lay_strips.change_moment(target, placed.strip, placed.index, _mirrored(placed.key))
        for placed in spans:
            lay_strips.change_span(target, placed.strip, _mirrored(placed.span))


def _mirrored(item):
    """The span or key moment with its sides exchanged."""
    return replace(item, words=swap_sides(item.words), avoid=swap_sides(item.avoid))
