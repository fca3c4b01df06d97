"""Pick Key Moment: click its name in the NLA editor, drag it to move the moment."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import lanes, lay_strips, moment_names, word_checks
from .verb import Verb

STILL = 4  # pixels that the pointer may move before a click becomes a drag


class BEYOND_MOCAP_OT_pick_moment(Verb, bpy.types.Operator):
    """Pick the key moment whose name is under the pointer; drag it to move the moment, Esc puts it back"""

    bl_idname = "beyond_mocap.pick_moment"
    bl_label = "Pick Key Moment"
    bl_options = {"UNDO", "INTERNAL"}

    def execute(self, context):
        """Only a pointer can pick."""
        return self.failed("Pick Key Moment works with the pointer in the NLA editor; Go to Key Moment picks by index")

    def invoke(self, context, event):
        """Pick what is under the pointer; where that is nothing, the click is Blender's own."""
        region = context.region
        if region is None or region.type != "WINDOW":
            return {"PASS_THROUGH"}
        name = moment_names.hit(context, region, event.mouse_region_x, event.mouse_region_y)
        if name is None or name.target not in context.scene.objects:
            return {"PASS_THROUGH"}
        target = context.scene.objects[name.target]
        if self.attempt(lambda: self.pick(target, name)) == {"CANCELLED"}:
            return {"CANCELLED"}
        self.target, self.begun, self.frame = name.target, event.mouse_region_x, name.frame
        self.dragged = False
        context.window_manager.modal_handler_add(self)
        moment_names.redraw()
        return {"RUNNING_MODAL"}

    def pick(self, target, name):
        """Pick it, and remember what it says."""
        lay_strips.check_editable(target)
        lay_strips.pick(target, name.strip, name.index)
        self.before = next((moment for moment in lanes.moments(target) if moment.selected), None)
        if self.before is None:
            raise InputError(target.name, "this key moment cannot be read", "words", "rename it in the list")

    def modal(self, context, event):
        """Follow the pointer by whole frames until the button is let go."""
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self.put(context, self.before.key)
            return {"CANCELLED"}
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            context.area.header_text_set(None)
            word_checks.keep(context)
            return {"FINISHED"}
        if event.type == "MOUSEMOVE":
            self.dragged |= abs(event.mouse_region_x - self.begun) > STILL
            if self.dragged:
                self.follow(context, event.mouse_region_x)
        return {"RUNNING_MODAL"}

    def follow(self, context, x: float):
        """The moment on the frame that lies as far from its own as the pointer from where it was pressed."""
        view = context.region.view2d
        way = view.region_to_view(x, 0)[0] - view.region_to_view(self.begun, 0)[0]
        frame = self.frame + round(way)
        clock = lanes.written_for(context.scene.objects[self.target])
        back = frame == self.frame
        self.put(context, self.before.key if back else replace(self.before.key, time=clock.seconds(frame)))
        context.area.header_text_set(f"Frame {frame} ({frame - self.frame:+d})    Esc: put back")

    def put(self, context, key):
        """Write the key moment and show it."""
        target = context.scene.objects[self.target]
        now = next(moment for moment in lanes.moments(target) if moment.selected)
        if now.key != key:
            lay_strips.change_moment(target, now.strip, now.index, key)
        if key == self.before.key:
            context.area.header_text_set(None)
        moment_names.redraw()
