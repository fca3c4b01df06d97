"""The timeline of a player: show it, navigate it, and edit its key moments."""

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap.base.errors import InputError
from ...scene.core import window
from ...scene.core.live import call_soon
from ...scene.core.settings import find_active_player
from ...scene.result import bake
from ...scene.timeline import label_checks as word_checks
from ...scene.timeline import label_tracks as lanes
from ...scene.timeline import moment_names, strip_layout, strip_overlay, strips
from ...scene.timeline import strip_writing as lay_strips
from ...scene.timeline.strip_lines import parse_labels
from ..operator_base import BaseOperator


class TimelineVerb(BaseOperator):
    """A verb for the active player's timeline, or for that of a library clip that is being annotated."""

    needs = ("Import tracking in step 2 first, and place its players in the timeline",
             lambda context: strips.find_target(context) is not None)

    def attempt(self, action):
        """Run the action, then update the problems of labels."""
        result = super().attempt(action)
        word_checks.update_problems(bpy.context)
        return result


class TimelineWritingVerb(TimelineVerb):
    """A verb that creates the timeline if there is none yet."""

    needs = "Import tracking in step 2 first", lambda context: strips.can_have_timeline(context)


class MomentVerb(TimelineVerb):
    """A verb for the selected key moment."""

    needs = (*TimelineVerb.needs, "Select a key moment first: click its name in the NLA editor or in the list",
             lambda context: has_selected_moment(strips.find_target(context)))


def has_selected_moment(target: bpy.types.Object) -> bool:
    """Return whether a key moment is selected, without parsing labels."""
    return any(marker.select for _, strip in lanes.iter_strips(target) for marker in strip.action.pose_markers)


def find_selected_moment(target: bpy.types.Object) -> "lanes.PlacedMoment":
    """Find the selected key moment. Raises InputError if there is none."""
    found = next((moment for moment in lanes.list_moments(target) if moment.is_selected), None)
    if found is None:
        raise InputError(strips.describe_target(target), "no key moment is selected", "a key moment",
                         "click its name in the NLA editor")
    return found


def list_selected_spans(target: bpy.types.Object) -> "list[lanes.PlacedSpan]":
    """List the spans whose strips are selected, by start."""
    return [span for span in lanes.list_spans(target) if span.is_selected]


def draw_problems(layout, context: bpy.types.Context, item) -> None:
    """Draw what is wrong with the labels of the span or key moment that `item()` returns, a line each."""
    try:
        lines = word_checks.describe_problems(context.scene, item())
    except InputError as error:
        lines = [str(error)]
    for line in lines:
        layout.label(text=line, icon="ERROR")


def compute_playhead(context: bpy.types.Context, target: bpy.types.Object) -> float:
    """Compute the playhead in seconds on the clock of the object's strips."""
    return strips.find_target_clock(context, target).to_seconds(context.scene.frame_current_final)


class BEYOND_MOCAP_OT_show_timeline(BaseOperator, bpy.types.Operator):
    """Open the NLA editor below the 3D view, with the strips of all players and its Beyond Mocap tab"""

    bl_idname = "beyond_mocap.show_timeline"
    bl_label = "Show Timeline"
    bl_options = {"REGISTER"}
    needs = ("Import tracking in step 2 first",
             lambda context: any(player.dot for player in context.scene.beyond_mocap.players))

    def do(self, context):
        """Find or open the editor, show its sidebar and all strips."""
        area = window.open_editor(context, "NLA_EDITOR", "HORIZONTAL", 0.4)
        if area is None:
            return
        space = area.spaces.active
        space.show_region_ui = True
        if space.dopesheet is not None:
            space.dopesheet.show_only_selected = False
        uid = context.scene.session_uid
        call_soon(lambda: _set_up_editor(uid), 0.1)
        area.tag_redraw()


def _set_up_editor(scene: int) -> None:
    """Set the active tab and the view, which an editor accepts only after it has been drawn."""
    for window_shown in bpy.context.window_manager.windows:
        for area in window_shown.screen.areas:
            if area.type != "NLA_EDITOR" or window_shown.scene.session_uid != scene:
                continue
            regions = {region.type: region for region in area.regions}
            regions["UI"].active_panel_category = "Beyond Mocap"
            with bpy.context.temp_override(window=window_shown, area=area, region=regions["WINDOW"]):
                bpy.ops.nla.view_all()
            area.tag_redraw()


class BEYOND_MOCAP_OT_jump_to(BaseOperator, bpy.types.Operator):
    """Go to the frame of this line, or the next one of several, and select the player's body; Shift-click also frames
the body in the view"""

    bl_idname = "beyond_mocap.jump_to"
    bl_label = "Jump To"
    seconds: FloatProperty(name="Seconds", options={"SKIP_SAVE"},
                           description="Time to go to, on the tracking file's clock")
    stops: StringProperty(
        name="Stops", options={"SKIP_SAVE"},
        description="Several times separated by spaces; each call goes to the next one after the current frame, from "
        "the last to the first"
    )
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="Player whose body is selected; empty: "
                           "the active player")
    frame_view: BoolProperty(name="Frame in View", options={"SKIP_SAVE"},
                             description="Move the 3D views so that the body is visible")

    def invoke(self, context, event):
        """Run with the state of the Shift key."""
        self.frame_view = self.frame_view or event.shift
        return self.execute(context)

    def compute_frame(self, scene) -> int:
        """Compute the scene frame to go to."""
        try:
            seconds = [float(text) for text in self.stops.split()] or [self.seconds]
        except ValueError:
            raise InputError("stops", repr(self.stops), "seconds separated by spaces") from None
        frames = sorted(int(round(bake.compute_frame(scene, second))) for second in seconds)
        return next((frame for frame in frames if frame > scene.frame_current), frames[0])

    def do(self, context):
        """Set the frame and select the body."""
        settings = context.scene.beyond_mocap
        if self.player and self.player not in settings.players:
            raise InputError("player", self.player, "a name in the list", "check the list in step 2")
        player = settings.players[self.player] if self.player else find_active_player(settings)
        context.scene.frame_set(self.compute_frame(context.scene))
        body = player.body if player is not None else None
        if body is None or body.name not in context.view_layer.objects:
            return
        if context.view_layer.objects.active is None or context.mode == "OBJECT":
            window.select_only(context, body)
        if self.frame_view and not bpy.app.background:
            window.frame_objects(context, [body])


class BEYOND_MOCAP_OT_go_to_moment(TimelineVerb, bpy.types.Operator):
    """Move the playhead to this key moment and select it"""

    bl_idname = "beyond_mocap.go_to_moment"
    bl_label = "Go to Key Moment"
    strip: StringProperty(name="Strip", options={"SKIP_SAVE"}, description="The strip whose action has the marker")
    index: IntProperty(name="Index", options={"SKIP_SAVE"}, description="Index of the marker on the action")

    def do(self, context):
        """Select the moment and set the frame."""
        target = strips.find_target(context)
        strip = lanes.find_strip(target, self.strip or lanes.MOMENTS)
        markers = strip.action.pose_markers
        if not 0 <= self.index < len(markers):
            found = f"key moment {self.index} of strip {strip.name!r}"
            raise InputError(strips.describe_target(target), found, "one of this strip", f"it has {len(markers)}")
        lay_strips.select_moment(target, strip.name, self.index)
        context.scene.frame_set(lanes.compute_marker_frame(strip, markers[self.index]))


DRAG_PIXELS = 4  # pixels that the pointer may move before a click becomes a drag


class BEYOND_MOCAP_OT_pick_moment(BaseOperator, bpy.types.Operator):
    """Select the key moment whose name is under the pointer; drag it to move the moment, Esc cancels"""

    bl_idname = "beyond_mocap.pick_moment"
    bl_label = "Select Key Moment"
    bl_options = {"UNDO", "INTERNAL"}

    def execute(self, context):
        """Fail without a pointer."""
        self.report({"ERROR"}, "Select Key Moment needs the pointer in the NLA editor; use Go to Key Moment with "
                               "an index")
        return {"CANCELLED"}

    def invoke(self, context, event):
        """Select what is under the pointer; if there is nothing, pass the click to Blender."""
        region = context.region
        if region is None or region.type != "WINDOW":
            return {"PASS_THROUGH"}
        name = strip_layout.find_name_at(context, region, event.mouse_region_x, event.mouse_region_y)
        if name is None or name.target not in context.scene.objects:
            return {"PASS_THROUGH"}
        target = context.scene.objects[name.target]
        if self.attempt(lambda: self.select_moment(target, name)) == {"CANCELLED"}:
            return {"CANCELLED"}
        self.target, self.start_x, self.frame = name.target, event.mouse_region_x, name.frame
        self.dragged = False
        context.window_manager.modal_handler_add(self)
        moment_names.redraw_editors()
        return {"RUNNING_MODAL"}

    def select_moment(self, target, name):
        """Select the moment and store its labels."""
        lay_strips.check_editable(target)
        lay_strips.select_moment(target, name.strip, name.index)
        self.before = next((moment for moment in lanes.list_moments(target) if moment.is_selected), None)
        if self.before is None:
            raise InputError(target.name, "this key moment cannot be read", "labels", "rename it in the list")

    def modal(self, context, event):
        """Follow the pointer by whole frames until the button is released."""
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self.write_key(context, self.before.key)
            return {"CANCELLED"}
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            context.area.header_text_set(None)
            word_checks.update_problems(context)
            return {"FINISHED"}
        if event.type == "MOUSEMOVE":
            self.dragged |= abs(event.mouse_region_x - self.start_x) > DRAG_PIXELS
            if self.dragged:
                self.follow_pointer(context, event.mouse_region_x)
        return {"RUNNING_MODAL"}

    def follow_pointer(self, context, x: float):
        """Move the moment by as many frames as the pointer moved since the press."""
        view = context.region.view2d
        offset = view.region_to_view(x, 0)[0] - view.region_to_view(self.start_x, 0)[0]
        frame = self.frame + round(offset)
        clock = lanes.read_clock(context.scene.objects[self.target])
        is_unmoved = frame == self.frame
        self.write_key(context, self.before.key if is_unmoved
                       else replace(self.before.key, time=clock.to_seconds(frame)))
        moved = clock.to_seconds(frame) - clock.to_seconds(self.frame)
        context.area.header_text_set(f"{clock.to_seconds(frame):.2f} s ({moved:+.2f})    Frame {frame} "
                                     f"({frame - self.frame:+d})    Esc: Cancel")

    def write_key(self, context, key):
        """Write the key moment and redraw it."""
        target = context.scene.objects[self.target]
        now = next(moment for moment in lanes.list_moments(target) if moment.is_selected)
        if now.key != key:
            lay_strips.change_moment(target, now.strip, now.index, key)
        if key == self.before.key:
            context.area.header_text_set(None)
        moment_names.redraw_editors()


class BEYOND_MOCAP_OT_hover_timeline(BaseOperator, bpy.types.Operator):
    """Show what is under the pointer in the NLA editor or the dope sheet"""

    bl_idname = "beyond_mocap.hover_timeline"
    bl_label = "Show Label Under Pointer"
    bl_options = {"INTERNAL"}

    def execute(self, context):
        """Fail without a pointer."""
        self.report({"ERROR"}, "Show Label Under Pointer needs the pointer in the NLA editor; read the list in its "
                               "sidebar instead")
        return {"CANCELLED"}

    def invoke(self, context, event):
        """Take note of the pointer, and pass the event on."""
        if context.region is not None and context.region.type == "WINDOW":
            strip_overlay.move_pointer(context, event.mouse_region_x, event.mouse_region_y)
        return {"PASS_THROUGH"}


class BEYOND_MOCAP_OT_add_moment(TimelineWritingVerb, bpy.types.Operator):
    """Add a key moment at the playhead: a kick, a header, a catch, exact to half a frame"""

    bl_idname = "beyond_mocap.add_moment"
    bl_label = "Add Key Moment"
    words: StringProperty(name="Labels", default="kick", description="Labels of the moment; a leading - excludes one")

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self, width=420)

    def draw(self, context):
        """Draw the labels and what is wrong with them."""
        self.layout.prop(self, "words")
        draw_problems(self.layout, context, lambda: parse_labels(self.words, 0.0))

    def do(self, context):
        parse_labels(self.words, 0.0)
        target = strips.ensure_target(context)
        lay_strips.add_moment(target, parse_labels(self.words, compute_playhead(context, target)),
                              strips.find_target_clock(context, target))


class BEYOND_MOCAP_OT_move_moment(MomentVerb, bpy.types.Operator):
    """Move the selected key moment to the playhead"""

    bl_idname = "beyond_mocap.move_moment"
    bl_label = "Move Key Moment"
    frames: IntProperty(name="Frames", options={"SKIP_SAVE"}, description="Frames to move by; 0: move to the playhead")

    def do(self, context):
        target = strips.find_target(context)
        moment, clock = find_selected_moment(target), lanes.read_clock(target)
        time = clock.to_seconds(moment.frame + self.frames) if self.frames else compute_playhead(context, target)
        lay_strips.change_moment(target, moment.strip, moment.index, replace(moment.key, time=time))


class BEYOND_MOCAP_OT_delete_moment(MomentVerb, bpy.types.Operator):
    """Delete the selected key moment"""

    bl_idname = "beyond_mocap.delete_moment"
    bl_label = "Delete Key Moment"

    def do(self, context):
        target = strips.find_target(context)
        moment = find_selected_moment(target)
        lay_strips.remove_moment(target, moment.strip, moment.index)
