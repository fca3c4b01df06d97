"""Edit Path: the motion of an armature rides a curve from now on."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ..beyond_mocap.errors import BeyondMocapError, InputError
from ..scene import linked
from ..scene.ride import curve, riders
from .verb import Verb

COUNT = {"name": "Points", "default": 0, "min": 0, "max": 200,
         "description": "Control points of the curve; 0: as many as it needs to lie within 3 cm"}
DEGREE = {"name": "Degree", "default": 3, "min": 2, "max": 5,
          "description": "Of a NURBS: how smooth it is, and how far each control point reaches"}


class BEYOND_MOCAP_OT_edit_path(Verb, bpy.types.Operator):
    """Lay the selected armature's motion on a curve along its path: edit the curve (Tab), and the motion follows. A selected
curve becomes the path instead. The original action is put aside; Leave brings it back"""

    bl_idname = "beyond_mocap.edit_path"
    bl_label = "Edit Path"

    count: IntProperty(**COUNT)
    kind: EnumProperty(name="Curve", items=curve.KINDS, default="BEZIER", description="Kind of curve that is made")
    degree: IntProperty(**DEGREE)
    straight: BoolProperty(name="Straight", description="A straight line, as long, instead of the original path")

    @classmethod
    def poll(cls, context):
        """Armatures that do not ride yet."""
        cls.poll_message_set("Leave edit mode first (Tab)")
        if context.mode not in {"OBJECT", "POSE"}:
            return False
        cls.poll_message_set("Select an armature with a motion, and a curve if it is to ride that one")
        return bool(bodies(context))

    def do(self, context):
        """Curve and motion, and the curve active."""
        chosen = bodies(context)
        waiting = [body for body in chosen if not body.beyond_mocap_ride.on]
        if not waiting:
            raise InputError(f"armature {chosen[0].name}", "it rides already", "one that does not", "edit its curve, or press Leave")
        linked.refuse(context.scene)
        drawn = next((thing for thing in context.selected_objects if thing.type == "CURVE"), None)
        begun = []
        try:
            for body in waiting:
                before = body.beyond_mocap_ride.curve
                begun.append((body, before, riders.begin(context, body, drawn, self.count, self.kind, self.degree, self.straight)))
        except BeyondMocapError:
            for body, before, used in begun:
                riders.revert(body, before, used if used not in (drawn, before) else None)
            raise
        made = begun[0][2]
        if context.mode == "POSE":
            bpy.ops.object.mode_set(mode="OBJECT")
        riders.choose(context, made)
        self.report({"INFO"}, f"{', '.join(body.name for body, *_ in begun)}: edit the points of {made.name} (Tab); the motion follows")


def bodies(context) -> list[bpy.types.Object]:
    """The armatures that are meant: the active one first, and the other selected ones."""
    active = context.view_layer.objects.active
    return sorted((thing for thing in context.selected_objects if thing.type == "ARMATURE"), key=lambda thing: thing != active)
