"""Set Speed: how fast a player is at the chosen points of his drawn curve."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..beyond_mocap.motion.track.drawn import FASTEST
from ..scene import drawn_track, linked
from .verb import Verb


class BEYOND_MOCAP_OT_set_speed(Verb, bpy.types.Operator):
    """Set the speed at the selected points of the active curve, in metres per second; outside edit mode at all of them.
At a point of speed 0 the player waits. The speed is the point's Radius, the wait its Weight"""

    bl_idname = "beyond_mocap.set_speed"
    bl_label = "Set Speed"

    speed: bpy.props.FloatProperty(
        name="Speed", default=3.0, min=0.0, max=FASTEST, precision=2, description="Metres per second; 0: a stop"
    )
    wait: bpy.props.FloatProperty(
        name="Wait", default=1.0, min=0.01, max=60.0, precision=2, unit="TIME_ABSOLUTE",
        description="Seconds that are waited at a stop",
    )

    @classmethod
    def poll(cls, context):
        """A curve."""
        cls.poll_message_set("Choose a drawn curve first")
        return context.object is not None and context.object.type == "CURVE"

    def invoke(self, context, _event):
        """Ask for the numbers."""
        points = chosen(context.object)
        if points:
            self.speed, self.wait = min(points[0].radius, FASTEST), points[0].weight_softbody
        return context.window_manager.invoke_props_dialog(self)

    def do(self, context):
        """Set them."""
        drawn = context.object
        linked.refuse(drawn, drawn.data)
        points = chosen(drawn)
        if not points:
            raise InputError(f"curve {drawn.name}", "no point selected", "one or more", "select points in edit mode")
        drawn_track.set_speed(points, self.speed, self.wait)
        drawn.data.update_tag()
        self.report({"INFO"}, f"points set: {len(points)}")


def chosen(drawn: bpy.types.Object) -> list:
    """The selected control points of a curve in edit mode, all of them otherwise."""
    points = [point for spline in drawn.data.splines for point in drawn_track.points_of(spline)]
    if drawn.mode != "EDIT":
        return points
    return [point for point in points if getattr(point, "select_control_point", getattr(point, "select", False))]
