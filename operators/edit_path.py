"""Edit Path: the motion of an armature rides a curve from now on."""

from __future__ import annotations

from contextlib import suppress

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ..beyond_mocap.errors import BeyondMocapError, InputError
from ..scene import linked
from ..scene.ride import curve, riders
from ..scene.ride.settings import choose
from .verb import Verb

COUNT = {"name": "Points", "default": 0, "min": 0, "max": 200,
         "description": "Control points of the curve; 0: as many as it needs to lie within 3 cm"}
DEGREE = {"name": "Degree", "default": 3, "min": 2, "max": 5,
          "description": "Of a NURBS: how smooth it is, and how far each control point reaches"}


class BEYOND_MOCAP_OT_edit_path(Verb, bpy.types.Operator):
    """Lay the selected armature's motion on a curve along its path: edit the curve (Tab), and the motion follows. A
selected curve becomes the path instead, also of who rides already. The original action is put aside; Leave brings it
back"""

    bl_idname = "beyond_mocap.edit_path"
    bl_label = "Edit Path"

    count: IntProperty(**COUNT)
    kind: EnumProperty(name="Curve", items=curve.KINDS, default="BEZIER", description="Kind of curve that is made")
    degree: IntProperty(**DEGREE)
    straight: BoolProperty(name="Straight", description="A straight line, as long, instead of the original path")

    @classmethod
    def poll(cls, context):
        """Armatures."""
        cls.poll_message_set("Leave edit mode first (Tab)")
        if context.mode not in {"OBJECT", "POSE"}:
            return False
        cls.poll_message_set("Select an armature with a motion, and a curve if it is to ride that one")
        return bool(bodies(context))

    def do(self, context):
        """Curve and motion, and the curve active."""
        linked.refuse(context.scene)
        chosen = bodies(context)
        drawn = next((thing for thing in context.selected_objects if thing.type == "CURVE"), None)
        riding = [(body, body.beyond_mocap_ride.curve) for body in chosen if body.beyond_mocap_ride.on]
        if drawn is None and len(riding) == len(chosen):
            raise InputError(
                f"armature {chosen[0].name}", "it rides already", "one that does not", "edit its curve, or press Leave"
            )
        begun, used = [], drawn
        try:
            for body, _ in riding if drawn is not None else ():
                riders.change(context.scene, body, drawn)
            for body in [body for body in chosen if not body.beyond_mocap_ride.on]:
                before = body.beyond_mocap_ride.curve
                made = riders.begin(context, body, drawn, self.count, self.kind, self.degree, self.straight)
                begun.append((body, before, made if made not in (drawn, before) else None))
                used = used or made
        except BeyondMocapError:
            for body, before, made in begun:
                riders.revert(body, before, made)
            for body, before in riding:
                with suppress(BeyondMocapError):  # who could not ride his curve before cannot now
                    riders.change(context.scene, body, before)
            raise
        if context.mode == "POSE":
            bpy.ops.object.mode_set(mode="OBJECT")
        choose(context, used)
        names = ", ".join(body.name for body in chosen)
        self.report({"INFO"}, f"{names}: edit the points of {used.name} (Tab); the motion follows")


def bodies(context) -> list[bpy.types.Object]:
    """The armatures that are meant: the active one first, and the other selected ones."""
    active = context.view_layer.objects.active
    return sorted(
        (thing for thing in context.selected_objects if thing.type == "ARMATURE"), key=lambda thing: thing != active
    )
