"""Edit Words: the picked key moment's or the selected span's, checked while they are typed."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import lanes, lay_strips, word_checks
from ..scene.strip_lines import said, words_of
from ..scene.subject import name_of, subject
from .timeline_verb import TimelineVerb, selected_spans


class BEYOND_MOCAP_OT_edit_words(TimelineVerb, bpy.types.Operator):
    """Change the words of the picked key moment, or of the selected span where none is picked. Words that are unknown,
or that the library does not have, are told while you type"""

    bl_idname = "beyond_mocap.edit_words"
    bl_label = "Edit Words"

    words: StringProperty(name="Words", description="What is done; -word for what must not be")

    def invoke(self, context, _event):
        """Show the words that are there now."""
        if self.attempt(lambda: self.load(context)) == {"CANCELLED"}:
            return {"CANCELLED"}
        return context.window_manager.invoke_props_dialog(self, width=480)

    def load(self, context):
        """The words that are there now."""
        self.words = words_of(_item(chosen(subject(context))))

    def draw(self, context):
        """The words, and what is wrong with them."""
        self.layout.prop(self, "words", text="")
        try:
            placed = chosen(subject(context))
            lines = word_checks.lines_for(context.scene, _said(self.words, placed))
        except InputError as error:
            lines = [str(error)]
        for line in lines:
            self.layout.label(text=line, icon="ERROR")

    def do(self, context):
        """Write them."""
        target = subject(context)
        placed = chosen(target)
        item = _said(self.words, placed)
        if isinstance(placed, lanes.PlacedMoment):
            lay_strips.change_moment(target, placed.strip, placed.index, item)
        else:
            lay_strips.change_span(target, placed.strip, item)


def chosen(target: bpy.types.Object):
    """The picked key moment, else the selected span; InputError where there is not one of them."""
    moments = [moment for moment in lanes.moments(target) if moment.selected]
    spans = selected_spans(target)
    if moments:
        return moments[0]
    if len(spans) != 1:
        found = f"no key moment is picked and {len(spans)} spans are selected"
        raise InputError(name_of(target), found, "one of them", "click the name of a key moment, or one strip")
    return spans[0]


def _item(placed):
    return placed.key if isinstance(placed, lanes.PlacedMoment) else placed.span


def _said(words: str, placed):
    if isinstance(placed, lanes.PlacedMoment):
        return said(words, placed.time)
    return said(words, placed.span.start, placed.span.end)
