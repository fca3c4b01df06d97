"""Labels on the timeline: spans, sides, and the text form of annotations."""

from dataclasses import replace

import bpy
from bpy.props import FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import InputError, format_count
from ...scene.core.settings import find_active_player, to_setting_path
from ...scene.library import recordings
from ...scene.player import tracks
from ...scene.timeline import label_tracks as lanes
from ...scene.timeline import strip_writing as lay_strips
from ...scene.timeline import strips
from ...scene.timeline.strip_lines import format_labels, parse_labels
from ..operator_base import BaseOperator, ImportOperator
from .timeline import TimelineVerb, TimelineWritingVerb, compute_playhead, draw_problems, list_selected_spans


class BEYOND_MOCAP_OT_add_span(TimelineWritingVerb, bpy.types.Operator):
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
        draw_problems(self.layout, context, lambda: parse_labels(self.words, 0.0, 1.0))

    def do(self, context):
        chosen_range = round(self.start, 4), round(self.end, 4)  # Blender's numbers are not finer
        start, end = chosen_range if self.end != self.start else self.compute_range(context)
        if end <= start:
            raise InputError("span", f"the end {end:g} s is not after the start {start:g} s", "an end after the start")
        span = parse_labels(self.words, start, end)
        target = strips.ensure_target(context)
        lay_strips.add_span(target, span, strips.find_target_clock(context, target))

    @staticmethod
    def compute_range(context) -> tuple[float, float]:
        """Compute the preview range, or a second from the playhead on."""
        scene, target = context.scene, strips.find_target(context) or strips.ensure_target(context)
        clock = strips.find_target_clock(context, target)
        if scene.use_preview_range:
            return clock.to_seconds(scene.frame_preview_start), clock.to_seconds(scene.frame_preview_end)
        return clock.to_seconds(scene.frame_current), clock.to_seconds(scene.frame_current) + 1.0


class BEYOND_MOCAP_OT_split_span(TimelineVerb, bpy.types.Operator):
    """Split the spans at the playhead, or only the selected ones; both parts keep the labels"""

    bl_idname = "beyond_mocap.split_span"
    bl_label = "Split Span at Playhead"

    def do(self, context):
        target = strips.find_target(context)
        time, clock = compute_playhead(context, target), lanes.read_clock(target)
        frame = clock.to_whole_frame(time)
        there = [span for span in lanes.list_spans(target) if span.first < frame < span.last and not span.is_automatic]
        there = [span for span in there if span.is_selected] or there
        if not there:
            found = "no span is under the playhead"
            raise InputError(strips.describe_target(target), found, "a span", "move the playhead into a strip")
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
        chosen = [strip for _, strip in lanes.iter_strips(strips.find_target(context)) if strip.select]
        return sum(strip.action.beyond_mocap.kind != "moments" for strip in chosen) > 1

    def do(self, context):
        """Extend the first span and remove the others; their key moments stay."""
        target = strips.find_target(context)
        chosen = list_selected_spans(target)
        if len(chosen) < 2:
            found = "fewer than two spans are selected"
            raise InputError(strips.describe_target(target), found, "two spans or more", "select their strips")
        inner = [moment.key for moment in lanes.list_moments(target)
                 if moment.strip in {span.strip for span in chosen[1:]}]
        for placed in chosen[1:]:
            lay_strips.remove_span(target, placed.strip)
        end = max(placed.span.end for placed in chosen)
        lay_strips.change_span(target, chosen[0].strip, replace(chosen[0].span, end=end))
        for key in inner:
            lay_strips.add_moment(target, key, lanes.read_clock(target))
        words = {format_labels(placed.span) for placed in chosen}
        if len(words) > 1:
            self.report({"WARNING"}, f"joined as '{format_labels(chosen[0].span)}'")


class BEYOND_MOCAP_OT_mirror_side(TimelineVerb, bpy.types.Operator):
    """Swap left and right in the labels of the selected key moment and spans"""

    bl_idname = "beyond_mocap.mirror_side"
    bl_label = "Mirror Side"

    def do(self, context):
        """Change all items whose labels have a side."""
        target = strips.find_target(context)
        moments = [moment for moment in lanes.list_moments(target) if moment.is_selected]
        moments_with_side = [placed for placed in moments if _mirror_labels(placed.key) != placed.key]
        spans = [placed for placed in list_selected_spans(target) if _mirror_labels(placed.span) != placed.span]
        if not (moments_with_side or spans):
            found = "nothing with left or right is selected"
            raise InputError(strips.describe_target(target), found, "a span or key moment with a side", "select one")
        for placed in moments_with_side:
            lay_strips.change_moment(target, placed.strip, placed.index, _mirror_labels(placed.key))
        for placed in spans:
            lay_strips.change_span(target, placed.strip, _mirror_labels(placed.span))


def _mirror_labels(item):
    """Mirror the labels of a span or key moment."""
    return replace(item, words=annotation.swap_sides(item.words), avoid=annotation.swap_sides(item.avoid))


class BEYOND_MOCAP_OT_edit_words(TimelineVerb, bpy.types.Operator):
    """Edit the labels of the selected key moment or span, with problems shown while you type"""

    bl_idname = "beyond_mocap.edit_words"
    bl_label = "Edit Labels"
    words: StringProperty(name="Labels", description="Labels of the item; a leading - excludes one")

    def invoke(self, context, _event):
        """Open the dialog with the present labels."""
        if self.attempt(lambda: self.load_labels(context)) == {"CANCELLED"}:
            return {"CANCELLED"}
        return context.window_manager.invoke_props_dialog(self, width=480)

    def load_labels(self, context):
        """Load the present labels."""
        placed = find_selected_item(strips.find_target(context))
        self.words = format_labels(placed.key if isinstance(placed, lanes.PlacedMoment) else placed.span)

    def draw(self, context):
        """Draw the labels and what is wrong with them."""
        self.layout.prop(self, "words", text="")
        draw_problems(self.layout, context,
                      lambda: _parse_item(self.words, find_selected_item(strips.find_target(context))))

    def do(self, context):
        target = strips.find_target(context)
        placed = find_selected_item(target)
        item = _parse_item(self.words, placed)
        if isinstance(placed, lanes.PlacedMoment):
            lay_strips.change_moment(target, placed.strip, placed.index, item)
        else:
            lay_strips.change_span(target, placed.strip, item)


def find_selected_item(target: bpy.types.Object):
    """Find the selected key moment, else the selected span. Raises InputError unless there is exactly one."""
    moments = [moment for moment in lanes.list_moments(target) if moment.is_selected]
    spans = list_selected_spans(target)
    if moments:
        return moments[0]
    if len(spans) != 1:
        found = f"{len(spans)} spans are selected" if spans else "nothing is selected"
        raise InputError(strips.describe_target(target), found, "one span or key moment",
                         "click the name of a key moment, or one strip")
    return spans[0]


def _parse_item(words: str, placed):
    if isinstance(placed, lanes.PlacedMoment):
        return parse_labels(words, placed.time)
    return parse_labels(words, placed.span.start, placed.span.end)


class BEYOND_MOCAP_OT_read_words(BaseOperator, bpy.types.Operator):
    """Replace the active player's strips and key moments by the labels of the text or file chosen in step 2"""

    bl_idname = "beyond_mocap.read_words"
    bl_label = "Read Labels"
    needs = ("Import tracking, and choose a file or text with labels in step 2 first",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None
             and (player.annotation_text is not None or bool(player.annotation_file)))

    def do(self, context):
        """Read all labels, then write the strips."""
        settings = context.scene.beyond_mocap
        player = find_active_player(settings)
        timeline = strips.read_written_labels(player, settings.rate, tracks.read_track(settings, player))
        strips.write_player_timeline(context, player, timeline)
        source = strips.describe_label_source(player)
        self.report({"INFO"}, f"{player.name}: {strips.describe_counts(timeline)} from {source}")


class BEYOND_MOCAP_OT_words_to_text(TimelineVerb, bpy.types.Operator):
    """Write the strips and key moments to a text for the Text Editor, which becomes the player's text in step 2"""

    bl_idname = "beyond_mocap.words_to_text"
    bl_label = "Labels to Text"

    def do(self, context):
        """Write to the player's text, or to a new one."""
        target = strips.find_target(context)
        words = annotation.format_timeline(lanes.read_timeline(target, strips.describe_target(target)))
        player = None if strips.find_active_clip(context) else find_active_player(context.scene.beyond_mocap)
        text = player.annotation_text if player else None
        if text is None or text.library is not None:
            text = bpy.data.texts.new(f"{strips.describe_target(target)} labels")
        text.clear()
        text.write(words)
        if player:
            player.annotation_text = text
        self.report({"INFO"}, f"{format_count(words.count(chr(10)), 'line')} in the text {text.name}")


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
        target = strips.find_target(context)
        words = annotation.format_timeline(lanes.read_timeline(target, strips.describe_target(target)))
        with open(bpy.path.abspath(self.filepath), "w", encoding="utf-8", newline="\n") as file:
            file.write(words)
        self.report({"INFO"}, f"{format_count(words.count(chr(10)), 'line')} in {self.filepath}")


class BEYOND_MOCAP_OT_import_words(ImportOperator, bpy.types.Operator):
    """Import a text file of labels ('START END labels', 'TIME labels') in place of the strips of the active player, or
of the library clip whose armature is active"""

    bl_idname = "beyond_mocap.import_words"
    bl_label = "Import Labels"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})
    needs = ("Import tracking first: labels belong to a player",
             lambda context: bool(recordings.find_shown_clip(context.object))
             or find_active_player(context.scene.beyond_mocap) is not None)

    def do(self, context):
        """Read the file, then write the strips."""
        path = self.find_chosen_file("one text file of labels")
        settings, rig = context.scene.beyond_mocap, context.object
        if recordings.find_shown_clip(rig):
            motion, _ = recordings.read_recording(settings, recordings.find_shown_clip(rig), rig[recordings.FOLDER])
            timeline, owner = annotation.read_timeline(path, motion.fps), rig.name
            recordings.write_labels(rig, context.scene, motion, timeline)
        else:
            player = find_active_player(settings)
            start = float(tracks.read_track(settings, player).times[0])
            timeline, owner = annotation.read_timeline(path, settings.rate, start), player.name
            strips.write_player_timeline(context, player, timeline)
            player.annotation_file = to_setting_path(str(path))
        self.report({"INFO"}, f"{owner}: {strips.describe_counts(timeline)}")


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
