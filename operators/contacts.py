"""Fix Foot: contacts of the active player's feet are picked in the 3D view, dragged, made longer or shorter, left out
or added, and the take follows.
"""

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d

from ..beyond_mocap.base.errors import BeyondMocapError
from ..scene.core import window
from ..scene.core.settings import find_active_player
from ..scene.overlays import contact_handles, store
from ..scene.player import contact_edits
from ..scene.player.pins import find_current_second
from .operator_base import NEEDS_LIBRARY
from .take_queue import TakeOperator

ACTIONS = (("MOVE", "Move", "Move the contact on the ground"),
           ("LONGER", "Longer", "Let the contact begin earlier and end later"),
           ("SHORTER", "Shorter", "Let the contact begin later and end earlier"),
           ("SHIFT", "Shift in Time", "Let the contact begin and end later"),
           ("DELETE", "Delete", "Leave the contact out"),
           ("ADD", "Add", "Add a contact"))
STATUS = ("Drag: move a footprint   Ctrl + drag: shift it in time   + / -: longer, shorter   X: delete   "
          "A: add at this frame   Esc: stop")
LEAST_DRAG = 0.003  # metres that a footprint is dragged at least
SECONDS_PER_PIXEL = 0.004  # of a footprint that is dragged along time
STEP = 0.05  # s by which a contact becomes longer or shorter
LONGER_KEYS = {"NUMPAD_PLUS", "PLUS", "EQUAL", "RIGHT_BRACKET"}
SHORTER_KEYS = {"NUMPAD_MINUS", "MINUS", "LEFT_BRACKET"}


def apply_edit(player, action: str, contact, offset=(0.0, 0.0), seconds: float = STEP) -> str:
    """Apply an edit to a contact of the player's take; returns what has changed."""
    half = 0.5 * seconds
    if action == "MOVE":
        contact_edits.change_contact(player, contact, offset)
    elif action == "DELETE":
        contact_edits.delete_contact(player, contact)
    else:
        start, end = {"LONGER": (-half, half), "SHORTER": (half, -half), "SHIFT": (seconds, seconds)}[action]
        contact_edits.change_contact(player, contact, start=start, end=end)
    return f"{player.name}: {contact.foot} foot at {contact.middle:.2f} s"


class BEYOND_MOCAP_OT_fix_foot(TakeOperator, bpy.types.Operator):
    """Pick the active player's footprints in the 3D view: drag to move them, Ctrl and drag to shift them in time, + and
- to make a contact longer or shorter, X to delete it, A to add one; the take follows"""

    bl_idname = "beyond_mocap.fix_foot"
    bl_label = "Fix Foot"
    kind = "update"
    action: EnumProperty(name="Edit", items=ACTIONS, options={"SKIP_SAVE"}, description="What to do with the contact")
    foot: EnumProperty(name="Foot", items=contact_edits.FEET, options={"SKIP_SAVE"}, description="Foot of the contact")
    time: FloatProperty(name="Time", default=-1.0, unit="TIME_ABSOLUTE", options={"SKIP_SAVE"},
                        description="Time on the track's clock near the contact; -1 for the current frame")
    offset: FloatVectorProperty(name="Offset", size=2, subtype="XYZ", options={"SKIP_SAVE"},
                                description="Metres by which the contact is moved")
    seconds: FloatProperty(name="Seconds", default=STEP, soft_min=-0.5, soft_max=0.5, options={"SKIP_SAVE"},
                           description="Seconds by which the contact becomes longer or shorter, or is shifted")
    needs = (*NEEDS_LIBRARY, "Synthesize a player first",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None
             and bool(player.take))

    def do(self, context):
        """Edit one contact and update the take; where that fails, the contact stays as it was."""
        player = find_active_player(context.scene.beyond_mocap)
        before = contact_edits.read_contact_edits(player)
        try:
            line = self.edit_contact(context, player)
            self.player = player.name
            super().do(context)
        except (BeyondMocapError, OSError):
            contact_edits.write_contact_edits(player, before)
            raise
        self.report({"INFO"}, line)

    def edit_contact(self, context, player) -> str:
        """Edit the contact of the operator's properties; returns what has changed."""
        take = contact_edits.find_take(player)
        contacts = contact_edits.list_contacts(take)
        seconds = find_current_second(context.scene) if self.time < 0.0 else self.time
        if self.action == "ADD":
            contact_edits.check_time(take, seconds)
            contact_edits.add_contact(player, contacts, self.foot, seconds)
            return f"{player.name}: {self.foot} foot at {seconds:.2f} s"
        contact = contact_edits.find_contact(contacts, self.foot, seconds)
        return apply_edit(player, self.action, contact, offset=self.offset, seconds=self.seconds)

    def invoke(self, context, event):
        """Show the footprints and wait for the pointer."""
        if bpy.app.background or context.area is None or context.area.type != "VIEW_3D":
            return self.execute(context)
        self.player, self.handles, self.drag = "", None, None
        self.is_changed = self.is_updating = False
        if self.attempt(lambda: self.show_contacts(context)) != {"FINISHED"}:
            return {"CANCELLED"}
        self.view, self.region = context.area, next(one for one in context.area.regions if one.type == "WINDOW")
        context.window_manager.modal_handler_add(self)
        window.show_status(STATUS)
        return {"RUNNING_MODAL"}

    def show_contacts(self, context):
        """Show the footprints of the active player's newest take."""
        player = find_active_player(context.scene.beyond_mocap)
        contacts = contact_edits.list_contacts(contact_edits.find_take(player))
        edited = [contact_edits.find_edit(player, contact) is not None for contact in contacts]
        before, self.player = self.handles, player.name
        self.handles = contact_handles.Handles(context.scene.name, player.take,
                                               store.take_to_world(context.scene, player.body), contacts, edited)
        if before is not None and before.chosen is not None:  # the chosen footprint stays chosen
            old = before.contacts[before.chosen]
            same = [number for number, one in enumerate(contacts) if one.foot == old.foot
                    and one.start <= old.middle <= one.end]
            self.handles.chosen = same[0] if same else None
        contact_handles.show_handles(self.handles)
        window.redraw_editors()

    def modal(self, context, event):
        """Handle the pointer over the view, and the keys; pass on all other events."""
        player = find_active_player(context.scene.beyond_mocap)
        areas = [area for shown in context.window_manager.windows for area in shown.screen.areas]
        if player is None or self.handles is None or context.scene.name != self.handles.scene or self.view not in areas:
            return self.stop(context)
        if self.drag is None and (player.take, player.name) != (self.handles.take, self.player):
            if self.attempt(lambda: self.show_contacts(context)) != {"FINISHED"}:
                return self.stop(context)
        if event.type in {"ESC", "RIGHTMOUSE", "RET"} and event.value == "PRESS":
            if self.drag is None:
                return self.stop(context) if event.type != "RIGHTMOUSE" else {"PASS_THROUGH"}
            self.end_drag()
            return {"RUNNING_MODAL"}
        if event.type == "MOUSEMOVE":
            return self.handle_motion(context, event)
        if event.type == "LEFTMOUSE":
            return self.handle_button(context, event)
        if event.value == "PRESS" and not event.ctrl and not event.alt:
            return self.handle_key(context, event)
        return {"PASS_THROUGH"}

    def handle_motion(self, context, event):
        """Highlight the footprint under the pointer, or drag the chosen one."""
        place = self.find_ground_place(event)
        if self.is_updating and not context.window_manager.beyond_mocap_work.kind:
            self.is_updating = False
            window.show_status(STATUS)  # the update has shown its progress there
        if self.drag is None:
            found = None if place is None else self.handles.find_nearest(place, find_current_second(context.scene))
            if found is not None and found != self.handles.chosen:
                self.handles.chosen = found
                self.view.tag_redraw()
            return {"PASS_THROUGH"}
        start, pixel = self.drag
        if event.ctrl:
            self.handles.offset = np.zeros(2)
            by = self.measure_time_drag(event)
            contact = self.handles.contacts[self.handles.chosen]
            window.show_status(f"{contact.foot} foot: {contact.start + by:.2f} to "
                               f"{contact.end + by:.2f} s ({by:+.2f} s)")
        elif place is not None:
            self.handles.offset = place - start
            length = 100.0 * float(np.linalg.norm(self.handles.offset))
            window.show_status(f"{length:.0f} cm   Esc: cancel   {STATUS}")
        self.view.tag_redraw()
        return {"RUNNING_MODAL"}

    def handle_button(self, context, event):
        """Begin to drag the footprint under the pointer; on release, edit the contact."""
        place = self.find_ground_place(event)
        if event.value == "PRESS":
            found = None if place is None else self.handles.find_nearest(place, find_current_second(context.scene))
            if found is None:
                return {"PASS_THROUGH"}
            self.handles.chosen, self.drag = found, (place, event.mouse_x)
            return {"RUNNING_MODAL"}
        if self.drag is None:
            return {"PASS_THROUGH"}
        offset, by, contact = self.handles.offset, self.measure_time_drag(event), \
            self.handles.contacts[self.handles.chosen]
        if event.ctrl and abs(by) > 0.01:
            self.edit(context, "SHIFT", contact, seconds=by)
        elif not event.ctrl and np.linalg.norm(offset) > LEAST_DRAG:
            self.edit(context, "MOVE", contact, offset=tuple(float(value) for value in offset))
        else:
            self.handles.offset = np.zeros(2)
        self.drag = None
        window.show_status(STATUS)
        return {"RUNNING_MODAL"}

    def handle_key(self, context, event):
        """Edit the chosen contact by a key."""
        chosen = self.handles.chosen
        contact = self.handles.contacts[chosen] if chosen is not None else None
        key = event.type
        if key not in {*LONGER_KEYS, *SHORTER_KEYS, "X", "DEL", "A"} or self.find_ground_place(event) is None:
            return {"PASS_THROUGH"}
        if key == "A":
            self.attempt(lambda: self.add(context, contact))
        elif contact is not None:
            action = "LONGER" if key in LONGER_KEYS else "SHORTER" if key in SHORTER_KEYS else "DELETE"
            self.edit(context, action, contact)
        return {"RUNNING_MODAL"}

    def add(self, context, contact):
        """Add a contact on the current frame, of the chosen contact's foot, or of the left one without a choice."""
        player, seconds = find_active_player(context.scene.beyond_mocap), find_current_second(context.scene)
        foot = contact.foot if contact is not None else "left"
        contact_edits.check_time(contact_edits.find_take(player), seconds)
        contact_edits.add_contact(player, self.handles.contacts, foot, seconds)
        self.update(context, f"{player.name}: {foot} foot added")

    def edit(self, context, action, contact, **how):
        """Edit a contact, with an undo step of its own, and update the take."""
        player = find_active_player(context.scene.beyond_mocap)
        if self.attempt(lambda: apply_edit(player, action, contact, **how)) == {"FINISHED"}:
            self.update(context, f"{player.name}: {contact.foot} foot at {contact.middle:.2f} s")
        else:
            self.handles.offset = np.zeros(2)

    def update(self, context, message: str):
        """Update the take quickly; its figures follow when the operator stops."""
        self.is_changed = self.is_updating = True
        bpy.ops.ed.undo_push(message=message[:60])
        bpy.ops.beyond_mocap.update_live("INVOKE_DEFAULT", player=self.player, kind="quick")
        self.view.tag_redraw()

    def end_drag(self):
        """Put the footprint back where it was."""
        self.drag, self.handles.offset = None, np.zeros(2)
        self.view.tag_redraw()

    def measure_time_drag(self, event) -> float:
        """Measure by how many seconds the footprint is dragged."""
        return SECONDS_PER_PIXEL * (event.mouse_x - self.drag[1])

    def find_ground_place(self, event) -> np.ndarray | None:
        """Find the place (2,) m on the take's ground under the pointer; None outside the view or above the horizon."""
        region = self.region
        x, y = event.mouse_x - region.x, event.mouse_y - region.y
        left, bottom, right, top = window.find_free_region(self.view, region)
        if not (left <= x <= right and bottom <= y <= top):
            return None
        space = self.view.spaces.active.region_3d
        inward = self.handles.world.inverted_safe()
        origin = inward @ region_2d_to_origin_3d(region, space, (x, y))
        along = inward.to_3x3() @ region_2d_to_vector_3d(region, space, (x, y))
        if along.z > -1e-4 or origin.z <= 0.0:
            return None
        place = origin - along * (origin.z / along.z)
        return np.array(place[:2])

    def stop(self, context):
        """Stop: hide the footprints; a full take with its figures replaces a quick one."""
        self.cancel(context)
        if self.is_changed:
            bpy.ops.beyond_mocap.update_live("INVOKE_DEFAULT", player=self.player, kind="whole")
        return {"CANCELLED"}

    def cancel(self, context):
        """Clean up, also when Blender ends the operator (a file is loaded, the window closes)."""
        contact_handles.show_handles(None)
        window.clear_status()
        window.redraw_editors()


class BEYOND_MOCAP_OT_remove_contact_edit(TakeOperator, bpy.types.Operator):
    """Remove the chosen edit: its contact is again as it was synthesized"""

    bl_idname = "beyond_mocap.remove_contact_edit"
    bl_label = "Remove Contact Edit"
    kind = "update"
    needs = ("The active player has no edited contacts",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None
             and len(player.contact_edits) > 0)

    def do(self, context):
        """Remove the edit, and update the take where there is one; where that fails, the edit stays."""
        player = find_active_player(context.scene.beyond_mocap)
        before = contact_edits.read_contact_edits(player)
        contact_edits.remove_edit(player, min(player.active_contact_edit, len(before) - 1))
        self.player = player.name
        if not player.take:
            return
        try:
            super().do(context)
        except (BeyondMocapError, OSError):
            contact_edits.write_contact_edits(player, before)
            raise

    def invoke(self, context, event):
        """Remove the edit, and queue the update."""
        player = find_active_player(context.scene.beyond_mocap)
        if bpy.app.background or not player.take:
            return self.execute(context)
        contact_edits.remove_edit(player, min(player.active_contact_edit, len(player.contact_edits) - 1))
        self.player = player.name
        return super().invoke(context, event)


def unregister() -> None:
    """Hide the footprints with the extension."""
    contact_handles.show_handles(None)
