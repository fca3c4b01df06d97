"""New Curve: another curve for a rider to begin with."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ..scene.ride import curve, riders
from ..scene.ride.settings import choose, meant
from .edit_path import COUNT, DEGREE
from .verb import Verb


class BEYOND_MOCAP_OT_path_curve(Verb, bpy.types.Operator):
    """Give the rider another curve: along the original path, straight, or as the path is now with other points. The
curve before is removed if it was made here and nobody else rides it"""

    bl_idname = "beyond_mocap.path_curve"
    bl_label = "New Curve"

    shape: EnumProperty(name="Shape", items=curve.SHAPES, default="FITTED", description="Where the new curve runs")
    count: IntProperty(**COUNT)
    kind: EnumProperty(name="Curve", items=curve.KINDS, default="BEZIER", description="Kind of curve that is made")
    degree: IntProperty(**DEGREE)

    @classmethod
    def poll(cls, context):
        """A rider."""
        cls.poll_message_set("Leave edit mode first (Tab)")
        if context.mode not in {"OBJECT", "POSE"}:
            return False
        cls.poll_message_set("Select an armature that rides a path, or its curve")
        return bool(meant(context))

    def do(self, context):
        """The curve, which becomes active."""
        body = meant(context)[0]
        made = riders.new_curve(context, body, self.shape, self.count, self.kind, self.degree)
        if context.mode == "POSE":
            bpy.ops.object.mode_set(mode="OBJECT")
        choose(context, made)
