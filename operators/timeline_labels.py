"""Labels on the timeline: spans, sides, and the text form of annotations."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.annotation import format_timeline, read_timeline, swap_sides
from ..beyond_mocap.base.errors import InputError
from ..scene.core.settings import active_player, as_setting
from ..scene.library import recordings
from ..scene.player import tracks
from ..scene.timeline import lanes, lay_strips, strips
from ..scene.timeline.strip_lines import said, words_of
from ..scene.timeline.strips import active_clip, subject_clock, subject_name, subject_with_lanes, timeline_subject
from .timeline import TimelineVerb, WritingVerb, draw_complaints, playhead, selected_spans
from .verb import ImportVerb, Verb


class BEYOND_MOCAP_OT_add_span(WritingVerb, bpy.types.Operator):
    """Add a span with labels over the preview range (P in the editor), or one second from the playhead without one"""

    bl_idname = "beyond_mocap.add_span"
    bl_label = "Add Span"
    words: StringProperty(name="Labels", default="running", description="Labels of the span; a leading - excludes one")
    start: FloatProperty(
        name="From", default=0.0, unit="TIME_ABSOLUTE", precision=3, options={"SKIP_SAVE"},
        description="Start on the track's clock; if From and To are equal, the preview range or the playhead",
    )
    end: FloatProperty(name="To", default=0.0, unit="TIME_ABSOLUTE", precision=3, options={"SKIP_SAVE"},
                       description="End on the track's clock")

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self, width=420)

    def draw(self, context):
        """Draw the labels and what is wrong with them."""
        self.layout.prop(self, "words")
        draw_complaints(self.layout, context, lambda: said(self.words, 0.0, 1.0))

    def do(self, context):
        given = round(self.start, 4), round(self.end, 4)  # Blender's numbers are not finer
        start, end = given if self.end != self.start else self.stretch(context)
        if end <= start:
            raise InputError("span", f"the end {end:g} s is not after the start {start:g} s", "an end after the start")
        span = said(self.words, start, end)
        target = subject_with_lanes(context)
        lay_strips.add_span(target, span, subject_clock(context, target))

    @staticmethod
    def stretch(context) -> tuple[float, float]:
        """Compute the preview range, or a second from the playhead on."""
        scene, there = context.scene, timeline_subject(context) or subject_with_lanes(context)
        time = subject_clock(context, there)
        if scene.use_preview_range:
            return time.seconds(scene.frame_preview_start), time.seconds(scene.frame_preview_end)
        return time.seconds(scene.frame_current), time.seconds(scene.frame_current) + 1.0


class BEYOND_MOCAP_OT_split_span(TimelineVerb, bpy.types.Operator):
    """Split the spans at the playhead, or only the selected ones; both parts keep the labels"""

    bl_idname = "beyond_mocap.split_span"
    bl_label = "Split Span at Playhead"

    def do(self, context):
        target = timeline_subject(context)
        time, clock = playhead(context, target), lanes.written_for(target)
        frame = clock.whole(time)
        there = [span for span in lanes.spans(target) if span.first < frame < span.last and not span.automatic]
        there = [span for span in there if span.selected] or there
        if not there:
            found = "no span is under the playhead"
            raise InputError(subject_name(target), found, "one", "move the playhead into a strip")
        for placed in there:
            lay_strips.change_span(target, placed.strip, replace(placed.span, end=time))
            lay_strips.add_span(target, replace(placed.span, start=time), clock)


class BEYOND_MOCAP_OT_join_spans(TimelineVerb, bpy.types.Operator):
    """Join the selected spans into one, from the first start to the last end, with the labels of the first span"""

    bl_idname = "beyond_mocap.join_spans"
    bl_label = "Join Spans"

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        cls.poll_message_set("Select two or more strips of one player first")
        chosen = [strip for _, strip in lanes.strips(timeline_subject(context)) if strip.select]
        return sum(strip.action.beyond_mocap.kind != "moments" for strip in chosen) > 1

    def do(self, context):
        """Extend the first span and remove the others; their key moments stay."""
        target = timeline_subject(context)
        chosen = selected_spans(target)
        if len(chosen) < 2:
            found = "fewer than two spans are selected"
            raise InputError(subject_name(target), found, "two or more", "select their strips")
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


class BEYOND_MOCAP_OT_mirror_side(TimelineVerb, bpy.types.Operator):
    """Swap left and right in the labels of the selected key moment and spans"""

    bl_idname = "beyond_mocap.mirror_side"
    bl_label = "Mirror Side"

    def do(self, context):
        """Change all items whose labels have a side."""
        target = timeline_subject(context)
        moments = [moment for moment in lanes.moments(target) if moment.selected]
        sided = [placed for placed in moments if _mirrored(placed.key) != placed.key]
        spans = [placed for placed in selected_spans(target) if _mirrored(placed.span) != placed.span]
        if not (sided or spans):
            found = "nothing with left or right is selected"
            raise InputError(subject_name(target), found, "a span or key moment with a side", "select one")
        for placed in sided:
            lay_strips.change_moment(target, placed.strip, placed.index, _mirrored(placed.key))
        for placed in spans:
            lay_strips.change_span(target, placed.strip, _mirrored(placed.span))


def _mirrored(item):
    """Mirror the labels of a span or key moment."""
    return replace(item, words=swap_sides(item.words), avoid=swap_sides(item.avoid))


class BEYOND_MOCAP_OT_edit_words(TimelineVerb, bpy.types.Operator):
    """Edit the labels of the selected key moment or span, with problems shown while you type"""

    bl_idname = "beyond_mocap.edit_words"
    bl_label = "Edit Labels"
    words: StringProperty(name="Labels", description="Labels of the item; a leading - excludes one")

    def invoke(self, context, _event):
        """Open the dialog with the present labels."""
        if self.attempt(lambda: self.load(context)) == {"CANCELLED"}:
            return {"CANCELLED"}
        return context.window_manager.invoke_props_dialog(self, width=480)

    def load(self, context):
        """Load the present labels."""
        placed = chosen(timeline_subject(context))
        self.words = words_of(placed.key if isinstance(placed, lanes.PlacedMoment) else placed.span)

    def draw(self, context):
        """Draw the labels and what is wrong with them."""
        self.layout.prop(self, "words", text="")
        draw_complaints(self.layout, context, lambda: _said(self.words, chosen(timeline_subject(context))))

    def do(self, context):
        target = timeline_subject(context)
        placed = chosen(target)
        item = _said(self.words, placed)
        if isinstance(placed, lanes.PlacedMoment):
            lay_strips.change_moment(target, placed.strip, placed.index, item)
        else:
            lay_strips.change_span(target, placed.strip, item)


def chosen(target: bpy.types.Object):
    """Find the selected key moment, else the selected span. Raises InputError unless there is exactly one."""
    moments = [moment for moment in lanes.moments(target) if moment.selected]
    spans = selected_spans(target)
    if moments:
        return moments[0]
    if len(spans) != 1:
        found = f"no key moment and {len(spans)} spans are selected"
        raise InputError(subject_name(target), found, "one of them", "click the name of a key moment, or one strip")
    return spans[0]


def _said(words: str, placed):
    if isinstance(placed, lanes.PlacedMoment):
        return said(words, placed.time)
    return said(words, placed.span.start, placed.span.end)


class BEYOND_MOCAP_OT_read_words(Verb, bpy.types.Operator):
    """Replace the active player's strips and key moments by the labels of the text or file chosen in step 2"""

    bl_idname = "beyond_mocap.read_words"
    bl_label = "Read Labels"
    needs = ("Import tracking, and choose a file or text with labels in step 2 first",
             lambda context: (player := active_player(context.scene.beyond_mocap)) is not None
             and (player.annotation_text is not None or bool(player.annotation_file)))

    def do(self, context):
        """Read all labels, then write the strips."""
        settings = context.scene.beyond_mocap
        player = active_player(settings)
        timeline = strips.written_words(player, settings.rate, tracks.read_track(settings, player))
        strips.write(context, player, timeline)
        told = f"{player.name}: {len(timeline.spans)} spans and {len(timeline.keys)} key moments"
        self.report({"INFO"}, f"{told} from {strips.written_in(player)}")


class BEYOND_MOCAP_OT_words_to_text(TimelineVerb, bpy.types.Operator):
    """Write the strips and key moments to a text for the Text Editor, which becomes the player's text in step 2"""

    bl_idname = "beyond_mocap.words_to_text"
    bl_label = "Labels to Text"

    def do(self, context):
        """Write to the player's text, or to a new one."""
        target = timeline_subject(context)
        words = format_timeline(lanes.read(target, subject_name(target)))
        player = None if active_clip(context) else active_player(context.scene.beyond_mocap)
        text = player.annotation_text if player else None
        if text is None or text.library is not None:
            text = bpy.data.texts.new(f"{subject_name(target)} labels")
        text.clear()
        text.write(words)
        if player:
            player.annotation_text = text
        self.report({"INFO"}, f"{words.count(chr(10))} lines in the text {text.name}")


class BEYOND_MOCAP_OT_export_words(TimelineVerb, ExportHelper, bpy.types.Operator):
    """Write the strips and key moments to a file, one line each: 'START END labels' or 'TIME labels', in seconds"""

    bl_idname = "beyond_mocap.export_words"
    bl_label = "Export Labels"
    bl_options = {"REGISTER"}
    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    def do(self, context):
        if not self.filepath:
            raise InputError("export", "no file is chosen", "a file to write", "choose one")
        target = timeline_subject(context)
        words = format_timeline(lanes.read(target, subject_name(target)))
        with open(bpy.path.abspath(self.filepath), "w", encoding="utf-8", newline="\n") as file:
            file.write(words)
        self.report({"INFO"}, f"{words.count(chr(10))} lines in {self.filepath}")


class BEYOND_MOCAP_OT_import_words(ImportVerb, bpy.types.Operator):
    """Import a text file of labels ('START END labels', 'TIME labels') in place of the strips of the active player, or
of the library clip whose armature is active"""

    bl_idname = "beyond_mocap.import_words"
    bl_label = "Import Labels"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})
    needs = ("Import tracking first: labels belong to a player",
             lambda context: bool(recordings.shown_clip(context.object))
             or active_player(context.scene.beyond_mocap) is not None)

    def do(self, context):
        """Read the file, then write the strips."""
        path = self.chosen_one("one text file of labels")
        settings, rig = context.scene.beyond_mocap, context.object
        if recordings.shown_clip(rig):
            motion, _ = recordings.read_recording(settings, recordings.shown_clip(rig), rig[recordings.FOLDER])
            timeline, whose = read_timeline(path, motion.fps), rig.name
            recordings.lay_words(rig, context.scene, motion, timeline)
        else:
            player = active_player(settings)
            start = float(tracks.read_track(settings, player).times[0])
            timeline, whose = read_timeline(path, settings.rate, start), player.name
            strips.write(context, player, timeline)
            player.annotation_file = as_setting(str(path))
        self.report({"INFO"}, f"{whose}: {len(timeline.spans)} spans and {len(timeline.keys)} key moments")


class BEYOND_MOCAP_FH_words(bpy.types.FileHandler):
    """Text files of labels dropped into a view"""

    bl_idname = "BEYOND_MOCAP_FH_words"
    bl_label = "Labels (Text File)"
    bl_import_operator = "beyond_mocap.import_words"
    bl_file_extensions = ".txt"

    @classmethod
    def poll_drop(cls, context):
        """Return whether there is a target for the labels."""
        where = context.area is not None and context.area.type in {"VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR"}
        return where and BEYOND_MOCAP_OT_import_words.poll(context)
